"""A tiny rig from nothing: edges that let go are found beside a baseline; the second call pays for no simulation."""

from __future__ import annotations

import html
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from birdstrike.data.curves import Measured, read_measured, write_measured
from birdstrike.data.errors import CaseError, MeasuredError, UserError
from birdstrike.data.storage.tree import load_tree
from birdstrike.inversion.diagnosis.conclusions import answer
from birdstrike.inversion.diagnosis.conclusions.before_and_after import Held
from birdstrike.inversion.diagnosis.conclusions.next_measurement import Proposal
from birdstrike.inversion.diagnosis.diagnose import DiagnosisOptions, clean_shots, diagnose, named_records, stated_bird
from birdstrike.loop import close_the_loop
from birdstrike.solver.case.case import load_case
from tests.inversion.diagnosis.conftest import Laboratory
from tests.inversion.diagnosis.rig import tiny

KEYS = {
    "schema_version", "alpha", "verdict", "confidence_set", "effects", "before", "after", "minimum_detectable",
    "next_measurement", "pairs", "remainder", "noise", "nuisance", "case_after", "strikes", "warnings", "held_out",
    "tolerances", "refused", "record", "sentence", "unnamed", "families", "required_discrepancy", "baseline", "shots",
}  # fmt: skip
OF_AN_EFFECT = {
    "name", "magnitude", "unit", "interval_95", "p_consistent", "log_evidence", "twins", "at_bound", "absorbed", "bias",
    "plausible_size", "meaning", "confirmed", "probability",
}  # fmt: skip
OF_A_STATE = {"model", "rmse", "weighted", "raw", "heldout", "parameters", "solver", "rmse_less_baseline"}


def record(end: float = 0.9e-3, sensors: tuple[str, ...] = ("displacement_centre", "displacement_side")) -> Measured:
    time = np.linspace(0.0, end, 50)
    return Measured(time, dict.fromkeys(sensors, time), {}, dict.fromkeys(sensors, "m"), path="shot.csv")


def test_edges_that_let_go_raise_the_alarm_and_are_in_the_credible_set(laboratory: Laboratory) -> None:
    assert laboratory.first.exit_code == 0, laboratory.first.output
    found = laboratory.content()
    assert found["alarm"] < 0.05
    assert any("clamp_rotation" in name for name in found["confidence_set"])
    before, after = (found[state]["rmse_less_baseline"] for state in ("before", "after"))
    assert all(after[name] < before[name] for name in before)
    # On so coarse a mesh none of four effects describes free edges well; the likeliest first.
    clamp = next(one for one in found["effects"] if one["name"] not in ("none", "something_else"))
    assert clamp["name"] == "clamp_rotation"
    assert clamp["magnitude"] > 0.0
    assert found["required_discrepancy"]["clamp_rotation"] < 0.7 * found["required_discrepancy"]["none"]


def test_the_file_has_all_its_keys(laboratory: Laboratory) -> None:
    found = laboratory.content()
    assert set(found) >= KEYS
    assert all(set(one) >= OF_AN_EFFECT for one in found["effects"])
    assert set(found["before"]) >= OF_A_STATE
    assert found["baseline"]["shots"] == ["clean"]
    assert set(found["baseline"]["residual_rms"]) == {"displacement_centre", "displacement_side"}
    assert [(one["name"], one["case"]) for one in found["shots"]] == [("loose", "case")]
    assert sum(found["families"].values()) == pytest.approx(1.0, abs=1e-6)
    assert set(found["required_discrepancy"]) >= {"none", "clamp_rotation"}
    if found["after"] is not None:
        assert load_case(laboratory.folder / "out" / found["case_after"]).time == tiny().time


def test_the_numerical_error_is_a_share_of_the_whole(laboratory: Laboratory) -> None:
    """It was 134 % beside a baseline, whose part of the whole had been taken off."""
    noise = laboratory.content()["noise"]
    shares = [one["numerical_share"] for one in noise["sensors"].values()]
    assert all(0.0 < share < 1.0 for share in (*shares, noise["numerical_share"]))


def test_the_command_says_what_the_file_says(laboratory: Laboratory) -> None:
    told = " ".join(laboratory.first.output.split())
    found = laboratory.content()
    assert " ".join(found["sentence"].split()) in told
    assert "model-form error: 1 baseline shot" in told


