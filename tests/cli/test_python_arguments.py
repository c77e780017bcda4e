"""The Python functions' arguments: what does not fit is refused by name before anything is computed."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import birdstrike
from birdstrike.data.curves import Measured
from birdstrike.data.errors import UserError
from birdstrike.inversion.prediction.predict import _normalised

# pyright: reportArgumentType=false

COARSE = {"bird.particles": 120, "plate.elements": [10, 8]}


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"step_factor": 0}, "step_factor = 0 is no number above 0"),
        ({"step_factor": -1.0}, "step_factor = -1.0 is no number above 0"),
        ({"step_factor": float("nan")}, "step_factor = nan is no number above 0"),
        ({"step_factor": "half"}, "step_factor = 'half' is no number above 0"),
        ({"threads": -2}, "threads = -2 is no whole number of at least 1"),
        ({"threads": 0}, "threads = 0 is no whole number of at least 1"),
        ({"threads": 2.5}, "threads = 2.5 is no whole number of at least 1"),
    ],
)
def test_a_simulation_refuses_a_step_or_threads_that_it_cannot_have(given: Mapping[str, Any], said: str) -> None:
    with pytest.raises(UserError, match=said):
        birdstrike.simulate(birdstrike.load_case("demo", COARSE), **given)


@pytest.mark.parametrize("given", [{"runs": 9.5}, {"runs": "9"}, {"seed": 1.5}, {"seed": "a"}, {"workers": 1.5}])
def test_a_campaign_counts_in_whole_numbers(given: Mapping[str, Any], tmp_path: Path) -> None:
    ((name, value),) = given.items()
    with pytest.raises(UserError, match=f"--{name} = {value!r} is no whole number"):
        birdstrike.run_doe(birdstrike.load_case("demo", COARSE), tmp_path / "campaign", **given)
    assert not list(tmp_path.rglob("*.h5"))


@pytest.mark.parametrize("given", [{"runs": 8.5}, {"runs": "x"}, {"budget": 1.5}, {"budget": "x"}, {"seed": 0.5}])
def test_a_calibration_of_models_counts_in_whole_numbers(
    given: Mapping[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def computed(_: object) -> None:
        raise AssertionError("a calibration was begun")

    monkeypatch.setattr("birdstrike.inversion.models.calibrate_models._answer", computed)
    ((name, value),) = given.items()
    with pytest.raises(UserError, match=f"--{name} = {value!r} is no whole number"):
        birdstrike.calibrate_models("demo", "table7_group5", tmp_path / "models", **given)


def test_a_mesh_study_counts_in_whole_numbers(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"--meshes = 3.5 is no whole number"):
        birdstrike.converge("demo", tmp_path / "study", meshes=3.5)  # pyright: ignore[reportArgumentType]


TRACE = np.array([0.0, 1e-4, 2e-4])
RECORD = Measured(TRACE, {"displacement_centre": TRACE}, {}, {"displacement_centre": "m"})


@pytest.fixture
def nothing_is_run(monkeypatch: pytest.MonkeyPatch) -> None:
    """A refusal comes before any work."""

    def run(*_: object, **__: object) -> None:
        raise AssertionError("simulations were begun")

    for place in ("doe.campaign.runner.Runner.run", "doe.campaign.simulations.Simulations.run"):
        monkeypatch.setattr(f"birdstrike.{place}", run)


WRONG: list[tuple[Callable[[Path], Any], str]] = [
    (lambda out: birdstrike.diagnose("demo", [], out), "--measured is missing"),
    (lambda out: birdstrike.diagnose("demo", None, out), "--measured is missing"),
    (lambda out: birdstrike.diagnose([], "table7_group5", out), "the case is missing"),
    (lambda out: birdstrike.diagnose("demo", 3, out), "a measured-data file is given by its path .* not as int"),
    (lambda _: birdstrike.diagnose("demo", "table7_group5", 3), "out = 3 is no path"),
    (
        lambda out: birdstrike.diagnose("demo", "table7_group5", out, options={"alpha": 0.1}),
        r"options = \{'alpha': 0.1\} is no DiagnosisOptions; write birdstrike.DiagnosisOptions\(",
    ),
    (
        lambda out: birdstrike.diagnose("demo", "table7_group5", out, options=birdstrike.DiagnosisOptions(alpha="x")),
        "--alpha = x is not above 0 and below 0.5",
    ),
    (
        lambda out: birdstrike.diagnose("demo", "table7_group5", out, options=birdstrike.DiagnosisOptions(refine=1001)),
        "--refine = 1001 is more than 1000 runs near one answer",
    ),
    (
        lambda out: birdstrike.diagnose("demo", "table7_group5", out, options=birdstrike.DiagnosisOptions(runs=1.5)),
        "DiagnosisOptions: runs = 1.5 must be a whole number",
    ),
    (
        lambda out: birdstrike.diagnose("demo", "table7_group5", out, channels="strain_back"),
        'table7_group5.csv has no channel "strain_back"',
    ),
    (lambda out: birdstrike.diagnose("demo", "table7_group5", out, baseline="no.csv"), '"no.csv" is no measured-data'),
    (lambda out: birdstrike.close_the_loop("demo", "table7_group5", out, baseline="no.csv"), '"no.csv" is no measured'),
    (lambda out: birdstrike.close_the_loop("demo", RECORD, out), "not as Measured; write it to a file and give that"),
    (
        lambda out: birdstrike.close_the_loop("demo", "table7_group5", out, trainer="nonsense"),
        'trainer = "nonsense" is unknown; use one of: lm, adam, br, ensemble',
    ),
    (
        lambda out: birdstrike.close_the_loop("demo", "table7_group5", out, diagnosis=False, channels="strain_back"),
        'has no channel "strain_back"',
    ),
    (lambda out: birdstrike.close_the_loop("demo", "table7_group5", out, workers=0), "--workers = 0 is below 1"),
    (lambda out: birdstrike.close_the_loop("demo", "table7_group5", out, seed="a"), "--seed = 'a' is no whole number"),
    (lambda out: birdstrike.train_and_invert("doe", "r.csv", out, extras={"refine": 0}), "extras = .* is no Extras"),
    (lambda out: birdstrike.train_and_invert("doe", "r.csv", out, forward=3), "forward = 3 is no function"),
    (lambda out: birdstrike.train_and_invert("doe", "r.csv", out, trainer="x"), "use one of: lm, adam, br, ensemble"),
    (
        lambda out: birdstrike.train_and_invert("doe", "r.csv", out, extras=birdstrike.Extras(outputs="x")),
        'outputs = "x" is unknown; use one of: bounded, linear',
    ),
    (
        lambda out: birdstrike.train_and_invert("doe", "r.csv", out, extras=birdstrike.Extras(refine=1001)),
        "--refine = 1001 is more than 1000",
    ),
    (
        lambda out: birdstrike.train_and_invert("doe", "r.csv", out, extras=birdstrike.Extras(posterior="no")),
        "Extras: posterior = 'no' must be True or False",
    ),
    (lambda out: birdstrike.train_and_invert(3, "r.csv", out), "doe_dir = 3 is no path"),
    (lambda out: birdstrike.predict("demo", "learnt", out, options={"seed": 1}), "options = .* is no PredictOptions"),
    (
        lambda out: birdstrike.predict("demo", "learnt", out, options=birdstrike.PredictOptions(limits="a=8 mm")),
        "PredictOptions: limits = 'a=8 mm' must be a dict of texts or None",
    ),
    (lambda out: birdstrike.compare_methods("doe", out, truths=-1), "--truths = -1 is no whole number of at least 0"),
    (lambda out: birdstrike.compare_methods("doe", out, solver_truths=1.5), "--solver-truths = 1.5 is no whole number"),
    (
        lambda out: birdstrike.calibrate_models("demo", "table7_group5", out, posterior="x"),
        "FitOptions: posterior = 'x' must be True or False",
    ),
    (lambda out: birdstrike.calibrate_models("demo", "table7_group5", out, models=3), "models = 3: 3 is no name"),
    (lambda out: birdstrike.audit(None, out, make=1.5), "--make = 1.5 is no whole number"),
    (lambda out: birdstrike.audit(None, out, options={"alpha": 0.1}), "is no DiagnosisOptions"),
    (lambda out: birdstrike.converge("demo", out, ratio="x"), "--ratio = 'x' is outside 1.1 .. 2"),
    (lambda out: birdstrike.start(None, out), "answers = None is no path"),
    (lambda _: birdstrike.new(3), "name = 3 is no path"),
    (lambda out: birdstrike.run_doe("demo", out, design=None), "--design = None is neither a file nor one of uniform"),
    (lambda _: birdstrike.load_case("demo").with_values({"impact.speed": "90 m/s"}), "'90 m/s' is no number: .* in SI"),
    (lambda _: birdstrike.load_case("demo").save("case.json"), "a case is a TOML file; name it so"),
]


@pytest.mark.usefixtures("nothing_is_run")
@pytest.mark.parametrize(("call", "said"), WRONG)
def test_a_plain_mistake_is_refused_in_words_before_any_work(
    call: Callable[[Path], Any], said: str, tmp_path: Path
) -> None:
    with pytest.raises(UserError, match=said):
        call(tmp_path / "out")


def test_names_of_an_explanation_are_one_name_or_several() -> None:
    options = birdstrike.PredictOptions(only="none", leave_behind="clamp_rotation")
    found = _normalised(options)
    assert (found.only, found.leave_behind) == (("none",), ("clamp_rotation",))
