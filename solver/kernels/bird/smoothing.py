"""Wendland C2 smoothing kernel in three dimensions, compact support 2h."""

from __future__ import annotations

import math

from numba import njit

NORMALISATION = 21.0 / (16.0 * math.pi)


@njit(cache=True, inline="always")
def wendland(q, h):
    """W(q) = 21/(16 pi h^3) (1 - q/2)^4 (1 + 2q) [1/m^3] for q = r/h < 2, else 0.

    H. Wendland, Adv. Comput. Math. 4 (1995) 389; free of pairing instability (Dehnen & Aly, MNRAS 425 (2012) 1068).
    """
    if q >= 2.0:
        return 0.0
    s = 1.0 - 0.5 * q
    return NORMALISATION / h**3 * s * s * s * s * (1.0 + 2.0 * q)


@njit(cache=True, inline="always")
def slope_constant(h):
    """The constant of `slope`, [1/m^5]: hoisted out of the pair loops."""
    return -5.0 * NORMALISATION / h**5


@njit(cache=True, inline="always")
def slope(q, constant):
    """F = (dW/dr)/r = constant (1 - q/2)^3 [1/m^5], 0 for q > 2, so that grad W = F (x_a - x_b)."""
    s = max(1.0 - 0.5 * q, 0.0)
    return constant * s * s * s
