"""The draws' part of the numerical error, multiplied until the draws predict one another where the diagnosis looks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from birdstrike.data.histories import Array
from birdstrike.inversion.diagnosis.calibrated import LARGEST, Columns, calibrated, mean_square
from birdstrike.inversion.diagnosis.point_error import PointError
from birdstrike.inversion.diagnosis.widened import matern

N, KNOWN = 120, 10
TIME = np.linspace(0.0, 1e-3, N)
NOISE = 0.1**2 * np.eye(N)
COLUMNS = Columns(
    np.stack([np.sin(np.pi * TIME / 1e-3), TIME / 1e-3]).T,
    np.eye(2),
    np.stack([np.sin(k * np.pi * TIME / 1e-3) for k in (2, 3, 5)]).T,
)


def draws(count: int, seed: int) -> Array:
    """Of a smooth process of unit size."""
    root = np.linalg.cholesky(matern(TIME, 2e-4) + 1e-9 * np.eye(N))
    return np.random.default_rng(seed).standard_normal((count, N)) @ root.T


def known_from(rest: Array, share: float) -> PointError:
    """No gain and shift; a process of this share beside the draws."""
    none = np.zeros((len(rest), 2))
    frames = np.zeros((len(rest), 2, N))
    here = (TIME, np.zeros(N, dtype=int))
    return PointError(np.zeros((N, N)), rest, rest, none, frames, np.ones(2), ((2e-4, share),), *here)


def scores(error: PointError, changes: Array) -> float:
    covariance = error.at(np.zeros((2, N))) + NOISE
    return float(np.mean([mean_square(covariance, one, COLUMNS, NOISE) for one in changes]))


def test_the_score_of_a_known_covariance_is_one() -> None:
    true = matern(TIME, 2e-4) + NOISE
    assert np.mean([mean_square(true, one, COLUMNS, NOISE) for one in draws(400, 1)]) == pytest.approx(1.0, abs=0.1)


def test_too_small_an_error_is_multiplied_until_new_draws_score_one() -> None:
    before, after = [], []
    for seed in range(8):
        small = known_from(draws(KNOWN, seed), 0.01)
        found = calibrated(small, COLUMNS, NOISE)
        new = draws(100, 100 + seed) - small.rest.mean(axis=0)
        before.append(scores(small, new))
        after.append(scores(found, new))
        assert found.size > 1.5
    assert np.mean(before) > 2.0
    assert np.mean(after) == pytest.approx(1.0, abs=0.3)


def test_an_error_that_is_large_enough_stays() -> None:
    assert calibrated(known_from(draws(KNOWN, 0), 3.0), COLUMNS, NOISE).size == 1.0


def test_a_few_draws_tell_no_size_and_nothing_grows_for_ever() -> None:
    assert calibrated(known_from(draws(4, 0), 0.01), COLUMNS, NOISE).size == 1.0
    still = replace(known_from(draws(KNOWN, 0), 1e-12), rest=np.zeros((KNOWN, N)))
    assert calibrated(still, COLUMNS, NOISE).size == LARGEST


def test_an_effect_that_the_others_imitate_is_left_out() -> None:
    twice = replace(COLUMNS, priors=np.zeros((2, 2)), effects=np.hstack([COLUMNS.effects, COLUMNS.shared[:, :1]]))
    true = matern(TIME, 2e-4) + NOISE
    change = draws(1, 3)[0]
    assert np.isfinite(mean_square(true, change, twice, NOISE))