def test_the_page_shows_the_answer_and_points_nowhere(laboratory: Laboratory) -> None:
    text = html.unescape((laboratory.folder / "out" / "diagnosis.html").read_text(encoding="utf-8"))
    assert laboratory.content()["sentence"] in text
    for words in ("bias before", "least detectable", "Baseline clean", "Held out".lower()):
        assert words in text
    assert text.count("<svg") >= 3
    assert "https://" not in text.replace("http://www.w3.org", "")


def test_the_second_call_simulates_nothing_and_says_the_same(laboratory: Laboratory) -> None:
    folder, before = laboratory.folder, laboratory.content()
    words = ("--measured", str(folder / "loose.csv"), "--baseline", str(folder / "clean.csv"))
    again = laboratory.diagnose("out", *words)
    assert "still valid" in again.output
    assert laboratory.content() == before
    (folder / "out" / "stages.json").unlink()
    assert "still valid" not in laboratory.diagnose("out", *words).output
    after = laboratory.content()
    assert after["strikes"]["paid"] == 0
    assert after["confidence_set"] == before["confidence_set"]


def test_a_sensor_that_lattices_move_too_much_is_left_out_and_told(
    laboratory: Laboratory, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its own faults stay in the list, about as likely beside `none` as beforehand; nothing is compared with them."""
    moved = {"displacement_side": 0.08, "probe_strain_fore": 0.2}
    monkeypatch.setattr("birdstrike.inversion.diagnosis.diagnose.unpredictable", lambda *_: moved)
    folder = laboratory.folder
    words = ("--measured", str(folder / "clean.csv"), "--baseline", str(folder / "loose.csv"))
    result = laboratory.diagnose("noisy", *words)
    assert result.exit_code == 0, result.output
    found = laboratory.content("noisy")
    assert found["left_out"] == {"displacement_side": 0.08}
    assert list(found["noise"]["sensors"]) == ["displacement_centre"]
    assert "displacement side by 8 % of the peak" in found["warnings"][0]
    told = {one["name"]: one for one in found["effects"]}
    unseen = told["sensor_gain.displacement_side"]
    assert abs(unseen["log_evidence"]) < 2.0, "by the place about which each model is judged"
    assert unseen["absorbed"] is None
    assert unseen["twins"] == {}
    assert not any("displacement_side" in name for one in told.values() for name in one["twins"])
    posterior = load_tree(folder / "noisy" / "model.npz")["posterior"]
    assert not any("displacement_side" in one["label"] for one in posterior)
    assert sum(one["share"] for one in posterior) == pytest.approx(1.0)
    page = html.unescape((folder / "noisy" / "diagnosis.html").read_text(encoding="utf-8"))
    assert "Measured, but not used: displacement side (8 %)" in page


def test_two_shots_are_judged_together(laboratory: Laboratory) -> None:
    """The clean record is the second shot: what the first alone has is an effect of that shot."""
    folder = laboratory.folder
    words = [word for name in ("loose", "clean") for word in ("--measured", str(folder / f"{name}.csv"))]
    result = laboratory.diagnose("both", *words)
    assert result.exit_code == 0, result.output
    found = laboratory.content("both")
    assert [one["name"] for one in found["shots"]] == ["loose", "clean"]
    assert {"impact_speed", "impact_speed@loose", "impact_speed@clean"} <= {one["name"] for one in found["effects"]}
    assert {"shot loose", "shot clean"} <= set(found["held_out"])
    for one in found["shots"]:
        own, parts = one["before"]["heldout"], found["held_out"]
        assert own["shot"] == parts[f"shot {one['name']}"]["before"]
        assert own["time_block"] == parts[f"time_block of {one['name']}"]["before"]
        channels = [key for key in parts if key.startswith("channel ") and key.endswith(f" of {one['name']}")]
        assert channels
        assert own["channel"] == max(parts[key]["before"] for key in channels)
    assert found["before"]["heldout"]["shot"] == max(one["before"]["heldout"]["shot"] for one in found["shots"])
    assert (folder / "both" / "diagnosis_clean.csv").is_file()


def test_a_stated_bird_stands_in_the_answer_and_beside_another_one_nothing_is_attributed(
    laboratory: Laboratory,
) -> None:
    """Both shots have one bird. Stated as unlike, the file and the page say so, and what the records say of it."""
    folder = laboratory.folder
    words = ("--measured", str(folder / "loose.csv"), "--baseline", str(folder / "clean.csv"))
    result = laboratory.diagnose("unlike", *words, "--baseline-bird", "other")
    assert result.exit_code == 0, result.output
    found, bird = laboratory.content("unlike"), laboratory.content()["baseline"]["bird"]
    assert found["verdict"] != "attributed"
    assert found["baseline"]["same_bird"] == 0.0
    assert found["baseline"]["bird"]["stated"] == "other"
    assert sum(found["baseline"]["bird"]["records"].values()) == pytest.approx(1.0)
    assert any("bird" in line and "none is attributed" in line for line in found["warnings"])
    following = found["next_measurement"]
    assert following["channel"] == "baseline"
    assert "a bird of the record's own recipe" in following["sentence"]
    assert following["expected"] >= following["now"]
    page = html.unescape((folder / "unlike" / "diagnosis.html").read_text(encoding="utf-8"))
    assert "Stated of its bird: unlike the shot's" in page
    assert "By the records alone" in page
    assert (bird["stated"], bird["contradicted"]) == ("auto", False)


def test_the_case_states_the_bird_of_its_baselines(laboratory: Laboratory) -> None:
    folder = laboratory.folder
    text = 'extends = "case.toml"\n[diagnosis]\nbaseline_bird = "{}"\n'
    (folder / "batch.toml").write_text(text.format("same"))
    case = load_case(folder / "batch.toml")
    assert stated_bird(DiagnosisOptions(), case, None) == "same"
    assert stated_bird(DiagnosisOptions(), case, "recipe") == "recipe"
    (folder / "wrong.toml").write_text(text.format("sane"))
    with pytest.raises(CaseError, match=r'baseline_bird.*did you mean "same"'):
        load_case(folder / "wrong.toml")


def test_an_uncertainty_that_the_case_states_explains_what_it_can(laboratory: Laboratory) -> None:
    """A speed known to 8 m/s explains a part of what edges that let go do; an angle's effect is not simulated."""
    folder = laboratory.folder
    words = ("--measured", str(folder / "loose.csv"), "--baseline", str(folder / "clean.csv"))
    stated = ("speed=8 m/s", "angle=1 deg")
    result = laboratory.diagnose("stated", *words, *(w for s in stated for w in ("--set", f"inversion.nuisance.{s}")))
    assert result.exit_code == 0, result.output
    found, exact = laboratory.content("stated"), laboratory.content()
    for name in ("clamp_rotation", "impact_speed"):
        gains = [next(e["log_evidence"] for e in one["effects"] if e["name"] == name) for one in (found, exact)]
        assert gains[0] < gains[1] - 1.0, name
    lines = [line for line in found["warnings"] if "inversion.nuisance" in line]
    assert len(lines) == 1
    assert "inversion.nuisance of angle is not carried" in lines[0]


def test_a_channel_can_be_left_out(laboratory: Laboratory) -> None:
    """A dead sensor of the record is left out; the baseline, which has it alive, keeps the other alone."""
    folder = laboratory.folder
    dead = read_measured(folder / "loose.csv")
    side = np.zeros(len(dead.time))
    write_measured(folder / "dead.csv", replace(dead, channels={**dead.channels, "displacement_side": side}))
    words = ("--measured", str(folder / "dead.csv"), "--baseline", str(folder / "clean.csv"))
    refused = laboratory.diagnose("dead", *words)
    assert refused.exit_code == 1
    assert '"displacement_side" is zero everywhere' in refused.output
    result = laboratory.diagnose("dead", *words, "--channels", "displacement_centre")
    assert result.exit_code == 0, result.output
    found = laboratory.content("dead")
    assert set(found["before"]["rmse"]) == {"displacement_centre"}
    assert set(found["baseline"]["residual_rms"]) == {"displacement_centre"}
    wrong = laboratory.diagnose("wrong", *words, "--channels", "laser")
    assert wrong.exit_code == 1
    assert 'has no channel "laser"; its channels: displacement_centre, displacement_side' in wrong.output


def test_baselines_that_cannot_serve_are_named_and_the_rest_goes_on(laboratory: Laboratory) -> None:
    folder, case = laboratory.folder, tiny()
    rows = (folder / "clean.csv").read_text().splitlines()
    (folder / "short.csv").write_text("\n".join(rows[:20]) + "\n")
    (folder / "cut.csv").write_text("\n".join([*rows[:20], "0.4,wrong"]) + "\n")
    (folder / "other.csv").write_text("\n".join(rows).replace("displacement_", "deflection_") + "\n")
    thick = case.overlaid({"plate": {"thickness": "9 mm"}})
    names = [folder / f"{name}.csv" for name in ("short", "cut", "other", "clean", "clean")]
    shots = named_records(case, folder / "loose.csv")
    served, warnings = clean_shots(shots, names, [case, case, case, thick, case])
    assert [one.record.path for one in served] == [str(folder / "clean.csv")]
    for name, reason in (
        ("short", "it ends at"),
        ("cut.csv", "line"),
        ("other", "none of the shot's sensors"),
        ("clean", "another plate"),
    ):
        assert any(name in line and "is left out" in line and reason in line for line in warnings), (name, warnings)


def test_a_case_names_its_own_baselines(laboratory: Laboratory) -> None:
    folder = laboratory.folder
    text = 'extends = "case.toml"\n[diagnosis]\nbaselines = ["clean.csv"]\n'
    (folder / "series.toml").write_text(text)
    case = load_case(folder / "series.toml")
    served, warnings = clean_shots(named_records(case, folder / "loose.csv"), [], [])
    assert [one.name for one in served] == ["clean"]
    assert not warnings


def test_numbers_of_records_and_cases_must_fit() -> None:
    with pytest.raises(UserError, match="one case for all records, or one for each"):
        named_records([tiny(), tiny()], [record(), record(), record()])
    with pytest.raises(UserError, match="--baseline-case for each --baseline"):
        clean_shots(named_records(tiny(), record()), [record()], [tiny(), tiny()])
    with pytest.raises(UserError, match="no measured-data file"):
        clean_shots(named_records(tiny(), record()), ["nowhere.csv"], [])


def test_a_misspelt_bird_is_refused_before_anything_is_simulated(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="available: auto, same, recipe, other"):
        diagnose(tiny(), record(), tmp_path / "out", baseline_bird="twin")
    path = tmp_path / "shot.csv"
    write_measured(path, record())
    with pytest.raises(UserError, match="available: auto, same, recipe, other"):
        close_the_loop(tiny(), path, tmp_path / "out", baseline_bird="twin")
    assert not (tmp_path / "out").exists()


def test_records_that_cannot_be_used_are_refused_before_anything_is_simulated(tmp_path: Path) -> None:
    with pytest.raises(MeasuredError, match="no sensor of case"):
        diagnose(tiny(), record(sensors=("other",)), tmp_path / "out")
    with pytest.raises(MeasuredError, match="use the whole record"):
        diagnose(tiny(), record(end=1e-4), tmp_path / "out")
    forces = replace(record(), units=dict.fromkeys(record().units, "N"))
    with pytest.raises(MeasuredError, match="has unit N, the sensor m"):
        diagnose(tiny(), forces, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_what_is_wrong_with_any_record_is_told_at_once_the_held_out_one_s_unit_too(tmp_path: Path) -> None:
    """A held-out displacement in kN was found after all simulations; of two faulty shots the first was named alone."""
    forces = replace(record(), units=dict.fromkeys(record().units, "N"), path="held.csv")
    short = replace(record(end=1e-4), path="short.csv")
    with pytest.raises(MeasuredError) as caught:
        diagnose(tiny(), [record(sensors=("displacement_centre", "other")), short], tmp_path / "out", heldout=forces)
    assert [re.sub(r".*(shot|short|held)\.csv.*", r"\1", line) for line in caught.value.errors] == [
        "shot", "short", "held", "held",
    ]  # fmt: skip
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ({"plate": {"thickness": "5 mm"}}, "another plate or target"),
        (
            {"time": {"end": "0.8 ms"}},
            r"time.end = 0.8 ms in case tiny and 0.9 ms in case tiny: .* state \[time\] alike",
        ),
        (
            {"sensors": {"displacement_side": {"kind": "strain", "noise": 2e-5}}},
            "sensors.displacement_side is of kind strain in case tiny and displacement in case tiny: .* rename it",
        ),
        (
            {"inversion": {"parameters": {"bird.material.viscosity": {"range": ["100 Pa s", "2000 Pa s"]}}}},
            r'viscosity" is 100 \.\. 2000 Pa s \(linear\) in case tiny and 100 \.\. 1000 Pa s',
        ),
    ],
)
def test_shots_of_two_rigs_clocks_or_ranges_are_refused_and_such_a_baseline_is_left_out(
    tmp_path: Path, table: dict[str, dict[str, object]], said: str
) -> None:
    """Shots share a parameter as a share of its range: in another range it would be another viscosity. They share model
    error at each instant: cases of two ends ended in a ValueError after all simulations. A strain named as a
    displacement of the first shot had its errors in mm."""
    other = tiny().overlaid(table)
    records = [record(), replace(record(), path="second.csv")]
    with pytest.raises(CaseError, match=said):
        diagnose([tiny(), other], records, tmp_path / "out")
    found, warnings = clean_shots(named_records(tiny(), records[:1]), records[1:], [other])
    assert not found
    assert "is left out" in warnings[0]


