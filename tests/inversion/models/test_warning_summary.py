"""Warnings of several models: the same finding once, the gravest first, and none lost."""

from __future__ import annotations

from pathlib import Path

import birdstrike
from birdstrike.inversion.models.warning_summary import summarised

LATE = "{}: 0 points before and 30 after the simulated record 0 .. 2.5 ms are left out of the fit"
POOR = (
    "the emulator predicts left-out runs of {} (Q2 {:.2f}) poorly: the channel carries the error of these predictions "
    "and counts for less; add runs, or leave it out: --channels"
)
TWO_POOR = (
    "the emulator predicts left-out runs of force of s120 (Q2 0.31) and strain along 0 (Q2 0.62) poorly: each carries "
    "the error of these predictions and counts for less; add runs, or leave them out: --channels"
)
UNKNOWN = "bird.particles = 150 is too coarse; set bird.particles = 300 or more"


def test_one_warning_for_all_models_and_channels_with_the_worst_named() -> None:
    own = {
        "null": [LATE.format("force of s70"), LATE.format("force of s120"), POOR.format("force of s70", 0.62)],
        "elastic": [LATE.format("force of s70"), LATE.format("force of s120"), TWO_POOR],
    }
    poor, late = summarised(own)
    assert poor.startswith("left-out runs are predicted poorly by the emulators of null and elastic, in 3 channels (")
    assert "worst: force of s120 with elastic, Q2 0.31" in poor
    assert late.startswith("60 points of 2 channels outside the simulated time (0 .. 2.5 ms)")


def test_channels_of_a_shot_with_brackets_in_its_name_are_counted_and_one_without_a_q2_is_the_worst() -> None:
    pair = POOR.replace("{} (Q2 {:.2f})", "force of shot (1) (Q2 0.31) and strain 1 of shot (2) (Q2 {:.2f})")
    (told,) = summarised({"null": [pair.format(0.5)]})
    assert "in 2 channels (worst: force of shot (1) with null, Q2 0.31)" in told
    (told,) = summarised({"null": [pair.format(float("nan"))]})
    assert "in 2 channels (worst: strain 1 of shot (2) with null, Q2 nan)" in told


def test_a_residual_that_an_emulator_alone_leaves_is_not_called_what_the_model_lacks() -> None:
    """The model that made the records, at its constants 0.7 times the noise off, "lacked something"."""
    rest = (
        "force of s70: the residual of the best fit is 1.3 times the stated noise, so the intervals were widened by a"
    )
    (told,) = summarised({"null": [f"{rest} factor 1.3"]})
    assert told.startswith("the best fit of the emulator of null leaves more than noise: intervals were widened, by a ")
    assert "by the solver, is that of the noise, the emulator errs there: raise --runs; else the model lacks" in told


def test_a_model_without_an_answer_comes_first_and_an_unknown_warning_is_kept_with_its_models() -> None:
    own = {
        "null": [LATE.format("force"), UNKNOWN],
        "elastic": ["no answer: no verification run finished"],
        "murnaghan": [UNKNOWN],
    }
    first, second, third = summarised(own)
    assert first.startswith("elastic cannot be ranked")
    assert "no verification run finished" in first
    assert second == f"null and murnaghan: {UNKNOWN}"
    assert "outside the simulated time" in third


def test_failed_simulations_are_counted_with_their_commonest_reason() -> None:
    failed = "run {} failed twice and is left out: contact created {}% of the normal kinetic energy; refine the mesh"
    near = "a run near the answer failed and is left out: the bird was turned inside out; lower solver.courant"
    (told,) = summarised({"elastic": [failed.format(1, 1.2), failed.format(7, 1.4), near]})
    assert told.startswith("3 simulations failed and are left out (elastic 3), most often because contact created 1.2%")


def test_runs_left_out_and_gaps_of_all_models_are_one_warning_each() -> None:
    lost = "runs 3, 14 lost more than 5 % of the bird: the emulator leaves them out"
    gap = "viscosity 1470 .. 1500 Pa s: too few smooth runs stand there, so no answer is sought there"
    runs, gaps = summarised({"null": [gap, lost], "murnaghan": [lost.replace("3, 14", "7"), gap]})
    assert runs.startswith("3 runs (null 2 and murnaghan 1) lost more than 5 % of the bird and are left out")
    assert "viscosity 1470 .. 1500 Pa s (null) and viscosity 1470 .. 1500 Pa s (murnaghan)" in gaps


def test_a_stated_noise_that_the_records_contradict_is_one_warning() -> None:
    scatter = (
        "strain along {} of s70: the noise stated (0.00003, case) is less than the scatter of neighbouring points "
        "({}), which is used instead; correct what is stated (sensors.strain.noise of its case)"
    )
    before = scatter.replace("less than the scatter of neighbouring points", "not that of the record before contact")
    own = {"null": [scatter.format(0, 0.0003), scatter.format(90, 0.0002)], "elastic": [scatter.format(0, 0.0004)]}
    (told,) = summarised(own)
    assert told.startswith(
        "the noise stated for 2 channels (strain along 0 of s70 and strain along 90 of s70) is not the scatter of "
        "neighbouring points, which is used instead (the first: stated 0.00003, case; found 0.0003)"
    )
    (told,) = summarised({"null": [scatter.format(0, 0.0003), before.format(45, "0.0001 over 20 points")]})
    assert "is not the scatter of neighbouring points and that of the record before contact" in told


READ = (
    "the model cannot produce this curve: ",
    "best fit is {found.fit:.1f} times",
    "the emulator is too coarse for this curve: ",
    "the simulation at an answer failed ({failure}): run {number} of the campaign",
    "a run near the answer failed and is left out: ",
    "failed twice",
    " and is left out: {",
    "chains have not settled after",
    "(R-hat {",
    " lies beside the runs best",
    " has the shape of the runs",
    " has a size",
    " has the opposite sign",
    "the emulator predicts left-out runs of ",
    " (Q2 {",
    " poorly: {",
    "widened by a factor {",
    "far off their neighbours",
    " points before and {",
    " after the simulated record ",
    ": the noise stated (",
    "is less than the scatter of neighbouring points (",
    "is not that of the record before contact (",
    ", which is used ",
    ": no noise is stated; ",
    " lost more than {",
    ": the emulator leaves them out",
    ": too few smooth runs stand there",
)
"""Parts of warnings by which they are read, each as it stands in the sources that give it."""


def test_what_a_warning_is_read_by_still_stands_in_the_sources() -> None:
    package = Path(birdstrike.__file__).parent
    files = [path for part in ("doe", "inversion") for path in (package / part / ".").rglob("*.py")]
    sources = "".join(path.read_text(encoding="utf-8") for path in files if path.name != "warning_summary.py")
    assert [part for part in READ if part not in sources] == []
