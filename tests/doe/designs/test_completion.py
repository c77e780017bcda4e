"""Completion of a design: the held runs stay, the added ones fill the box."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import qmc

from birdstrike.doe.designs import completion
from birdstrike.doe.designs.completion import completed
from birdstrike.doe.designs.quality import cd2

HELD = qmc.LatinHypercube(3, rng=5).random(10)


def test_held_runs_stay_bit_for_bit_and_a_seed_means_one_completion() -> None:
    first, again, other = completed(HELD, 16, 0), completed(HELD, 16, 0), completed(HELD, 16, 1)
    np.testing.assert_array_equal(first[:10], HELD)
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, other)
    levels = (2.0 * np.arange(16) + 1.0) / 32.0
    assert np.isin(first[10:], levels).all()


def test_a_completion_beats_the_best_of_1000_random_ones() -> None:
    random = [cd2(np.vstack([HELD, qmc.LatinHypercube(3, rng=seed).random(6)])) for seed in range(1000)]
    assert cd2(completed(HELD, 16, 0)) < 0.9 * min(random)


def test_an_empty_half_of_the_box_is_filled_first() -> None:
    held = HELD * np.array([0.5, 1.0, 1.0])
    assert (completed(held, 16, 0)[10:, 0] > 0.5).all()


def test_the_terms_of_an_exchange_are_those_of_scipy_s_discrepancy() -> None:
    rng = np.random.default_rng(0)
    points, levels = rng.random((9, 3)), np.linspace(0.05, 0.95, 10)
    pairs = np.prod([completion._pair(x, x) for x in points.T], axis=0)
    singles = np.prod(completion._single(points), axis=1)
    for _ in range(20):
        row, column = int(rng.integers(9)), int(rng.integers(3))
        tried = [points.copy() for _ in levels]
        for trial, level in zip(tried, levels, strict=True):
            trial[row, column] = level
        least = min([cd2(points), *map(cd2, tried)])
        completion._place(points, row, column, levels, pairs, singles)
        assert cd2(points) == pytest.approx(least, rel=1e-9)
    np.testing.assert_allclose(pairs, np.prod([completion._pair(x, x) for x in points.T], axis=0), rtol=1e-12)


def test_a_held_run_outside_the_box_is_kept_as_it_is() -> None:
    held = np.vstack([HELD, [[1.2, 0.5, -0.1]]])
    np.testing.assert_array_equal(completed(held, 14, 0)[:11], held)
