"""Finite fields GF(p^m): sums and products of their elements 0..q-1 as two tables."""

from __future__ import annotations

import itertools
from functools import cache

import numpy as np
from numpy.typing import NDArray

Table = NDArray[np.int64]


def prime_power(q: int) -> tuple[int, int] | None:
    """(p, m) with q = p^m, or None where q is no power of a prime."""
    p = next((d for d in range(2, q + 1) if q % d == 0), 0)
    m = 0
    while p and q > 1 and q % p == 0:
        q, m = q // p, m + 1
    return (p, m) if p and q == 1 else None


@cache
def tables(q: int) -> tuple[Table, Table]:
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


def _irreducible(p: int, m: int) -> Table:
    """Coefficients, lowest first, of the first monic polynomial of degree m without a monic divisor of lower degree."""
    for low in itertools.product(range(p), repeat=m):
        candidate = np.array([*low, 1])
        divisors = (np.array([*d, 1]) for k in range(1, m // 2 + 1) for d in itertools.product(range(p), repeat=k))
        if all(_remainder(candidate, divisor, p).any() for divisor in divisors):
            return candidate
    raise AssertionError("there is an irreducible polynomial of every degree")


def _remainder(dividend: Table, divisor: Table, p: int) -> Table:
    """Remainder modulo a monic divisor over GF(p), (deg divisor,)."""
    rest, k = np.array(dividend) % p, len(divisor) - 1
    for i in range(len(rest) - 1, k - 1, -1):
        rest[i - k : i + 1] = (rest[i - k : i + 1] - rest[i] * divisor) % p
    return np.pad(rest[:k], (0, max(k - len(rest), 0)))
