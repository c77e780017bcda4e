"""Swap annealing of a U-type design on its centred L2 discrepancy: the compiled inner loop."""

from __future__ import annotations

import math

import numpy as np
from numba import njit


@njit(cache=True)
def _tables(n):
    """Factors of the discrepancy's products by level: pair[u, v] and single[u], levels at x = (2u + 1)/(2n).

    With z = |x - 1/2|: pair = 1 + z_u/2 + z_v/2 - |x_u - x_v|/2 and single = 1 + z_u/2 - z_u^2/2
    (F. J. Hickernell, Math. Comp. 67 (1998) 299, eq. 5.1c).
    """
    x = (2.0 * np.arange(n) + 1.0) / (2.0 * n)
    z = np.abs(x - 0.5)
    single = 1.0 + 0.5 * z - 0.5 * z * z
    pair = np.empty((n, n))
    for u in range(n):
        for v in range(n):
            pair[u, v] = 1.0 + 0.5 * z[u] + 0.5 * z[v] - 0.5 * abs(x[u] - x[v])
    return pair, single


@njit(cache=True)
def _products(levels, pair, single):
    """Products over the columns for every pair of runs, (n, n), and for every run, (n,)."""
    n, k = levels.shape
    pairs, singles = np.ones((n, n)), np.ones(n)
    for i in range(n):
        for j in range(k):
            singles[i] *= single[levels[i, j]]
            for m in range(n):
                pairs[i, m] *= pair[levels[i, j], levels[m, j]]
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


@njit(cache=True)
def anneal(levels, steps, reach, hot, cold, rng, best):
    """Metropolis walk over swaps within columns while the temperature falls from `hot` to `cold` (geometrically).

    levels: (k, n) int, each row a permutation of 0..n-1, changed in place. A swap exchanges two levels at most
    `reach` apart (round the end): small moves are accepted more often than arbitrary ones. hot, cold in units of the
    squared discrepancy; rng: a numpy Generator. Writes the best design met into `best`, (k, n). Bounded by `steps`, not
    by the clock.
    """
    k, n = levels.shape
    pair, single = _tables(n)
    inverse = 1.0 / pair
    pairs, singles = _products(levels.T, pair, single)
    holder = _holders(levels)
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


@njit(cache=True)
def _holders(levels):
    """Which run holds a level: (k, n)."""
    holder = np.empty_like(levels)
    for j in range(levels.shape[0]):
        for i in range(levels.shape[1]):
            holder[j, levels[j, i]] = i
    return holder