def test_misfits_before_and_after_are_over_the_same_errors(laboratory: Laboratory) -> None:
    """Each was over its own model's errors, and what explains less takes them to be larger: 6.6 before, 29 after."""
    found, table = laboratory.content(), pd.read_csv(laboratory.folder / "out" / "diagnosis.csv")
    assert found["after"]
    for name in ("before", "after"):
        off = (table["measured"] - table[name] - table["baseline"]) / table["error"]
        assert found[name]["weighted"] == pytest.approx(float(np.sqrt((off**2).mean())), rel=1e-4)
        solver = (table["measured"] - table[f"{name}_solver"] - table["baseline"]) / table["error"]
        assert found[name]["solver"]["weighted"] == pytest.approx(float(np.sqrt((solver**2).mean())), rel=1e-4)


@pytest.mark.parametrize(
    ("name", "value", "fault", "verdict", "said"),
    [
        ("MISFIT_ATTRIBUTED", 1e-3, False, "ambiguous", "times all errors together"),
        ("reaches_limit", lambda *_: True, True, "ambiguous", "so that it is not attributed"),
        ("reaches_limit", lambda *_: True, False, "attributed", "measure this quantity at the rig"),
    ],
)
def test_an_effect_that_leaves_the_residual_and_a_fault_at_its_limit_are_not_attributed(
    laboratory: Laboratory,
    monkeypatch: pytest.MonkeyPatch,
    name: str,
    value: object,
    fault: bool,
    verdict: str,
    said: str,
) -> None:
    """The evidence says "attributed"; a dead sensor was attributed to a gain of -30 %, of a misfit of 29.

    Of an effect of the solver, such as free edges, the magnitude is "or beyond".
    """
    monkeypatch.setattr("birdstrike.inversion.diagnosis.pipeline.verdict_of", lambda *_: "attributed")
    monkeypatch.setattr("birdstrike.inversion.diagnosis.pipeline.predicts_no_better", lambda *_: [])
    folder = laboratory.folder
    words = ("--measured", str(folder / "loose.csv"), "--baseline", str(folder / "clean.csv"))
    out = f"{name}_{fault}"
    assert laboratory.diagnose(f"sound_{out}", *words).exit_code == 0
    assert laboratory.content(f"sound_{out}")["verdict"] == "attributed"
    monkeypatch.setattr(answer, name, value)
    for reader in ("pipeline", "conclusions.answer"):
        monkeypatch.setattr(f"birdstrike.inversion.diagnosis.{reader}.is_fault", lambda *_: fault)
    assert laboratory.diagnose(f"against_{out}", *words).exit_code == 0
    found = laboratory.content(f"against_{out}")
    assert found["verdict"] == verdict
    assert len([line for line in found["warnings"] if said in line]) == 1


