"""Sums in a fixed serial order: the same bits on any number of threads."""

from __future__ import annotations

from numba import njit


@njit(cache=True)
def total(values):
    """Sum of a vector."""
    result = 0.0
    for i in range(values.shape[0]):
        result += values[i]
    return result


@njit(cache=True)
def work_of_forces(before, after, v, n):
    """Sum over rows < n of (before + after)/2 . v: power of forces trapezoidal over the step of velocity v [W].

    Forces that are zero, most of contact's, are passed over: the additions wait for one another.
    """
    result = 0.0
    for a in range(n):
        for c in range(3):
            both = before[a, c] + after[a, c]
            if both != 0.0:
                result += 0.5 * both * v[a, c]
    return result


@njit(cache=True)
def column_sums(force, n, result):
    """Resultant of n force rows, result: (3,)."""
    result[:] = 0.0
    for a in range(n):
        for c in range(3):
            result[c] += force[a, c]


@njit(cache=True)
def moment_of(x, force, n, result):
    """Sum over rows < n of x cross force about the origin, result: (3,)."""
    result[:] = 0.0
    for a in range(n):
        result[0] += x[a, 1] * force[a, 2] - x[a, 2] * force[a, 1]
        result[1] += x[a, 2] * force[a, 0] - x[a, 0] * force[a, 2]
        result[2] += x[a, 0] * force[a, 1] - x[a, 1] * force[a, 0]


@njit(cache=True)
def weighted_square(weight, v, n):
    """Sum over rows < n of weight |v|^2 / 2; weight has one entry per row or a single one."""
    result = 0.0
    for a in range(n):
        w = weight[a] if weight.shape[0] > 1 else weight[0]
        result += 0.5 * w * (v[a, 0] * v[a, 0] + v[a, 1] * v[a, 1] + v[a, 2] * v[a, 2])
    return result
