"""Equations of state of the bird: pressure [Pa] and sound speed [m/s] from density and energy, p = A(mu) + B(mu) E.

mu = rho/rho0 - 1; E is the internal energy per unit reference volume [J/m^3]. Every law is one flat array:
    0 kind, 1 rho0 [kg/m^3], 2.. its constants
    GRUNEISEN          C [m/s], S1, S2, S3, gamma0, a
    LINEAR_POLYNOMIAL  C0 .. C3 [Pa], C4 .. C6
    MURNAGHAN          p0, B [Pa], g
    LOGARITHMIC        K [Pa]
    TABLE              number of knots, then (mu, p, dp/dmu) of each
so that a particle and a finite element call the same function whatever the law.
"""

from __future__ import annotations

import math

from numba import njit

GRUNEISEN, LINEAR_POLYNOMIAL, MURNAGHAN, LOGARITHMIC, TABLE = 0, 1, 2, 3, 4
KNOTS = 3  # where a table's knots begin


@njit(cache=True, inline="always")
def grueneisen_terms(mu, eos):
    """Cold pressure A [Pa], its slope dA/dmu [Pa], the Grueneisen factor B and its slope.

    The form is that of LS-DYNA's *EOS_GRUNEISEN as coded in OpenRadioss (gruneisen.F). With gamma0 = a = S2 = S3 = 0
    the compression branch is the Hugoniot p = rho0 (C + S1 u) u exactly.
    """
    stiffness = eos[1] * eos[2] * eos[2]
    s1, s2, s3, gamma0, a = eos[3], eos[4], eos[5], eos[6], eos[7]
    factor = gamma0 + a * mu
    if mu <= 0.0:
        return stiffness * mu, stiffness, factor, a
    v = mu / (1.0 + mu)
    top = mu * (1.0 + (1.0 - 0.5 * gamma0) * mu - 0.5 * a * mu * mu)
    top_slope = 1.0 + 2.0 * (1.0 - 0.5 * gamma0) * mu - 1.5 * a * mu * mu
    bottom = 1.0 - (s1 - 1.0) * mu - s2 * mu * v - s3 * mu * v * v
    bottom_slope = -(s1 - 1.0) - s2 * v * (2.0 - v) - s3 * v * v * (3.0 - 2.0 * v)
    slope = top_slope / bottom**2 - 2.0 * top * bottom_slope / bottom**3
    return stiffness * top / bottom**2, stiffness * slope, factor, a


@njit(cache=True)
def polynomial_terms(mu, eos):
    """A = C0 + C1 mu + C2 mu^2 + C3 mu^3, B = C4 + C5 mu + C6 mu^2 and their slopes.

    In expansion the C2 and C6 terms drop and C3 stays (OpenRadioss eospolyno.F; LS-DYNA's *EOS_LINEAR_POLYNOMIAL).
    """
    c2, c6 = (eos[4], eos[8]) if mu > 0.0 else (0.0, 0.0)
    cold = eos[2] + mu * (eos[3] + mu * (c2 + mu * eos[5]))
    slope = eos[3] + mu * (2.0 * c2 + 3.0 * mu * eos[5])
    return cold, slope, eos[6] + mu * (eos[7] + mu * c6), eos[7] + 2.0 * mu * c6


@njit(cache=True)
def table_terms(mu, eos):
    """Cubic Hermite interpolation between a table's knots, the end slopes beyond them; no energy term."""
    low, high = 0, int(eos[2]) - 1
    if mu <= eos[KNOTS]:
        return eos[KNOTS + 1] + (mu - eos[KNOTS]) * eos[KNOTS + 2], eos[KNOTS + 2], 0.0, 0.0
    last = KNOTS + 3 * high
    if mu >= eos[last]:
        return eos[last + 1] + (mu - eos[last]) * eos[last + 2], eos[last + 2], 0.0, 0.0
    while high - low > 1:
        middle = (low + high) // 2
        if eos[KNOTS + 3 * middle] <= mu:
            low = middle
        else:
            high = middle
    i = KNOTS + 3 * low
    width = eos[i + 3] - eos[i]
    t = (mu - eos[i]) / width
    rise = eos[i + 4] - eos[i + 1]
    bend, twist = 3.0 * rise - width * (2.0 * eos[i + 2] + eos[i + 5]), width * (eos[i + 2] + eos[i + 5]) - 2.0 * rise
    p = eos[i + 1] + t * (width * eos[i + 2] + t * (bend + t * twist))
    return p, eos[i + 2] + t * (2.0 * bend + 3.0 * t * twist) / width, 0.0, 0.0


@njit(cache=True)
def eos_terms(mu, eos):
    """A [Pa], dA/dmu [Pa], B and dB/dmu of p = A + B E, by the law's kind.

    Murnaghan: p0 + B[(1 + mu)^g - 1] (Proc. Natl. Acad. Sci. 30 (1944) 244). Logarithmic: K ln(1 + mu), the integral
    of the hypoelastic rate p' = -K tr D, so that it does not depend on the path.
    """
    kind = int(eos[0])
    if kind == GRUNEISEN:
        return grueneisen_terms(mu, eos)
    if kind == LINEAR_POLYNOMIAL:
        return polynomial_terms(mu, eos)
    if kind == MURNAGHAN:
        power = eos[3] * (1.0 + mu) ** eos[4]
        return eos[2] + power - eos[3], eos[4] * power / (1.0 + mu), 0.0, 0.0
    if kind == LOGARITHMIC:
        return eos[2] * math.log(1.0 + mu), eos[2] / (1.0 + mu), 0.0, 0.0
    return table_terms(mu, eos)


@njit(cache=True, inline="always")
def eos_close(rho, rho_before, p_before, energy, rho0, cold, cold_slope, factor, factor_slope):
    """Pressure [Pa], energy [J/m^3] and sound speed [m/s] from the terms of p = A + B E: see `eos_update`."""
    stretch = rho / rho0
    half_change = 0.5 * (rho0 / rho_before - rho0 / rho)
    p = (cold + factor * (energy + half_change * p_before)) / (1.0 - factor * half_change)
    energy_after = energy + half_change * (p_before + p)
    slope = cold_slope + factor_slope * energy_after + factor * p / (stretch * stretch)
    return p, energy_after, math.sqrt(max(slope, 0.0) / rho0)


@njit(cache=True)
def eos_update(rho, rho_before, p_before, energy, eos):
    """Pressure and energy after a change of density, the p dV work taken by the trapezoidal rule (implicit in p).

    rho, rho_before [kg/m^3], both positive; p_before [Pa]; energy E [J/m^3], the step's heating included.
    Returns (p [Pa], E [J/m^3], c [m/s]); c of the isentrope, dE = p dmu/(1 + mu)^2, and 0 where it is unstable.
    """
    cold, cold_slope, factor, factor_slope = eos_terms(rho / eos[1] - 1.0, eos)
    return eos_close(rho, rho_before, p_before, energy, eos[1], cold, cold_slope, factor, factor_slope)


@njit(cache=True, inline="always")
def grueneisen_update(rho, rho_before, p_before, energy, eos):
    """`eos_update` of a Grueneisen law, in line: for loops in which the choice of the law would cost."""
    cold, cold_slope, factor, factor_slope = grueneisen_terms(rho / eos[1] - 1.0, eos)
    return eos_close(rho, rho_before, p_before, energy, eos[1], cold, cold_slope, factor, factor_slope)
