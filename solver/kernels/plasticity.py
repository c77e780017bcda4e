"""Plane-stress J2 plasticity with combined isotropic and kinematic hardening: elastic law and radial return.

J. C. Simo & T. J. R. Hughes, Computational Inelasticity (1998), section 3.4: the yield function is diagonal in the
sum, the difference and the shear of the relative stress, which leaves one scalar equation for the multiplier.
Rates by G. R. Cowper & P. S. Symonds (Brown University report 28, 1957): the yield stress, isotropic hardening
included, times 1 + (plastic strain rate/C)^(1/P), with the rate of the very step (backward Euler), not an older one.
"""

from __future__ import annotations

import math

from numba import njit

ROOT_TWO_THIRDS = math.sqrt(2.0 / 3.0)
TOLERANCE = 1e-13  # of the yield stress


@njit(cache=True, inline="always")
def relative_norm_squared(plus, minus, shear):
    """xi^T P xi [Pa^2] from (xx + yy)/sqrt2, (yy - xx)/sqrt2 and xy: 2/3 of the squared equivalent stress."""
    return plus * plus / 3.0 + minus * minus + 2.0 * shear * shear


@njit(cache=True, inline="always")
def slopes(elastic, hardening):
    """Growth [Pa] of the return's divisors with the multiplier: of the sum, and of the difference and the shear."""
    young, nu = elastic
    kinematic = 2.0 * hardening[2] / 3.0
    return young / (3.0 * (1.0 - nu)) + kinematic, young / (1.0 + nu) + kinematic


@njit(cache=True)
def overstress(multiplier, plus, minus, shear, eps_p, elastic, hardening, rate):
    """Distance of the returned stress from the yield surface [Pa], and its derivative by the multiplier.

    rate: C times the step (0: no rate hardening), 1/P.
    """
    slope_plus, slope_rest = slopes(elastic, hardening)
    c1, c2 = 1.0 + multiplier * slope_plus, 1.0 + multiplier * slope_rest
    norm = math.sqrt(relative_norm_squared(plus / c1, minus / c2, shear / c2))
    change = -(plus * plus / (3.0 * c1**3) * slope_plus + (minus**2 + 2.0 * shear**2) / c2**3 * slope_rest) / norm
    growth, growth_change = ROOT_TWO_THIRDS * multiplier * norm, ROOT_TWO_THIRDS * (norm + multiplier * change)
    static = hardening[0] + hardening[1] * (eps_p + growth)
    static_change = hardening[1] * growth_change
    factor, factor_change = 1.0, 0.0
    if rate[0] > 0.0 and growth > 0.0:
        dynamic = (growth / rate[0]) ** rate[1]
        factor, factor_change = 1.0 + dynamic, dynamic * rate[1] * growth_change / growth
    residual = norm - ROOT_TWO_THIRDS * factor * static
    return residual, change - ROOT_TWO_THIRDS * (factor * static_change + factor_change * static)


@njit(cache=True)
def plastic_multiplier(plus, minus, shear, eps_p, elastic, hardening, rate):
    """Multiplier [1/Pa] at which the returned stress lies on the yield surface; Newton from the elastic trial.

    elastic: E [Pa], nu; hardening: yield stress [Pa], isotropic and kinematic modulus [Pa]. With rate hardening, whose
    slope at rest is infinite, the rateless answer bounds the iteration, which bisects where Newton leaves the bounds.
    """
    multiplier = 0.0
    for _ in range(50):
        residual, slope = overstress(multiplier, plus, minus, shear, eps_p, elastic, hardening, (0.0, 1.0))
        if abs(residual) < TOLERANCE * hardening[0]:
            break
        multiplier -= residual / slope
    if rate[0] <= 0.0:
        return multiplier
    low, high = 0.0, multiplier
    for _ in range(200):
        residual, slope = overstress(multiplier, plus, minus, shear, eps_p, elastic, hardening, rate)
        if abs(residual) < TOLERANCE * hardening[0]:
            break
        if residual > 0.0:
            low = multiplier
        else:
            high = multiplier
        multiplier -= residual / slope
        if not low < multiplier < high:
            multiplier = 0.5 * (low + high)
    return multiplier


@njit(cache=True)
def return_to_yield(stress, back, eps_p, elastic, hardening, rate):
    """Radial return of a trial stress. stress, back: (3,) xx yy xy [Pa], in place; returns the new eps_p.

    The relative stress xi = stress - back obeys xi^T P xi <= 2/3 (f (sigma_y + K eps_p))^2 with the factor f of the
    rate; rate: C times the step (0: none), 1/P.
    """
    root = math.sqrt(0.5)
    xi_x, xi_y, shear = stress[0] - back[0], stress[1] - back[1], stress[2] - back[2]
    plus, minus = root * (xi_x + xi_y), root * (xi_y - xi_x)
    radius = ROOT_TWO_THIRDS * (hardening[0] + hardening[1] * eps_p)
    if relative_norm_squared(plus, minus, shear) <= radius * radius:
        return eps_p
    multiplier = plastic_multiplier(plus, minus, shear, eps_p, elastic, hardening, rate)
    slope_plus, slope_rest = slopes(elastic, hardening)
    plus /= 1.0 + multiplier * slope_plus
    minus /= 1.0 + multiplier * slope_rest
    shear /= 1.0 + multiplier * slope_rest
    xi_x, xi_y = root * (plus - minus), root * (plus + minus)
    kinematic = 2.0 / 3.0 * hardening[2]
    back[0] += multiplier * kinematic * xi_x
    back[1] += multiplier * kinematic * xi_y
    back[2] += multiplier * kinematic * shear
    stress[0], stress[1], stress[2] = back[0] + xi_x, back[1] + xi_y, back[2] + shear
    return eps_p + ROOT_TWO_THIRDS * multiplier * math.sqrt(relative_norm_squared(plus, minus, shear))
