"""The NULL material on its equation of state: density, pressure with a floor, erosion; one particle at a time."""

from __future__ import annotations

from numba import prange

from birdstrike.solver.kernels.bird.eos import eos_close, law


def update_null_material(n, dt, eos, limits, drho_dt, heating, rho, p, energy, c, active, eroded_now, work):
    """New density by continuity, pressure p >= PC, and the erosion test on the volume after the step.

    eos: the law's constants; limits: (3,) pressure cutoff [Pa], largest and smallest V/V0 (inf, 0 = off);
    drho_dt: (n,) [kg/m^3/s]; heating: (n,) viscous power per reference volume [W/m^3];
    in and out: rho, p, energy [J/m^3], active (and drho_dt of what erodes);
    out: c [m/s], eroded_now, work = p dV per reference volume [J/m^3].

    The work is that of the pressure that acted: after the floor, and none at the end of the step in which a particle
    erodes, because its neighbours no longer feel it.
    """
    for a in prange(n):
        eroded_now[a] = False
        work[a] = 0.0
        if not active[a]:
            continue
        before, p_before = rho[a], p[a]
        after = before + dt * drho_dt[a]
        rho[a] = after
        if not after > 0.0:
            continue
        warm = energy[a] + dt * heating[a]
        cold, cold_slope, factor, factor_slope = law(after / eos[0] - 1.0, eos)
        pressure, _, c[a] = eos_close(after, before, p_before, warm, eos[0], cold, cold_slope, factor, factor_slope)
        volume = eos[0] / after
        if volume > limits[1] or volume < limits[2]:
            active[a] = False
            eroded_now[a] = True
            pressure = 0.0
            drho_dt[a] = 0.0  # it deforms no more: no viscous power in the step's end either
        p[a] = max(pressure, limits[0])
        work[a] = 0.5 * (p_before + p[a]) * (eos[0] / before - volume)
        energy[a] = warm + work[a]
