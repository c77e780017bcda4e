"""Optimisers with the solver in the loop: they find a known minimum, and every simulation is counted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest

from birdstrike.cli.calibrate_models import optimised_lines
from birdstrike.data.errors import RunFailed, UserError
from birdstrike.inversion.models.calibrate_models import calibrate_models
from birdstrike.inversion.models.optimisers import (
    OPTIMISERS,
    STEP,
    Problem,
    differences,
    from_the_middle,
    optimised,
    refuse_unknown,
)
from tests.inversion.models import rig


def bowl(budget: int, made: list[Mapping[str, float]]) -> Problem:
    """Least at a = 3, b = 0.2."""

    def residuals(values: Mapping[str, float]) -> np.ndarray:
        made.append(values)
        return np.array([values["a"] - 3.0, 10.0 * (values["b"] - 0.2)])

    def together(points: Sequence[Mapping[str, float]]) -> None:
        assert len(points) <= budget

    return Problem(("a", "b"), lambda unit: unit * np.array([10.0, 1.0]), residuals, together, budget)


@pytest.mark.parametrize("name", OPTIMISERS)
def test_a_known_minimum_is_found_and_every_simulation_counted(name: str) -> None:
    if name == "cma":
        pytest.importorskip("cma")
    made: list[Mapping[str, float]] = []
    found = optimised(name, bowl(150, made))
    assert found.parameters == pytest.approx({"a": 3.0, "b": 0.2}, abs=0.05)
    assert found.strikes == len(made) == len({tuple(values.values()) for values in made}) <= 150
    few: list[Mapping[str, float]] = []
    stopped = optimised(name, bowl(3, few))
    assert stopped.strikes == len(few) == len({tuple(values.values()) for values in few}) == 3


def scattering(unit: np.ndarray) -> np.ndarray:
    """Linear, least at 0.01 of both ranges, with the scatter that simulations have: 1e-3."""
    return np.array([1.0, 2.0]) * (unit - 0.01) + 1e-3 * np.sin(3e3 * unit[::-1])


def test_derivatives_are_over_a_fixed_share_of_the_range_at_both_of_its_ends() -> None:
    made: list[np.ndarray] = []

    def residuals(unit: np.ndarray) -> np.ndarray:
        made.append(unit)
        return scattering(unit)

    end = np.array([0.002, 0.99])
    found = differences(residuals, end)
    np.testing.assert_allclose(made, [end, end + np.array([STEP, 0.0]), end - np.array([0.0, STEP])])
    np.testing.assert_allclose(found, np.diag([1.0, 2.0]), atol=2e-3 / STEP)


def test_least_squares_reaches_a_minimum_at_the_lower_end_and_makes_no_point_twice() -> None:
    made: list[np.ndarray] = []

    def residuals(unit: np.ndarray) -> np.ndarray:
        made.append(unit)
        return scattering(unit)

    found = from_the_middle(residuals, 2)
    assert found.x == pytest.approx([0.01, 0.01], abs=2e-3)
    assert len({point.tobytes() for point in made}) == len(made)


def test_a_simulation_that_fails_is_no_minimum() -> None:
    def residuals(values: Mapping[str, float]) -> np.ndarray:
        if values["a"] > 0.55:
            raise RunFailed("unstable")
        return np.array([values["a"] - 0.9])

    found = optimised("least_squares", Problem(("a",), lambda unit: unit, residuals, lambda _: None, 20))
    assert found.parameters["a"] <= 0.55


@pytest.mark.parametrize("name", OPTIMISERS)
def test_an_optimiser_whose_first_simulation_fails_ends_with_a_reason_or_an_answer(name: str) -> None:
    if name == "cma":
        pytest.importorskip("cma")

    def residuals(values: Mapping[str, float]) -> np.ndarray:
        if not middle:
            middle.append(values)
        if values == middle[0]:
            raise RunFailed("unstable")
        return np.array([values["a"] - 0.9, values["b"] - 0.2, 0.1])

    middle: list[Mapping[str, float]] = []
    problem = Problem(("a", "b"), lambda unit: unit, residuals, lambda _: None, 60)
    if name == "least_squares":
        with pytest.raises(RunFailed, match=r"middle of the ranges, where least_squares begins, failed \(unstable\)"):
            optimised(name, problem)
    else:
        assert optimised(name, problem).weighted == pytest.approx(0.1, abs=0.02)


@pytest.mark.parametrize("name", OPTIMISERS)
def test_no_error_is_stated_where_every_simulation_fails(name: str) -> None:
    if name == "cma":
        pytest.importorskip("cma")

    def residuals(_: Mapping[str, float]) -> np.ndarray:
        raise RunFailed("unstable")

    with pytest.raises(RunFailed):
        optimised(name, Problem(("a", "b"), lambda unit: unit, residuals, lambda _: None, 10))


def test_a_calibration_stands_where_an_optimiser_has_no_answer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def none(*_: object) -> None:
        raise RunFailed("least_squares: unstable")

    monkeypatch.setattr("birdstrike.inversion.models.joint_fit.optimised", none)
    cases, records = rig.shots()
    with rig.formula_for_solver():
        options = {"posterior": False, "optimisers": ["least_squares"], "budget": 5, "workers": 1}
        found = calibrate_models(cases[0], records[0], tmp_path, ["murnaghan"], runs=10, **options)
    assert found.ranking == ("murnaghan",)
    assert not found.models["murnaghan"].optimised
    assert any("least_squares: unstable" in line for line in found.warnings)


def test_unknown_optimisers_are_refused() -> None:
    with pytest.raises(UserError, match='"simplex" is unknown; use one or more of least_squares, cma'):
        refuse_unknown(["simplex"])


def test_an_optimiser_is_named_once() -> None:
    """It was run twice, and one answer was lost."""
    with pytest.raises(UserError, match="--optimisers names cma more than once: name it once"):
        refuse_unknown(["cma", "least_squares", "cma"])
    refuse_unknown(["least_squares"])


def test_several_optimisers_in_one_text_are_refused_with_the_list_that_is_meant() -> None:
    """In Python: "cma,least_squares" was said to be unknown, beside the advice to use cma or least_squares."""
    cases, records = rig.shots()
    with pytest.raises(UserError, match=r"one text with several names; give a list: \['cma', 'least_squares'\]"):
        calibrate_models(cases, records, "never_made", "null", optimisers="cma, least_squares")


def test_least_squares_runs_beside_the_calibration(tmp_path: Path) -> None:
    cases, records = rig.shots()
    with rig.formula_for_solver():
        options = {"posterior": False, "optimisers": ["least_squares"], "budget": 30, "workers": 1}
        found = calibrate_models(cases[0], records[0], tmp_path, ["murnaghan"], runs=10, **options)
    other = found.models["murnaghan"].optimised["least_squares"]
    assert 1 < other.strikes <= 30
    assert other.weighted < 20.0
    (line,) = optimised_lines(found)
    assert line.startswith(f"murnaghan by least squares: error {other.weighted:.2f} times the noise with ")
    assert f"{other.strikes} simulations a shot ({other.ended}); the calibration's " in line


def test_a_simulation_without_numbers_is_no_answer() -> None:
    def residuals(values: Mapping[str, float]) -> np.ndarray:
        return np.array([values["a"] - 0.9 if values["a"] < 0.95 else np.nan])

    found = optimised("least_squares", Problem(("a",), lambda unit: unit, residuals, lambda _: None, 30))
    assert found.parameters["a"] == pytest.approx(0.9, abs=0.05)
    with pytest.raises(RunFailed, match="readings that are no numbers"):
        optimised("least_squares", Problem(("a",), lambda unit: unit, lambda _: np.array([np.nan]), lambda _: None, 5))
