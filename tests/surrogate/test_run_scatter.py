"""Shrinkage of the covariance of a few dozen curves, on draws whose correlation is known."""

from __future__ import annotations

import numpy as np
import pytest

from birdstrike.surrogate.run_scatter import shrunk_correlation

OTHERS = np.eye(40) == 0.0


def test_chance_correlations_of_independent_columns_are_shrunk_away() -> None:
    """All 780 of them are chance, 1/30 in variance: a shrinkage of 1 leaves nothing, of a half it leaves half."""
    rng = np.random.default_rng(0)
    left = []
    for _ in range(20):
        rows = rng.standard_normal((30, 40))
        sample = np.asarray(np.corrcoef(rows, rowvar=False))
        left.append(np.linalg.norm(shrunk_correlation(rows)[OTHERS]) / np.linalg.norm(sample[OTHERS]))
    assert np.mean(left) < 0.1


def test_a_correlation_that_many_draws_show_is_kept() -> None:
    rows = np.random.default_rng(0).multivariate_normal(np.zeros(40), 0.6 + 0.4 * np.eye(40), 5000)
    assert shrunk_correlation(rows)[OTHERS].mean() == pytest.approx(0.6, abs=0.03)