@pytest.mark.parametrize(("after", "verdict"), [(0.9, "attributed"), (1.1, "ambiguous")])
def test_an_effect_that_predicts_what_was_held_out_no_better_is_not_attributed(
    laboratory: Laboratory, monkeypatch: pytest.MonkeyPatch, after: float, verdict: str
) -> None:
    """The evidence says "attributed"; the parts held out decide."""
    pipeline = "birdstrike.inversion.diagnosis.pipeline"
    monkeypatch.setattr(f"{pipeline}.verdict_of", lambda *_: "attributed")
    monkeypatch.setattr(
        f"{pipeline}.hold_out", lambda _, model, *__: [Held("time_block", 1.0, -(after if model.members else 1.0))]
    )
    folder, out = laboratory.folder, f"held_out_{verdict}"
    words = ("--measured", str(folder / "loose.csv"), "--baseline", str(folder / "clean.csv"))
    result = laboratory.diagnose(out, *words)
    assert result.exit_code == 0, result.output
    found = laboratory.content(out)
    assert found["verdict"] == verdict
    assert any("not fitted to" in line for line in found["warnings"]) is (verdict == "ambiguous")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (
            ("--measured", "loose.csv", "--measured", "loose.csv"),
            "--measured: .*loose.csv and .*loose.csv hold the same",
        ),
        (("--measured", "loose.csv", "--baseline", "loose.csv"), "--measured: .*loose.csv and --baseline: .*loose.csv"),
        (
            ("--measured", "loose.csv", "--baseline", "clean.csv", "--heldout", "clean.csv"),
            "--baseline: .*clean.csv and --heldout: .*clean.csv hold the same points; a record counts once",
        ),
        (
            ("--measured", "loose.csv", "--doe", "nowhere"),
            "--doe .*nowhere holds no runs; give the folder of a finished",
        ),
    ],
)
def test_a_record_has_one_place_and_a_campaign_is_there(
    laboratory: Laboratory, words: Sequence[str], said: str
) -> None:
    """The same record twice halves its noise; as its own baseline it explains itself; held out, it tests itself."""
    folder = laboratory.folder
    given = [word if word.startswith("--") else str(folder / word) for word in words]
    found = laboratory.diagnose("twice", *given)
    assert found.exit_code == 1
    assert re.search(said, found.stderr.replace("\n", " "))
    assert not (folder / "twice" / "diagnosis.json").exists()


