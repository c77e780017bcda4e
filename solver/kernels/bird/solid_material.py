"""Elastic-plastic bird particles: density, deviator, pressure with its floor, erosion at the failure strain."""

from __future__ import annotations

from numba import prange

from birdstrike.solver.kernels.bird.eos import eos_close, law
from birdstrike.solver.kernels.bird.strength import contraction, update_deviator


def update_solid_material(
    n, dt, eos, limits, strength, rates, drho_dt, heating, rho, p, energy, c, stress, back, eps_p, active, eroded, work
):
    """New density by continuity, deviator by the Jaumann rate and radial return, pressure p >= its floor, erosion.

    eos: the law's constants; limits: (2,) pressure floor [Pa] and plastic strain at erosion; strength: (6,) see
    `update_deviator`; rates: (N, 9) D xx yy zz xy yz zx and spin x y z [1/s]; drho_dt: (N,); heating: (N,) viscous
    power per reference volume [W/m^3]; in and out: rho, p, energy [J/m^3], stress and back (N, 6) [Pa], eps_p, active
    (and drho_dt of what erodes); out: c [m/s], eroded, work (N, 2): p dV and s:D dt per reference volume [J/m^3].

    Both works are trapezoidal in the stresses that acted; a particle that erodes carries nothing at the step's end.
    """
    for a in prange(n):
        eroded[a] = False
        work[a, 0] = work[a, 1] = 0.0
        if not active[a]:
            continue
        before, p_before = rho[a], p[a]
        after = before + dt * drho_dt[a]
        rho[a] = after
        if not after > 0.0:
            continue
        power = contraction(stress[a], rates[a]) * eos[0] / before
        eps_p[a] = update_deviator(
            stress[a], back[a], eps_p[a], rates[a], rates[a, 6], rates[a, 7], rates[a, 8], dt, strength
        )
        fails = eps_p[a] > limits[1]
        if fails:
            active[a] = False
            eroded[a] = True
            stress[a, :] = 0.0
            drho_dt[a] = 0.0
        power += contraction(stress[a], rates[a]) * eos[0] / after
        work[a, 1] = 0.5 * dt * power
        warm = energy[a] + dt * heating[a] + work[a, 1]
        cold, cold_slope, factor, factor_slope = law(after / eos[0] - 1.0, eos)
        pressure, _, c[a] = eos_close(after, before, p_before, warm, eos[0], cold, cold_slope, factor, factor_slope)
        p[a] = 0.0 if fails else max(pressure, limits[0])
        work[a, 0] = 0.5 * (p_before + p[a]) * (eos[0] / before - eos[0] / after)
        energy[a] = warm + work[a, 0]
