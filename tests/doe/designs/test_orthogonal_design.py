"""Orthogonal arrays: strength 2, levels, permutation, sizes."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy.stats import qmc

from birdstrike.data.errors import UserError
from birdstrike.doe.designs.orthogonal import field_tables, orthogonal_design, prime_power, rao_hamming, sizes
from birdstrike.doe.designs.quality import design_quality


def times_of_pairs(levels: np.ndarray) -> set[int]:
    """How often each pair of levels stands in each pair of columns."""
    found: set[int] = set()
    for a, b in itertools.combinations(range(levels.shape[1]), 2):
        pairs, counts = np.unique(levels[:, [a, b]], axis=0, return_counts=True)
        q = len(np.unique(levels[:, a]))
        found |= set(counts.tolist()) | ({0} if len(pairs) < q * q else set())
    return found


@pytest.mark.parametrize(
    ("q", "power", "columns"),
    [(3, 2, 4), (4, 2, 5), (5, 2, 6), (7, 2, 8), (8, 2, 9), (9, 2, 10), (3, 3, 13), (4, 3, 21), (5, 3, 31)],
)
def test_rao_hamming_array_has_strength_2_and_full_width(q: int, power: int, columns: int) -> None:
    array = rao_hamming(q, power)
    assert array.shape == (q**power, columns)
    assert times_of_pairs(array) == {q ** (power - 2)}


@pytest.mark.parametrize(("runs", "q"), [(9, 3), (16, 4), (25, 5), (49, 7), (64, 8)])
def test_permuted_levels_keep_strength_2_and_stand_at_cell_centres(runs: int, q: int) -> None:
    unit = orthogonal_design(runs, 4, seed=2)
    levels = np.rint(unit * 2 * q - 1).astype(int) // 2
    np.testing.assert_allclose(unit, (2 * levels + 1) / (2 * q), rtol=0, atol=1e-15)
    assert times_of_pairs(levels) == {1}
    quality = design_quality(unit)
    assert quality.max_correlation == pytest.approx(0.0, abs=1e-12)
    assert quality.condition == pytest.approx(1.0, abs=1e-12)


def test_permuting_the_levels_of_l25_lowers_its_discrepancy() -> None:
    tabulated = (2 * rao_hamming(5, 2)[:, :4] + 1) / 10
    permuted = orthogonal_design(25, 4, seed=0)
    assert qmc.discrepancy(permuted, method="CD") < qmc.discrepancy(tabulated, method="CD")
    assert qmc.discrepancy(permuted, method="CD") < 0.01769  # 0.01768 is the best known to be reached this way


def test_the_same_seed_gives_the_same_array() -> None:
    np.testing.assert_array_equal(orthogonal_design(25, 4, 5), orthogonal_design(25, 4, 5))


@pytest.mark.parametrize("runs", [8, 24, 26, 50])
def test_a_count_without_an_array_names_the_counts_with_one(runs: int) -> None:
    with pytest.raises(UserError, match=rf"--runs = {runs} .*allowed: 9, 16, 25, 27, 49, "):
        orthogonal_design(runs, 4, seed=0)


def test_nine_runs_have_no_room_for_five_factors() -> None:
    assert 9 in sizes(4)
    assert 9 not in sizes(5)
    assert 25 in sizes(6)
    assert 25 not in sizes(7)


@pytest.mark.parametrize("q", [2, 4, 5, 8, 9, 25, 27])
def test_tables_are_those_of_a_field(q: int) -> None:
    add, multiply = field_tables(q)
    elements = np.arange(q)
    for table, neutral in ((add, 0), (multiply, 1)):
        np.testing.assert_array_equal(table, table.T)
        np.testing.assert_array_equal(table[neutral], elements)
        np.testing.assert_array_equal(table[table], table[elements[:, None, None], table])  # (a.b).c = a.(b.c)
    assert all(sorted(row) == list(elements) for row in add)
    assert all(sorted(row) == list(elements) for row in multiply[1:])  # every element but 0 has an inverse
    np.testing.assert_array_equal(multiply[:, add], add[multiply[:, :, None], multiply[:, None, :]])  # distributive


def test_only_prime_powers_have_a_field() -> None:
    assert [q for q in range(1, 28) if prime_power(q)] == [2, 3, 4, 5, 7, 8, 9, 11, 13, 16, 17, 19, 23, 25, 27]
    assert prime_power(27) == (3, 3)
    with pytest.raises(ValueError, match="6 is no power of a prime"):
        field_tables(6)
