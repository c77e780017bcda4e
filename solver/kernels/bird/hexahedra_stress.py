"""Stress in the one-point hexahedra: pressure, strength, viscosity, shock viscosity; each with its own work.

Stress is -(p + q) I + s + 2 MU dev D. The work of a step [J] is trapezoidal in the stress, with the rate at its middle:
the energy balance then closes to second order. An element that goes in this step (erodes) ends it without stress.
Tensors (6,): xx, yy, zz, xy, yz, zx; rate (9,): dv_i/dx_j by rows [1/s].
"""

from __future__ import annotations

import math

from numba import njit, prange

from birdstrike.solver.kernels.bird.eos import eos_close, law
from birdstrike.solver.kernels.bird.strength import update_deviator


@njit(cache=True, inline="always")
def stretching(rate):
    """D, the symmetric part of the velocity gradient."""
    return (
        rate[0],
        rate[4],
        rate[8],
        0.5 * (rate[1] + rate[3]),
        0.5 * (rate[5] + rate[7]),
        0.5 * (rate[2] + rate[6]),
    )


@njit(cache=True, inline="always")
def squared_size(gradient):
    """B_iI B_iI [m^4]; 3/2 h^4 for a cube of edge h."""
    total = 0.0
    for i in range(3):
        for corner in range(8):
            total += gradient[i, corner] * gradient[i, corner]
    return total


@njit(cache=True, parallel=True)
def stable_steps(alive, volume, gradient, rate, mass, c, stiffness, viscosity, shock, step):
    """Largest stable step of each element [s], of leapfrog with damping by the velocities of half a step before.

    omega^2 = 8 (rho c^2 + stiffness) |B|^2/(rho V^2) bounds the element's highest frequency with an eighth of its mass
    on each node (Flanagan & Belytschko, eq. 60), lambda = 8 (2 nu + nu_q) |B|^2/V^2 its damping rate by MU and by the
    shock viscosity; dt = 4/(lambda + sqrt(lambda^2 + 4 omega^2)). Stiffness [Pa]: 4/3 G. Bound of the whole mesh, too.
    """
    for e in prange(alive.shape[0]):
        if not alive[e]:
            continue
        if not volume[e] > 0.0:
            step[e] = 0.0
            continue
        size = squared_size(gradient[e])
        spread = 8.0 * size / (volume[e] * volume[e])
        length = volume[e] * math.sqrt(1.5 / size)
        rho = mass[e] / volume[e]
        squeeze = max(-(rate[e, 0] + rate[e, 4] + rate[e, 8]), 0.0)
        nu = 2.0 * viscosity / rho + length * (shock[0] * c[e] + shock[1] * length * squeeze)
        squared = spread * (c[e] * c[e] + stiffness / rho)
        damping = spread * nu
        step[e] = 4.0 / (damping + math.sqrt(damping * damping + 4.0 * squared))


@njit(cache=True, parallel=True)
def find_eroded(volume, volume0, eps_p, step, limits, alive, going):
    """Elements that go now: `going` set, `alive` cleared.

    limits: (4,) largest and smallest V/V0 (inf, 0: off), largest plastic strain (inf), smallest stable step [s].
    """
    for e in prange(alive.shape[0]):
        going[e] = False
        if not alive[e]:
            continue
        ratio = volume[e] / volume0[e]
        beyond = ratio > limits[0] or ratio < limits[1] or eps_p[e] > limits[2] or step[e] < limits[3]
        if beyond:
            alive[e], going[e] = False, True


