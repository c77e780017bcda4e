"""Orthogonal arrays of strength 2 (Rao-Hamming) with their levels permuted for a low discrepancy."""

from __future__ import annotations

import itertools
from functools import cache

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.errors import UserError
from birdstrike.data.histories import Array
from birdstrike.data.progress import Progress, silent
from birdstrike.doe.designs.design import DesignKind
from birdstrike.doe.designs.quality import cd2

Levels = NDArray[np.int64]

MOST_LEVELS = 31
LARGEST = 1000
"""Most levels and most runs of an array on offer."""

RESTARTS = 30
WORK = 3e8
"""Descents of the permutation, and a bound on the discrepancies computed in all of them times runs squared."""


def orthogonal_design(runs: int, columns: int, seed: int, progress: Progress = silent) -> Array:  # noqa: ARG001
    """(runs, columns) in 0..1 at q levels (2i - 1)/(2q); every two columns hold every pair of levels equally often.

    UserError names the run counts that exist for so many columns.
    """
    allowed = sizes(columns)
    if runs not in allowed:
        counts = ", ".join(str(n) for n in allowed)
        raise UserError(
            f"--runs = {runs} has no orthogonal array of {columns} factors here; allowed: {counts} "
            f"(or --design uniform, which takes any number)"
        )
    q, power = allowed[runs]
    return _centred(_permuted(rao_hamming(q, power), columns, q, np.random.default_rng(seed)), q)


def sizes(columns: int) -> dict[int, tuple[int, int]]:
    """Runs q^m of the arrays that have room for `columns` factors -> (levels q, power m), of two the more levels.

    Arrays of two levels are left out: no run would lie between the ends of a range.
    """
    found = {
        q**m: (q, m)
        for q in range(3, MOST_LEVELS + 1)
        if prime_power(q)
        for m in range(2, 10)
        if q**m <= LARGEST and (q**m - 1) // (q - 1) >= columns
    }
    return dict(sorted(found.items()))


def rao_hamming(q: int, power: int) -> Levels:
    """The array with q^m runs and (q^m - 1)/(q - 1) columns: run x in GF(q)^m, column c.x; q any prime power.

    The c are all vectors whose first non-zero entry is 1: no two are proportional, so that any two columns take
    every pair of levels q^(m-2) times (A. S. Hedayat, N. J. A. Sloane, J. Stufken, Orthogonal Arrays, 1999,
    theorem 3.20).
    """
    add, multiply = field_tables(q)
    points = np.array(list(itertools.product(range(q), repeat=power)))
    first = np.array([point[np.flatnonzero(point)[0]] if point.any() else 0 for point in points])
    columns = points[first == 1]
    array = np.zeros((len(points), len(columns)), dtype=np.int64)
    for axis in range(power):
        array = add[array, multiply[points[:, axis][:, None], columns[:, axis][None, :]]]
    return array


def _permuted(array: Levels, columns: int, q: int, rng: np.random.Generator) -> Levels:
    """Choose columns and rename their levels: the best of `RESTARTS` descents; strength 2 is kept by any renaming."""
    best, lowest, left = array[:, :columns], np.inf, int(WORK / (len(array) ** 2 * columns))
    for _ in range(RESTARTS):
        chosen = array[:, np.sort(rng.permutation(array.shape[1])[:columns])]
        found, value, left = _descent(chosen, q, rng, left)
        if value < lowest - 1e-12:
            best, lowest = found, value
        if left <= 0:
            break
    return best


def _descent(array: Levels, q: int, rng: np.random.Generator, left: int) -> tuple[Levels, float, int]:
    """Exchange two levels' names in one column as long as that lowers the centred discrepancy, at most `left` times."""
    names = [rng.permutation(q) for _ in range(array.shape[1])]
    value = _discrepancy(array, names, q)
    improved = True
    while improved and left > 0:
        improved = False
        for column, (u, v) in itertools.product(range(len(names)), itertools.combinations(range(q), 2)):
            left -= 1
            if left < 0:
                break
            names[column][[u, v]] = names[column][[v, u]]
            trial = _discrepancy(array, names, q)
            if trial < value - 1e-12:
                value, improved = trial, True
            else:
                names[column][[u, v]] = names[column][[v, u]]
    return _renamed(array, names), value, left


def _renamed(array: Levels, names: list[Levels]) -> Levels:
    return np.stack([name[column] for name, column in zip(names, array.T, strict=True)], axis=1)


def _discrepancy(array: Levels, names: list[Levels], q: int) -> float:
    return cd2(_centred(_renamed(array, names), q))


def _centred(levels: Levels, q: int) -> Array:
    """Levels 0..q-1 at the middle of q equal cells."""
    return (2.0 * levels.astype(np.float64) + 1.0) / (2.0 * q)


# --- arithmetic of the finite field GF(q), on which the arrays rest ---


def prime_power(q: int) -> tuple[int, int] | None:
    """(p, m) with q = p^m, or None where q is no power of a prime."""
    p = next((d for d in range(2, q + 1) if q % d == 0), 0)
    m = 0
    while p and q > 1 and q % p == 0:
        q, m = q // p, m + 1
    return (p, m) if p and q == 1 else None


@cache
def field_tables(q: int) -> tuple[Levels, Levels]:
    """(q, q) tables of a + b and a * b. An element's digits in base p are a polynomial's coefficients, lowest first.

    Products are taken modulo the first irreducible monic polynomial of degree m; ValueError where q is no prime power.
    """
    found = prime_power(q)
    if found is None:
        raise ValueError(f"{q} is no power of a prime: there is no field of that size")
    p, m = found
    digits = np.array([[a // p**i % p for i in range(m)] for a in range(q)])
    weights = p ** np.arange(m)
    add = ((digits[:, None] + digits[None, :]) % p) @ weights
    modulus = _irreducible(p, m)
    multiply = [[int(_remainder(np.convolve(a, b), modulus, p) @ weights) for b in digits] for a in digits]
    return add, np.array(multiply)


def _irreducible(p: int, m: int) -> Levels:
    """Coefficients, lowest first, of the first monic polynomial of degree m without a monic divisor of lower degree."""
    for low in itertools.product(range(p), repeat=m):
        candidate = np.array([*low, 1])
        divisors = (np.array([*d, 1]) for k in range(1, m // 2 + 1) for d in itertools.product(range(p), repeat=k))
        if all(_remainder(candidate, divisor, p).any() for divisor in divisors):
            return candidate
    raise AssertionError("there is an irreducible polynomial of every degree")


def _remainder(dividend: Levels, divisor: Levels, p: int) -> Levels:
    """Remainder modulo a monic divisor over GF(p), (deg divisor,)."""
    rest, k = np.array(dividend) % p, len(divisor) - 1
    for i in range(len(rest) - 1, k - 1, -1):
        rest[i - k : i + 1] = (rest[i - k : i + 1] - rest[i] * divisor) % p
    return np.pad(rest[:k], (0, max(k - len(rest), 0)))


ORTHOGONAL = DesignKind(
    "orthogonal", orthogonal_design, extended="together they are no orthogonal array, the first {runs} are"
)
