"""An answer against its truth: place of the truth, coverage, signal, the error that remains."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from birdstrike.data.errors import UserError
from birdstrike.data.histories import Histories
from birdstrike.inversion.audit.records import (
    CURVES,
    TRUTH,
    Truth,
    curves_text,
    find_experiments,
    read_truth,
    truth_text,
)
from birdstrike.inversion.audit.score import equivalent, score, signal
from birdstrike.solver.case.case import Case
from tests.inversion.audit.answers import TIME, answer, state
from tests.inversion.diagnosis.rig import tiny

VISCOSITY = "bird.material.viscosity"
SHARES = {"clamp_rotation": 0.6, "plate_thickness": 0.25, "none": 0.1, "sensor_gain": 0.03, "something_else": 0.02}


def truth(kind: str, effects: dict[str, float] | None = None, **changes: object) -> Truth:
    whole = {
        "kind": kind,
        "draw": "d0",
        "form": "own model",
        "what": "",
        "effects": effects or {},
        "parameters": {VISCOSITY: 420.0},
    }
    return Truth(**(whole | changes))  # pyright: ignore[reportArgumentType]


def test_the_second_likeliest_truth_has_rank_two_and_its_own_family_s_rank() -> None:
    given = answer(SHARES, credible=("clamp_rotation", "plate_thickness", "none"))
    found = score("a", given, truth("single", {"plate_thickness": 1.2}), tiny())
    assert (found.rank, found.family_rank, found.in_set, found.alarm) == (2, 2, True, True)
    assert found.probability == 0.25
    assert sum(true for _, true in found.probabilities) == 1


def test_an_attribution_is_right_only_where_it_names_what_was_planted() -> None:
    given = answer(SHARES | {"clamp_rotation": 0.97}, "attributed", credible=("clamp_rotation",))
    right = score("a", given, truth("single", {"clamp_rotation": 1.0}), tiny())
    wrong = score("a", given, truth("single", {"plate_thickness": 1.0}), tiny())
    assert right.attributed
    assert right.right
    assert wrong.attributed
    assert not wrong.right
    assert not wrong.in_set


def test_magnitudes_and_parameters_are_covered_by_their_own_intervals() -> None:
    given = answer(SHARES, after=state("clamp_rotation", 410.0, 5.0), magnitudes={"clamp_rotation": (1.0, 0.1)})
    far = score("a", given, truth("single", {"clamp_rotation": 1.2}), tiny())
    near = score("a", given, truth("single", {"clamp_rotation": 1.05}, parameters={VISCOSITY: 412.0}), tiny())
    assert (far.magnitude, dict(far.parameters)) == (False, {VISCOSITY: False})
    assert (near.magnitude, dict(near.parameters)) == (True, {VISCOSITY: True})
    clean = score("a", given, truth("clean"), tiny())
    assert dict(clean.parameters) == {VISCOSITY: True}, "of the fit without effects"
    other = score("a", given, truth("clean", form="hexahedral bird"), tiny())
    assert dict(other.parameters) == {}, "parameters of another model have no true value"


def test_a_fault_of_a_sensor_that_is_left_out_is_no_other_sensor_s() -> None:
    """One sensor is used and another left out: the common fault is that of the one that is used."""
    shares = {"none": 0.02, "sensor_gain": 0.96, "sensor_gain.strain_back": 0.02}
    given = answer(shares, "attributed", credible=("sensor_gain",))
    (used,) = given["diagnosis"]["noise"]["sensors"]
    given["diagnosis"]["left_out"] = {"strain_back": 0.06}
    other = score("a", given, truth("single", {"sensor_gain.strain_back": 0.05}), tiny())
    assert (other.right, other.rank, other.in_set) == (False, 2, False)
    own = score("a", given, truth("single", {f"sensor_gain.{used}": 0.05}), tiny())
    assert (own.right, own.rank, own.in_set) == (True, 1, True)
    assert own.channels == (used, "strain_back")


def test_a_sensor_s_fault_is_the_common_one_where_it_is_the_only_sensor() -> None:
    assert equivalent("sensor_gain", "sensor_gain.a", ("a",), 1)
    assert not equivalent("sensor_gain", "sensor_gain.a", ("a", "b"), 1)
    assert equivalent("impact_speed", "impact_speed@shot1", ("a", "b"), 1)
    assert not equivalent("impact_speed", "impact_speed@shot1", ("a", "b"), 3)


def test_a_fault_that_only_one_sensor_can_have_is_listed_as_the_common_one() -> None:
    given = answer(SHARES, credible=("sensor_gain",), channels=("displacement_centre", "contact_force"))
    found = score("a", given, truth("single", {"sensor_gain.displacement_centre": 0.03}), tiny())
    assert found.in_set
    assert found.rank == 3


def test_a_pair_is_in_the_set_only_as_a_pair() -> None:
    planted = {"clamp_rotation": 1.0, "plate_thickness": 1.0}
    alone = score("a", answer(SHARES, credible=("clamp_rotation",)), truth("pair", planted), tiny())
    both = score("a", answer(SHARES, credible=("plate_thickness+clamp_rotation",)), truth("pair", planted), tiny())
    assert not alone.in_set
    assert both.in_set


def paired(change: np.ndarray, slope: np.ndarray) -> Truth:
    rise = np.linspace(0.0, 1e-2, len(TIME))
    curves = {"shot1": {"displacement_centre": rise + change}, "without": {"displacement_centre": rise}}
    slopes = {VISCOSITY: {"displacement_centre": slope}}
    return truth("single", {"clamp_rotation": 1.0}, time=TIME, curves=curves, slopes=slopes)


def test_the_signal_is_the_change_in_units_of_the_noise_less_what_the_parameters_imitate() -> None:
    stated = answer(SHARES)["stated"]
    slope, other = np.zeros(len(TIME)), np.zeros(len(TIME))
    slope[10:20], other[30:34] = 1e-3, 4e-5
    assert signal(stated, paired(other, slope), tiny(), 1) == pytest.approx(4.0, rel=1e-6)  # sqrt(4) x 2 sigma
    assert signal(stated, paired(0.3 * slope, slope), tiny(), 1) == pytest.approx(0.0, abs=1e-6)
    assert signal(stated, paired(other + 0.3 * slope, slope), tiny(), 1) == pytest.approx(4.0, rel=1e-6)
    three = answer(SHARES, shots=3)["stated"]
    assert signal(three, paired(other, slope), tiny(), 3) == pytest.approx(4.0 * np.sqrt(3.0), rel=1e-6)


def test_a_model_error_that_the_answer_states_makes_the_signal_smaller() -> None:
    given, louder = answer(SHARES)["stated"], answer(SHARES)["stated"]
    louder["shot1"]["displacement_centre"]["error"] = [2e-4] * len(TIME)
    change = 1e-4 * np.sin(np.pi * TIME / TIME[-1])
    none = np.zeros(len(TIME))
    assert signal(louder, paired(change, none), tiny(), 1) < 0.5 * signal(given, paired(change, none), tiny(), 1)  # pyright: ignore


def stand_in(cases: Mapping[str, Case]) -> dict[str, Histories]:
    """A solver whose centre is displaced in proportion to viscosity and edges' compliance."""
    found = {}
    for label, case in cases.items():
        slip = case.effects.get("clamp_rotation", 0.0)
        level = case.bird.material.viscosity * 1e-6 + 1e-4 * slip
        found[label] = Histories(
            TIME, dict.fromkeys(case.sensors, np.full(len(TIME), level)), dict.fromkeys(case.sensors, "m")
        )
    return found


