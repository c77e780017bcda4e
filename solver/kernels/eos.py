"""Equation of state of the bird: Grueneisen pressure [Pa] and sound speed [m/s] from compression and energy.

mu = rho/rho0 - 1; E is the internal energy per unit reference volume [J/m^3]. The form is that of LS-DYNA's
*EOS_GRUNEISEN as coded in OpenRadioss (gruneisen.F). With gamma0 = a = S2 = S3 = 0 the compression branch is the
Hugoniot p = rho0 (C + S1 u) u exactly.
"""

from __future__ import annotations

import math

from numba import njit


@njit(cache=True, inline="always")
def grueneisen_terms(mu, constants):
    """Cold pressure A [Pa], its slope dA/dmu [Pa] and the Grueneisen factor B of p = A + B E.

    constants: (7,) rho0 [kg/m^3], C [m/s], S1, S2, S3, gamma0, a.
    """
    stiffness = constants[0] * constants[1] * constants[1]
    s1, s2, s3, gamma0, a = constants[2], constants[3], constants[4], constants[5], constants[6]
    factor = gamma0 + a * mu
    if mu <= 0.0:
        return stiffness * mu, stiffness, factor
    v = mu / (1.0 + mu)
    top = mu * (1.0 + (1.0 - 0.5 * gamma0) * mu - 0.5 * a * mu * mu)
    top_slope = 1.0 + 2.0 * (1.0 - 0.5 * gamma0) * mu - 1.5 * a * mu * mu
    bottom = 1.0 - (s1 - 1.0) * mu - s2 * mu * v - s3 * mu * v * v
    bottom_slope = -(s1 - 1.0) - s2 * v * (2.0 - v) - s3 * v * v * (3.0 - 2.0 * v)
    slope = top_slope / bottom**2 - 2.0 * top * bottom_slope / bottom**3
    return stiffness * top / bottom**2, stiffness * slope, factor


@njit(cache=True, inline="always")
def grueneisen_update(rho, rho_before, p_before, energy, constants):
    """Pressure and energy after a change of density, the p dV work taken by the trapezoidal rule (implicit in p).

    rho, rho_before [kg/m^3]; p_before [Pa]; energy E [J/m^3], heating of the step included. Returns (p, E, c).
    """
    rho0 = constants[0]
    cold, cold_slope, factor = grueneisen_terms(rho / rho0 - 1.0, constants)
    half_change = 0.5 * (rho0 / rho_before - rho0 / rho)
    p = (cold + factor * (energy + half_change * p_before)) / (1.0 - factor * half_change)
    energy_after = energy + half_change * (p_before + p)
    mu = rho / rho0 - 1.0
    slope = cold_slope + constants[6] * energy_after + factor * p / (1.0 + mu) ** 2
    c = math.sqrt(max(slope, 0.0) / rho0)
    return p, energy_after, c
