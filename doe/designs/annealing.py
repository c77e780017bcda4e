"""Swap annealing of a U-type design on its centred L2 discrepancy: the compiled inner loop."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from birdstrike.data.histories import Array

Levels = NDArray[np.int64]


def _tables(n: int) -> tuple[Array, Array]:
    """Factors of the discrepancy's products by level: pair[u, v] and single[u], levels at x = (2u + 1)/(2n).

    With z = |x - 1/2|: pair = 1 + z_u/2 + z_v/2 - |x_u - x_v|/2 and single = 1 + z_u/2 - z_u^2/2
    (F. J. Hickernell, Math. Comp. 67 (1998) 299, eq. 5.1c).
    """
    x = (2.0 * np.arange(n) + 1.0) / (2.0 * n)
    z = np.abs(x - 0.5)
    single = 1.0 + 0.5 * z - 0.5 * z * z
    return 1.0 + 0.5 * z[:, None] + 0.5 * z - 0.5 * np.abs(x[:, None] - x), single


def _products(levels: Levels, pair: Array, single: Array) -> tuple[Array, Array]:
    """Products over the rows of levels (k, n) for every pair of runs, (n, n), and for every run, (n,)."""
    n = levels.shape[1]
    pairs, singles = np.ones((n, n)), np.ones(n)
    for row in levels:
        singles *= single[row]
        pairs *= pair[np.ix_(row, row)]
    return pairs, singles


@njit(cache=True)
def _pair_change(pairs, column, pair, inverse, a, b):
    """Change of the sum of `pairs` when runs a and b exchange their levels in `column`, O(n); inverse = 1/pair."""
    u, v = column[a], column[b]
    change = 0.0
    for m in range(column.shape[0]):
        if m != a and m != b:  # the product of a and b themselves does not change
            w = column[m]
            change += (pairs[a, m] * inverse[u, w] - pairs[b, m] * inverse[v, w]) * (pair[v, w] - pair[u, w])
    own_a = pairs[a, a] * (pair[v, v] / pair[u, u] - 1.0)
    own_b = pairs[b, b] * (pair[u, u] / pair[v, v] - 1.0)
    return 2.0 * change + own_a + own_b


@njit(cache=True)
def _exchange(pairs, singles, column, pair, single, a, b):
    """Exchange the levels of runs a and b in `column` and bring the products up to date, O(n)."""
    u, v = column[a], column[b]
    for m in range(column.shape[0]):
        if m != a and m != b:
            ratio = pair[v, column[m]] / pair[u, column[m]]
            pairs[a, m] *= ratio
            pairs[b, m] /= ratio
            pairs[m, a], pairs[m, b] = pairs[a, m], pairs[b, m]
    pairs[a, a] *= pair[v, v] / pair[u, u]
    pairs[b, b] *= pair[u, u] / pair[v, v]
    singles[a] *= single[v] / single[u]
    singles[b] *= single[u] / single[v]
    column[a], column[b] = v, u


def anneal(
    levels: Levels, steps: int, reach: int, hot: float, cold: float, rng: np.random.Generator, best: Levels
) -> None:
    """Metropolis walk over swaps within columns while the temperature falls from `hot` to `cold` (geometrically).

    levels: (k, n) int, each row a permutation of 0..n-1, changed in place. A swap exchanges two levels at most
    `reach` apart (round the end): small moves are accepted more often than arbitrary ones. hot, cold in units of the
    squared discrepancy. Writes the best design met into `best`, (k, n). Bounded by `steps`, not by the clock.
    """
    pair, single = _tables(levels.shape[1])
    pairs, singles = _products(levels, pair, single)
    holder = np.argsort(levels, axis=1)  # which run holds a level
    _walk(levels, best, (pair, 1.0 / pair, single), (pairs, singles, holder), (steps, reach, hot, cold), rng)


@njit(cache=True)
def _walk(levels, best, tables, state, schedule, rng):
    """The compiled walk; tables: pair, 1/pair, single; state: pairs, singles, holder, brought up to date."""
    k, n = levels.shape
    pair, inverse, single = tables
    pairs, singles, holder = state
    steps, reach, hot, cold = schedule
    current = lowest = 0.0  # relative to the start: only differences decide
    best[:] = levels
    temperature, cooling = hot, (cold / hot) ** (1.0 / steps)
    for _ in range(steps):
        temperature *= cooling
        j = int(k * rng.random())
        u = int(n * rng.random())
        v = (u + 1 + int(reach * rng.random())) % n
        a, b = holder[j, u], holder[j, v]
        change = _pair_change(pairs, levels[j], pair, inverse, a, b) / (n * n)
        change -= 2.0 / n * (singles[a] / single[u] - singles[b] / single[v]) * (single[v] - single[u])
        if change <= 0.0 or rng.random() < math.exp(-change / temperature):
            _exchange(pairs, singles, levels[j], pair, single, a, b)
            holder[j, u], holder[j, v] = b, a
            current += change
            if current < lowest - 1e-15:
                lowest = current
                best[:] = levels
