"""Uniform designs: levels, discrepancy against scipy and against random designs, determinism."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import qmc

from birdstrike.data.errors import UserError
from birdstrike.doe.designs import annealing
from birdstrike.doe.designs.uniform import LARGEST, _good_lattice, centred, uniform_design


def cd2(unit: np.ndarray) -> float:
    """scipy's squared centred discrepancy."""
    return float(qmc.discrepancy(unit, method="CD"))


@pytest.fixture(scope="module")
def uniform_25() -> np.ndarray:
    return uniform_design(25, 4, seed=0)


@pytest.fixture
def short_search(monkeypatch: pytest.MonkeyPatch) -> None:
    """A hundredth of the usual search, for what does not depend on how good the design is."""
    monkeypatch.setattr("birdstrike.doe.designs.uniform.SWAPS", 20_000)


@pytest.mark.usefixtures("short_search")
@pytest.mark.parametrize(("runs", "columns"), [(2, 3), (7, 1), (12, 3), (30, 12)])
def test_every_column_is_a_permutation_of_the_levels(runs: int, columns: int) -> None:
    unit = uniform_design(runs, columns, seed=1)
    levels = (2.0 * np.arange(1, runs + 1) - 1.0) / (2.0 * runs)
    np.testing.assert_allclose(np.sort(unit, axis=0), np.tile(levels[:, None], columns), rtol=0, atol=1e-15)


def test_25_runs_of_4_factors_have_a_squared_discrepancy_below_0_0033(uniform_25: np.ndarray) -> None:
    assert cd2(uniform_25) < 0.0033
    np.testing.assert_allclose(np.sort(uniform_25, axis=0)[:, 0], (np.arange(25) + 0.5) / 25)


def test_a_uniform_design_beats_the_best_of_1000_random_latin_hypercubes(uniform_25: np.ndarray) -> None:
    random = [cd2(qmc.LatinHypercube(4, scramble=False, rng=seed).random(25)) for seed in range(1000)]
    assert cd2(uniform_25) < 0.75 * min(random)


@pytest.mark.usefixtures("short_search")
def test_the_same_seed_gives_the_same_design_and_another_seed_another() -> None:
    first, again, other = (uniform_design(15, 3, seed) for seed in (3, 3, 4))
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, other)


def test_the_exchange_s_increment_is_the_change_of_scipy_s_discrepancy() -> None:
    rng = np.random.default_rng(0)
    n, k = 11, 3
    levels = np.stack([rng.permutation(n) for _ in range(k)])
    pair, single = annealing._tables(n)
    pairs, singles = annealing._products(levels, pair, single)
    for _ in range(50):
        j = int(rng.integers(k))
        a, b = map(int, rng.choice(n, 2, replace=False))
        before, u, v = cd2(centred(levels.T)), levels[j, a], levels[j, b]
        change = annealing._pair_change(pairs, levels[j], pair, 1.0 / pair, a, b) / n**2
        change -= 2.0 / n * (singles[a] / single[u] - singles[b] / single[v]) * (single[v] - single[u])
        annealing._exchange(pairs, singles, levels[j], pair, single, a, b)
        assert change == pytest.approx(cd2(centred(levels.T)) - before, rel=0, abs=1e-13)
    np.testing.assert_allclose(pairs, annealing._products(levels, pair, single)[0], rtol=1e-12)


def test_the_walk_returns_a_design_no_worse_than_its_start() -> None:
    levels = np.ascontiguousarray(_good_lattice(13, 3).T)
    start, best = cd2(centred(levels.T)), np.empty_like(levels)
    annealing.anneal(levels, 2000, 2, 1e-3, 1e-4, np.random.default_rng(0), best)
    assert cd2(centred(best.T)) <= start


def test_a_good_lattice_start_is_better_than_the_median_random_hypercube() -> None:
    random = [cd2(qmc.LatinHypercube(4, scramble=False, rng=seed).random(25)) for seed in range(101)]
    assert cd2(centred(_good_lattice(25, 4))) < np.median(random)


def test_too_many_runs_for_the_exchange_are_refused_with_the_alternative() -> None:
    with pytest.raises(UserError, match=rf"{LARGEST + 1} is outside 2 .. {LARGEST}.*--design sobol"):
        uniform_design(LARGEST + 1, 4, seed=0)
