"""Plane-stress J2 plasticity with combined isotropic and kinematic hardening: elastic law and radial return.

J. C. Simo & T. J. R. Hughes, Computational Inelasticity (1998), section 3.4: the yield function is diagonal in the
sum, the difference and the shear of the relative stress, which leaves one scalar equation for the multiplier.
"""

from __future__ import annotations

import math

from numba import njit

ROOT_TWO_THIRDS = math.sqrt(2.0 / 3.0)


@njit(cache=True, inline="always")
def relative_norm_squared(plus, minus, shear):
    """xi^T P xi [Pa^2] from (xx + yy)/sqrt2, (yy - xx)/sqrt2 and xy: 2/3 of the squared equivalent stress."""
    return plus * plus / 3.0 + minus * minus + 2.0 * shear * shear


@njit(cache=True)
def plastic_multiplier(plus, minus, shear, eps_p, elastic, hardening):
    """Multiplier [1/Pa] at which the returned stress lies on the yield surface; Newton from the elastic trial.

    elastic: E [Pa], nu; hardening: yield stress [Pa], isotropic and kinematic modulus [Pa].
    """
    young, nu = elastic
    sigma_y, isotropic, kinematic = hardening
    slope_plus = young / (3.0 * (1.0 - nu)) + 2.0 * kinematic / 3.0
    slope_rest = young / (1.0 + nu) + 2.0 * kinematic / 3.0
    multiplier = 0.0
    for _ in range(50):
        c1 = 1.0 + multiplier * slope_plus
        c2 = 1.0 + multiplier * slope_rest
        squared = relative_norm_squared(plus / c1, minus / c2, shear / c2)
        norm = math.sqrt(squared)
        radius = ROOT_TWO_THIRDS * (sigma_y + isotropic * (eps_p + ROOT_TWO_THIRDS * multiplier * norm))
        residual = norm - radius
        if abs(residual) < 1e-13 * sigma_y:
            break
        change = -(plus * plus / (3.0 * c1**3) * slope_plus + (minus**2 + 2.0 * shear**2) / c2**3 * slope_rest) / norm
        radius_change = 2.0 / 3.0 * isotropic * (norm + multiplier * change)
        multiplier -= residual / (change - radius_change)
    return multiplier


@njit(cache=True)
def return_to_yield(stress, back, eps_p, elastic, hardening):
    """Radial return of a trial stress. stress, back: (3,) xx yy xy [Pa], in place; returns the new eps_p.

    The relative stress xi = stress - back obeys xi^T P xi <= 2/3 (sigma_y + K eps_p)^2.
    """
    root = math.sqrt(0.5)
    xi_x, xi_y, shear = stress[0] - back[0], stress[1] - back[1], stress[2] - back[2]
    plus, minus = root * (xi_x + xi_y), root * (xi_y - xi_x)
    radius = ROOT_TWO_THIRDS * (hardening[0] + hardening[1] * eps_p)
    if relative_norm_squared(plus, minus, shear) <= radius * radius:
        return eps_p
    multiplier = plastic_multiplier(plus, minus, shear, eps_p, elastic, hardening)
    kinematic = 2.0 / 3.0 * hardening[2]
    plus /= 1.0 + multiplier * (elastic[0] / (3.0 * (1.0 - elastic[1])) + kinematic)
    minus /= 1.0 + multiplier * (elastic[0] / (1.0 + elastic[1]) + kinematic)
    shear /= 1.0 + multiplier * (elastic[0] / (1.0 + elastic[1]) + kinematic)
    xi_x, xi_y = root * (plus - minus), root * (plus + minus)
    back[0] += multiplier * kinematic * xi_x
    back[1] += multiplier * kinematic * xi_y
    back[2] += multiplier * kinematic * shear
    stress[0], stress[1], stress[2] = back[0] + xi_x, back[1] + xi_y, back[2] + shear
    return eps_p + ROOT_TWO_THIRDS * multiplier * math.sqrt(relative_norm_squared(plus, minus, shear))