def test_what_an_earlier_diagnosis_left_in_the_folder_goes(laboratory: Laboratory) -> None:
    folder = laboratory.folder
    words = ("--measured", str(folder / "loose.csv"), "--baseline", str(folder / "clean.csv"))
    assert laboratory.diagnose("again", *words).exit_code == 0
    earlier = laboratory.content("again")["case_after"]
    assert (folder / "again" / earlier).is_file()
    (folder / "again" / "own_with_notes.toml").write_text("a user's own file stays")
    assert laboratory.diagnose("again", "--measured", str(folder / "clean.csv"), *words[2:3], words[1]).exit_code == 0
    assert laboratory.content("again")["case_after"] != earlier
    assert not (folder / "again" / earlier).exists()
    assert (folder / "again" / "own_with_notes.toml").is_file()


def test_a_held_out_shot_without_the_effect_is_told(laboratory: Laboratory) -> None:
    folder = laboratory.folder
    words = ("--measured", str(folder / "loose.csv"), "--baseline", str(folder / "clean.csv"))
    clean = read_measured(folder / "clean.csv")
    noise = 1e-6 * np.random.default_rng(3).standard_normal(len(clean.time))
    other = replace(clean, channels={name: values + noise for name, values in clean.channels.items()})
    write_measured(folder / "other.csv", other)
    assert laboratory.diagnose("held", *words, "--heldout", str(folder / "other.csv")).exit_code == 0
    found = laboratory.content("held")
    assert [found["shots"][0][when]["heldout"] for when in ("before", "after")] == [
        found[when]["heldout"] for when in ("before", "after")
    ]
    held = found["after"]["heldout"]["shot"], found["before"]["heldout"]["shot"]
    told = [line for line in found["warnings"] if "the held-out record is predicted worse than without it" in line]
    assert (held[0] > held[1]) == bool(told)
    assert told


@pytest.mark.parametrize(("expected", "said"), [(0.9, "from 0.50 to 0.90"), (0.51, "no measurement that was compared")])
def test_a_measurement_that_brings_next_to_nothing_is_no_advice(expected: float, said: str) -> None:
    assert said in Proposal("w", ("a", "b"), expected, 0.5, "one more sensor, w").sentence


@pytest.mark.parametrize(("likeliest", "said"), [(0.7, "may be none of them"), (0.97, "from 1.00 to 1.00")])
def test_sensors_that_should_decide_and_do_not_speak_against_what_is_compared(likeliest: float, said: str) -> None:
    """Of a preload (0.61) and a clamp's rotation (0.22), of which the record decided nothing, the right model was said
    to have a probability of 1.00; the plate was thinner."""
    assert said in Proposal("w", ("a", "b"), 1.0, 0.999, "one more sensor, w", likeliest=likeliest).sentence
