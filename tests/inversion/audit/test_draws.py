"""Drawn refits within bounds: the bounded solution, and the share of draws that a true model survives."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import lsq_linear
from scipy.stats import binom

from birdstrike.data.histories import Array
from birdstrike.inversion.audit.draws import answer, bounded_least_squares
from birdstrike.inversion.diagnosis.covariance import Whitener
from birdstrike.inversion.diagnosis.judge import Judged
from birdstrike.inversion.diagnosis.refit import Fit, Problem
from birdstrike.inversion.diagnosis.statistics import Reference
from birdstrike.inversion.diagnosis.verdict import NONE
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


def survived(truth: Array, seed: int) -> Array:
    """(DRAWS,) whether the true model is kept at 5 %."""
    design = correlated_design(seed)
    model: Any = LinearModel(design, SimpleNamespace(values=design @ truth))
    low, high = np.zeros(UNKNOWNS), np.ones(UNKNOWNS)
    box = Box(low, high, np.zeros(UNKNOWNS, dtype=bool), low, high)
    problem = Problem(model, Whitener.of(np.eye(POINTS)), ())

    def judged(name: str, fit: Fit) -> Judged:
        reference = Reference.of(fit.linear)
        return Judged(name, fit, reference, reference.judge(), True)

    judge: Any = SimpleNamespace(judged=judged)
    base = judged(NONE, Fit(problem, (), box, truth, 0.0))
    noise = np.random.default_rng(100 + seed).standard_normal((DRAWS, POINTS))
    return answer(judge, {NONE: base}, noise, ALPHA).holds(NONE)


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
