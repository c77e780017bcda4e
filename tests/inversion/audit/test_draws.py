"""Drawn refits within bounds: the bounded solution, and the share of draws that a true model survives."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from birdstrike.inversion.diagnosis.covariance import Whitener
from birdstrike.inversion.diagnosis.judge import Judged
from birdstrike.inversion.diagnosis.statistics import Reference
from birdstrike.inversion.diagnosis.verdict import NONE
from scipy.optimize import lsq_linear
from scipy.stats import binom

from birdstrike.data.histories import Array
from birdstrike.inversion.audit import draws
from birdstrike.inversion.audit.draws import answer, bounded_least_squares
from birdstrike.inversion.diagnosis.ranking import Fit, Problem
from birdstrike.inversion.estimation.coordinates import Box

POINTS, UNKNOWNS, DRAWS = 16, 8, 2000
ALPHA = 0.05
INSIDE = 2e-4  # of the range: what counts as off a bound in a fit, and is nothing beside the standard errors


class NoPrior:
    """The prior of parameters about which nothing is known: it adds no row to a fit."""

    def __sub__(self, z: Array) -> Array:
        return np.zeros((len(z), 0))


@dataclass(frozen=True)
class LinearModel:
    """y = design z for parameters within 0..1, and no effect: what a drawn refit asks of a model, no more."""

    design: Array
    record: Any

    coordinates = SimpleNamespace(mean=NoPrior(), sd=1.0)
    known = ()

    def points(self, place: Any, _: Box) -> Array:
        return place.z @ self.design.T


def correlated_design(seed: int) -> Array:
    """Columns that look alike: a standard error of each unknown of tenths of its range."""
    rng = np.random.default_rng(seed)
    common = rng.standard_normal((POINTS, 1))
    return 8.0 * (0.98 * common + np.sqrt(1.0 - 0.98**2) * rng.standard_normal((POINTS, UNKNOWNS)))


class CurvedModel(LinearModel):
    """y = design (z + z^2), so that the slopes depend on where a draw is linearised."""

    def points(self, place: Any, _: Box) -> Array:
        return (place.z + place.z**2) @ self.design.T


def survived(truth: Array, seed: int) -> Array:
    """(DRAWS,) whether the true model is kept at 5 %."""
    return answered(truth, seed, LinearModel).holds(NONE)


def answered(truth: Array, seed: int, kind: type[LinearModel]) -> draws.Draws:
    """Answers over the draws of one true model."""
    design = correlated_design(seed)
    model: Any = kind(design, None)
    values = model.points(SimpleNamespace(z=truth), None)
    model = kind(design, SimpleNamespace(values=values))
    low, high = np.zeros(UNKNOWNS), np.ones(UNKNOWNS)
    box = Box(low, high, np.zeros(UNKNOWNS, dtype=bool), low, high)
    problem = Problem(model, Whitener.of(np.eye(POINTS)), ())

    def judged(name: str, fit: Fit) -> Judged:
        reference = Reference.of(fit.linear)
        return Judged(name, fit, reference, reference.judge(), True)

    judge: Any = SimpleNamespace(judged=judged)
    base = judged(NONE, Fit(problem, (), box, truth, 0.0))
    noise = np.random.default_rng(100 + seed).standard_normal((DRAWS, POINTS))
    return answer(judge, {NONE: base}, noise, ALPHA)


@pytest.mark.parametrize("seed", range(2))
def test_a_true_model_beside_its_bounds_survives_in_95_of_100_draws(seed: int) -> None:
    """With the truth at the corner of the box the residual on each face is chi-squared, so that 95 % is exact."""
    kept = survived(np.full(UNKNOWNS, INSIDE), seed)
    low, high = binom.interval(0.99, DRAWS, 1.0 - ALPHA)
    assert low <= kept.sum() <= high


def test_a_true_model_far_from_its_bounds_survives_in_95_of_100_draws() -> None:
    low, high = binom.interval(0.99, DRAWS, 1.0 - ALPHA)
    assert low <= survived(np.full(UNKNOWNS, 0.5), 7).sum() <= high


@pytest.mark.parametrize("seed", range(3))
def test_bounded_solutions_are_those_of_one_draw_at_a_time(seed: int) -> None:
    rng = np.random.default_rng(seed)
    design, start = correlated_design(seed), rng.random(UNKNOWNS)
    low, high = np.zeros(UNKNOWNS), np.ones(UNKNOWNS)
    residuals = 4.0 * rng.standard_normal((200, POINTS))
    x, sides = bounded_least_squares(design, residuals, start, low, high)
    for row, found, side in zip(residuals, x, sides, strict=True):
        solved = lsq_linear(design, row, (low - start, high - start), method="bvls", tol=1e-14)
        np.testing.assert_allclose(found, start + solved.x, atol=1e-7)
        np.testing.assert_array_equal(side, solved.active_mask)
    assert (sides != 0).any(axis=1).mean() > 0.5


def test_draws_that_do_not_settle_are_solved_where_they_are_judged(monkeypatch) -> None:
    """After one round many draws are due; their unknowns and their p belong to the same linearisation."""
    judged: list[tuple[Fit, Array]] = []

    def noted(one: Judged, rows: Array) -> Array:
        judged.append((one.fit, rows))
        return np.ones(len(rows))

    monkeypatch.setattr(draws, "ROUNDS", 1)
    monkeypatch.setattr(draws, "_p_values", noted)
    found = answered(np.full(UNKNOWNS, 0.02), 0, CurvedModel).unknowns[NONE]
    noise = np.random.default_rng(100).standard_normal((DRAWS, POINTS))
    place = {row.tobytes(): x for row, x in zip(noise, found, strict=True)}
    assert len(judged) > 20
    for fit, rows in judged:
        low, high = np.where(fit.at_bound, fit.x, 0.0), np.where(fit.at_bound, fit.x, 1.0)
        x, _ = bounded_least_squares(fit.whole_design, fit.linear.residual + rows, fit.x, low, high)
        own = np.array([place[row[:POINTS].tobytes()] for row in rows])
        np.testing.assert_allclose(own, x, atol=1e-9)


def test_an_unknown_without_a_range_is_fixed() -> None:
    rng = np.random.default_rng(3)
    design, start = correlated_design(3), rng.random(UNKNOWNS)
    low, high = np.zeros(UNKNOWNS), np.ones(UNKNOWNS)
    low[[2, 5]] = high[[2, 5]] = start[2], 0.25
    free = np.setdiff1d(np.arange(UNKNOWNS), [2, 5])
    residuals = 4.0 * rng.standard_normal((50, POINTS))
    x, sides = bounded_least_squares(design, residuals, start, low, high)
    assert (x[:, [2, 5]] == low[[2, 5]]).all()
    assert (sides[:, [2, 5]] == -1).all()
    for row, found in zip(residuals - design[:, 5:6].T * (0.25 - start[5]), x, strict=True):
        solved = lsq_linear(design[:, free], row, ((low - start)[free], (high - start)[free]), method="bvls", tol=1e-14)
        np.testing.assert_allclose(found[free], start[free] + solved.x, atol=1e-7)
    x, sides = bounded_least_squares(design, residuals, start, high, high)
    assert (x == high).all()
    assert (sides == -1).all()


def test_draws_solved_one_by_one_take_a_fixed_unknown(monkeypatch) -> None:
    monkeypatch.setattr(draws, "CHANGES", 1)
    design, low, high = correlated_design(4), np.zeros(UNKNOWNS), np.ones(UNKNOWNS)
    high[0] = 0.0
    residuals = 4.0 * np.random.default_rng(4).standard_normal((20, POINTS))
    x, _ = bounded_least_squares(design, residuals, np.full(UNKNOWNS, 0.5), low, high)
    assert (x[:, 0] == 0.0).all()
