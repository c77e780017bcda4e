"""Pressure [Pa] and sound speed [m/s] from density and energy, p = A(mu) + B(mu) E, whatever the law.

mu = rho/rho0 - 1; E is the internal energy per unit reference volume [J/m^3]. A law is a compiled function
(mu, constants) -> A [Pa], dA/dmu [Pa], B, dB/dmu, and a flat array of constants, the first being rho0 [kg/m^3]. A loop
over particles or elements is written about the stand-in `law`, and `bird.eos.compiled` compiles it about a law, without
a choice inside the loop.
"""

from __future__ import annotations

import math

from numba import njit


def law(mu, eos) -> tuple[float, float, float, float]:
    """A, dA/dmu, B and dB/dmu of the law that takes this one's place when a loop is compiled."""
    raise NotImplementedError


@njit(cache=True, inline="always")
def eos_close(rho, rho_before, p_before, energy, rho0, cold, cold_slope, factor, factor_slope):
    """Pressure and energy after a change of density, the p dV work taken by the trapezoidal rule (implicit in p).

    rho, rho_before [kg/m^3], both positive; p_before [Pa]; energy E [J/m^3], the step's heating included; the rest:
    the law's terms at rho. Returns (p [Pa], E [J/m^3], c [m/s]); c of the isentrope, dE = p dmu/(1 + mu)^2, and 0
    where it is unstable.
    """
    stretch = rho / rho0
    half_change = 0.5 * (rho0 / rho_before - rho0 / rho)
    p = (cold + factor * (energy + half_change * p_before)) / (1.0 - factor * half_change)
    energy_after = energy + half_change * (p_before + p)
    slope = cold_slope + factor_slope * energy_after + factor * p / (stretch * stretch)
    return p, energy_after, math.sqrt(max(slope, 0.0) / rho0)