def test_excess_error_is_0_at_the_oracle_and_1_where_nothing_is_gained() -> None:
    sealed = truth("single", {"clamp_rotation": 1.0}, time=TIME)
    level = 420e-6 + 1e-4
    sealed = truth(
        "single",
        {"clamp_rotation": 1.0},
        time=TIME,
        curves={"heldout": {"displacement_centre": np.full(len(TIME), level + 1e-5)}},
    )
    given = answer(
        SHARES | {"clamp_rotation": 0.97},
        "attributed",
        credible=("clamp_rotation",),
        after=state("clamp_rotation", 420.0, 5.0),
        magnitudes={"clamp_rotation": (1.0, 0.1)},
    )
    found = score("a", given, sealed, tiny(), stand_in)
    assert found.error is not None
    assert found.error[1] == pytest.approx(found.error[2])
    assert found.excess == pytest.approx(0.0, abs=1e-9)
    given["diagnosis"]["after"] = state("clamp_rotation", 400.0, 5.0)
    given["diagnosis"]["effects"][0]["magnitude"] = 0.0
    assert score("a", given, sealed, tiny(), stand_in).excess == pytest.approx(1.0)


def test_a_truth_file_is_read_as_it_was_written(tmp_path: Path) -> None:
    planted = truth("single", {"sensor_gain.displacement_centre": 0.03, "impact_speed@shot1": -1.5})
    columns = {("shot1", "displacement_centre"): 1e-3 * TIME, (f"slope {VISCOSITY}", "displacement_centre"): TIME}
    (tmp_path / f"d0{CURVES}").write_text(curves_text(TIME, columns), encoding="utf-8")
    (tmp_path / f"a{TRUTH}").write_text(truth_text(planted, f"d0{CURVES}"), encoding="utf-8")
    found = read_truth(tmp_path / f"a{TRUTH}")
    assert (found.kind, found.draw, found.effects, found.parameters) == (
        "single",
        "d0",
        planted.effects,
        planted.parameters,
    )
    np.testing.assert_allclose(found.curves["shot1"]["displacement_centre"], 1e-3 * TIME, rtol=1e-6)
    np.testing.assert_allclose(found.slopes[VISCOSITY]["displacement_centre"], TIME, rtol=1e-6)


def test_a_folder_without_a_whole_experiment_is_refused_with_what_is_missing(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="holds no experiment"):
        find_experiments(tmp_path)
    (tmp_path / "a.csv").write_text("time [ms]\n")
    with pytest.raises(UserError, match=r"a.toml, a.truth.toml is missing"):
        find_experiments(tmp_path)
    (tmp_path / "a.toml").write_text("")
    (tmp_path / f"a{TRUTH}").write_text('kind = "odd"\n')
    (tmp_path / "a.shot2.csv").write_text("")
    (tmp_path / "a.baseline.csv").write_text("")
    (found,) = find_experiments(tmp_path)
    assert [path.name for path in found.shots] == ["a.csv", "a.shot2.csv"]
    assert found.baseline == tmp_path / "a.baseline.csv"
    with pytest.raises(UserError, match="is none of clean"):
        read_truth(found.truth)