def update_pressure(alive, going, eos, floor, mass, volume, volume0, heat, rho, p, energy, c, work):
    """Pressure p >= floor [Pa] from the exact volume; in and out: rho, p, energy per reference volume [J/m^3], c.

    eos: constants of the law, see `kernels.bird.eos`;
    heat: dissipated in the step before, per reference volume [J/m^3]; work: -p dV [J].
    """
    for e in prange(alive.shape[0]):
        work[e] = 0.0
        if not (alive[e] or going[e]):
            continue
        before, p_before = rho[e], p[e]
        p[e] = 0.0
        if alive[e]:
            rho[e] = mass[e] / volume[e]
            cold, cold_slope, factor, factor_slope = law(rho[e] / eos[0] - 1.0, eos)
            warm = energy[e] + heat[e]
            pressure, _, c[e] = eos_close(
                rho[e], before, p_before, warm, eos[0], cold, cold_slope, factor, factor_slope
            )
            p[e] = max(pressure, floor)
        work[e] = 0.5 * (p_before + p[e]) * (mass[e] / before - volume[e])
        energy[e] += heat[e] + work[e] / volume0[e]


@njit(cache=True, parallel=True)
def update_strength(alive, going, dt, rate, strength, volume_before, volume, s, back, eps_p, work):
    """Deviator s and back stress (e, 6) [Pa] by their objective rate and the yield surface; work [J]."""
    for e in prange(alive.shape[0]):
        work[e] = 0.0
        if not (alive[e] or going[e]):
            continue
        r = rate[e]
        d = stretching(r)
        power = volume_before[e] * double_dot(s[e], d)
        if alive[e]:
            spin = (0.5 * (r[7] - r[5]), 0.5 * (r[2] - r[6]), 0.5 * (r[3] - r[1]))
            eps_p[e] = update_deviator(s[e], back[e], eps_p[e], d, spin[0], spin[1], spin[2], dt, strength)
        else:
            for i in range(6):
                s[e, i] = 0.0
        work[e] = 0.5 * dt * (power + volume[e] * double_dot(s[e], d))


@njit(cache=True, inline="always")
def double_dot(a, d):
    """a : d of two symmetric tensors."""
    return a[0] * d[0] + a[1] * d[1] + a[2] * d[2] + 2.0 * (a[3] * d[3] + a[4] * d[4] + a[5] * d[5])


@njit(cache=True, parallel=True)
def update_viscosity(alive, going, dt, rate, mu, shock, c, rho, volume_before, volume, gradient, tau, q, work):
    """Viscous stress 2 MU dev D, tau (e, 6) [Pa], and shock pressure q (e,) [Pa].

    q = rho l |tr D| (shock[0] c + shock[1] l |tr D|) in compression only (J. von Neumann & R. D. Richtmyer, J. Appl.
    Phys. 21 (1950) 232, with Landshoff's linear term); l = sqrt(3/2) V/|B|, the edge of a cube and up to sqrt(3) times
    the short edge of a slab. work: (e, 3) of MU, of q [J], and what a unit of MU would dissipate [J/(Pa s)].
    """
    for e in prange(alive.shape[0]):
        work[e, 0] = work[e, 1] = work[e, 2] = 0.0
        if not (alive[e] or going[e]):
            continue
        d = stretching(rate[e])
        trace = d[0] + d[1] + d[2]
        viscous = volume_before[e] * double_dot(tau[e], d)
        shocked = volume_before[e] * q[e]
        q[e] = 0.0
        for i in range(6):
            tau[e, i] = 2.0 * mu * (d[i] - (trace / 3.0 if i < 3 else 0.0)) if alive[e] else 0.0
        if alive[e] and trace < 0.0:
            length = volume[e] * math.sqrt(1.5 / squared_size(gradient[e]))
            q[e] = rho[e] * length * -trace * (shock[0] * c[e] - shock[1] * length * trace)
        work[e, 0] = 0.5 * dt * (viscous + volume[e] * double_dot(tau[e], d))
        work[e, 1] = -0.5 * dt * (shocked + volume[e] * q[e]) * trace
        work[e, 2] = 2.0 * dt * volume[e] * (double_dot(d, d) - trace * trace / 3.0)


@njit(cache=True, parallel=True)
def total_stress(alive, p, q, s, tau, stress):
    """-(p + q) I + s + tau, (e, 6) [Pa]."""
    for e in prange(alive.shape[0]):
        for i in range(6):
            stress[e, i] = s[e, i] + tau[e, i] - (p[e] + q[e] if i < 3 else 0.0)
