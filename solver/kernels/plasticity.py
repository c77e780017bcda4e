"""Plane-stress J2 plasticity with combined isotropic and kinematic hardening: elastic law and radial return.

J. C. Simo & T. J. R. Hughes, Computational Inelasticity (1998), section 3.4: the yield function is diagonal in the
sum, the difference and the shear of the relative stress, which leaves one scalar equation for the multiplier.
The factor of the strain rate (G. R. Cowper & P. S. Symonds, Brown University report 28, 1957; Johnson & Cook) is that
of the very step (backward Euler), not an older one; heat and softening are those at the step's beginning.
"""

from __future__ import annotations

import math

from numba import njit

from birdstrike.solver.kernels.metal import (
    EPS_P,
    FLOW,
    HARDENING,
    HEAT,
    HEATING,
    KINEMATIC,
    LINEAR,
    POISSON,
    RATE_C,
    YIELD,
    YOUNG,
    hardened,
    rate_factor,
    remaining,
    worn_out,
)

ROOT_TWO_THIRDS = math.sqrt(2.0 / 3.0)
TOLERANCE = 1e-13  # of the first yield stress
CONCAVE = 1e-12  # the same of hardening that is no straight line


@njit(cache=True, inline="always")
def relative_norm_squared(plus, minus, shear):
    """xi^T P xi [Pa^2] from (xx + yy)/sqrt2, (yy - xx)/sqrt2 and xy: 2/3 of the squared equivalent stress."""
    return plus * plus / 3.0 + minus * minus + 2.0 * shear * shear


@njit(cache=True, inline="always")
def slopes(row):
    """Growth [Pa] of the return's divisors with the multiplier: of the sum, and of the difference and the shear."""
    young, nu = row[YOUNG], row[POISSON]
    kinematic = 2.0 * row[KINEMATIC] / 3.0
    return young / (3.0 * (1.0 - nu)) + kinematic, young / (1.0 + nu) + kinematic


@njit(cache=True)
def overstress(multiplier, trial, eps_p, share, row, dt, bound):
    """Distance of the returned stress from the yield surface [Pa], and its derivative by the multiplier.

    trial: plus, minus and shear of the trial stress; share: of the flow stress that heat and softening leave; bound:
    without the rate, and where hardening is no straight line without it too, whose root is no smaller.
    """
    plus, minus, shear = trial
    slope_plus, slope_rest = slopes(row)
    c1, c2 = 1.0 + multiplier * slope_plus, 1.0 + multiplier * slope_rest
    norm = math.sqrt(relative_norm_squared(plus / c1, minus / c2, shear / c2))
    change = -(plus * plus / (3.0 * c1**3) * slope_plus + (minus**2 + 2.0 * shear**2) / c2**3 * slope_rest) / norm
    growth, growth_change = ROOT_TWO_THIRDS * multiplier * norm, ROOT_TWO_THIRDS * (norm + multiplier * change)
    frozen = bound and row[HARDENING] != LINEAR
    static, slope = hardened(row, eps_p if frozen else eps_p + growth)
    static, slope = share * static, 0.0 if frozen else share * slope
    static_change = slope * growth_change
    factor, factor_change = 1.0, 0.0
    if not bound:
        factor, factor_change = rate_factor(row, growth, growth_change, dt)
    residual = norm - ROOT_TWO_THIRDS * factor * static
    return residual, change - ROOT_TWO_THIRDS * (factor * static_change + factor_change * static)


@njit(cache=True)
def plastic_multiplier(trial, eps_p, share, row, dt):
    """Multiplier [1/Pa] at which the returned stress lies on the yield surface; Newton from the elastic trial.

    Rate factors and curved hardening can have infinite slopes at rest: the answer without them bounds the iteration,
    which bisects where Newton leaves the bounds.
    """
    multiplier = 0.0
    for _ in range(50):
        residual, slope = overstress(multiplier, trial, eps_p, share, row, dt, True)
        if abs(residual) < TOLERANCE * row[YIELD]:
            break
        multiplier -= residual / slope
    straight = row[HARDENING] == LINEAR
    if straight and row[RATE_C] <= 0.0:
        return multiplier
    accuracy = (TOLERANCE if straight else CONCAVE) * row[YIELD]
    low, high = 0.0, multiplier
    for _ in range(200):
        residual, slope = overstress(multiplier, trial, eps_p, share, row, dt, False)
        if abs(residual) < accuracy:
            break
        if residual > 0.0:
            low = multiplier
        else:
            high = multiplier
        multiplier -= residual / slope
        if not low < multiplier < high:
            multiplier = 0.5 * (low + high)
    return multiplier


@njit(cache=True, inline="always")
def within_yield(xi_x, xi_y, shear, flow):
    """Whether a relative stress xx yy xy [Pa] lies within the yield surface of a flow stress [Pa]."""
    root = math.sqrt(0.5)
    radius = ROOT_TWO_THIRDS * flow
    return relative_norm_squared(root * (xi_x + xi_y), root * (xi_y - xi_x), shear) <= radius * radius


@njit(cache=True)
def return_to_yield(stress, back, memory, row, size, dt):
    """Radial return of a trial stress, and the layer's ageing; whether it has failed.

    stress, back: (3,) xx yy xy [Pa], memory: (MEMORY,), all in place; size [m]: of the element; dt: the step [s].
    The relative stress xi = stress - back obeys xi^T P xi <= 2/3 flow^2.
    """
    xi_x, xi_y, shear = stress[0] - back[0], stress[1] - back[1], stress[2] - back[2]
    if within_yield(xi_x, xi_y, shear, memory[FLOW]):
        return False
    root = math.sqrt(0.5)
    plus, minus = root * (xi_x + xi_y), root * (xi_y - xi_x)
    share = remaining(row, memory, size)
    multiplier = plastic_multiplier((plus, minus, shear), memory[EPS_P], share, row, dt)
    slope_plus, slope_rest = slopes(row)
    plus /= 1.0 + multiplier * slope_plus
    minus /= 1.0 + multiplier * slope_rest
    shear /= 1.0 + multiplier * slope_rest
    xi_x, xi_y = root * (plus - minus), root * (plus + minus)
    kinematic = 2.0 / 3.0 * row[KINEMATIC]
    back[0] += multiplier * kinematic * xi_x
    back[1] += multiplier * kinematic * xi_y
    back[2] += multiplier * kinematic * shear
    stress[0], stress[1], stress[2] = back[0] + xi_x, back[1] + xi_y, back[2] + shear
    norm = math.sqrt(relative_norm_squared(plus, minus, shear))
    growth = ROOT_TWO_THIRDS * multiplier * norm
    memory[EPS_P] += growth
    memory[HEAT] += row[HEATING] * norm / ROOT_TWO_THIRDS * growth
    failed = worn_out(row, stress, memory, growth, size, dt)
    memory[FLOW] = remaining(row, memory, size) * hardened(row, memory[EPS_P])[0]
    return failed
