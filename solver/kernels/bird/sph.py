"""Smoothed particle hydrodynamics of the bird: pair forces of pressure and viscosity.

Every sum gathers over one particle's own list in a fixed order, so the result does not depend on the threads. Pair
forces are antisymmetric: linear momentum is conserved to rounding. Those of pressure and shock viscosity are central
and conserve angular momentum as well; those of the viscous stress do so as far as its pairs see the same stress. Equal
particle masses.

Particles carry one packed row each, so that a neighbour costs two cache lines:
    0-2 position [m], 3-5 velocity [m/s], 6 (p + q)/rho^2 [m^5/(kg s^2)], 7 1/rho [m^3/kg],
    8 sound speed times shock share [m/s],
    9-14 rate of deformation xx yy zz xy yz zx [1/s], 15 a third of its trace [1/s].
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit, prange
from numba.np.ufunc import get_thread_id

from birdstrike.solver.kernels.bird.columns import WIDTH, turn_rows
from birdstrike.solver.kernels.bird.smoothing import slope
from birdstrike.solver.kernels.bird.velocity_gradient import PAIR_MATH

TINY = 1e-200  # against 0/0
RATE = 9  # first of the columns that hold the rate of deformation


@njit(cache=True, inline="always")
def shock_share(d):
    """0 in shear and expansion .. 1 in a plane compression: 5/3 div^2/(div^2 + D':D'), at most 1, for div < 0.

    The squared form of Balsara's switch (J. Comput. Phys. 121 (1995) 357), with the deviator instead of the curl,
    because stagnation flow is curl-free; d: (6,) rate of deformation.
    """
    divergence = d[0] + d[1] + d[2]
    if divergence >= 0.0:
        return 0.0
    squared = divergence * divergence
    full = d[0] ** 2 + d[1] ** 2 + d[2] ** 2 + 2.0 * (d[3] ** 2 + d[4] ** 2 + d[5] ** 2)
    return min(1.0, 5.0 / 3.0 * squared / (full + 2.0 / 3.0 * squared))


@njit(cache=True, parallel=True)
def pack_state(n, x, v, push, last, last_but_one, rho, p, c, dt, row):
    """State at the whole step; the rate of deformation lies in the rows already.

    Velocities are predicted by half a kick of the mean of the last two accelerations (n, 3): see `stable_step`; push:
    (n, 3) [m/s], half the kick of outer forces.
    """
    for a in prange(n):
        for i in range(3):
            row[a, i] = x[a, i]
            row[a, 3 + i] = v[a, i] + push[a, i] + 0.25 * dt * (last[a, i] + last_but_one[a, i])
        row[a, 6] = p[a] / (rho[a] * rho[a])
        row[a, 7] = 1.0 / rho[a]
        row[a, 8] = c[a] * shock_share(row[a, RATE:])
        row[a, 15] = (row[a, RATE] + row[a, RATE + 1] + row[a, RATE + 2]) / 3.0


@njit(cache=True, parallel=True, fastmath=PAIR_MATH)
def pair_forces(
    n, row, mass, h, constant, viscosity, shock, start, stop, neighbour, columns, acceleration, dissipation
):
    """Accelerations from pressure, Newtonian viscosity and shock viscosity; dissipated power per particle.

    viscosity: MU [Pa s]; shock: (2,) linear and quadratic coefficients; out: acceleration (N, 3) [m/s^2],
    dissipation (N, 2): power of a unit shear viscosity (times MU: the viscous power) and of the shock viscosity [W].

    Stress: sum m (sigma_a/rho_a^2 + sigma_b/rho_b^2).grad W with sigma = -p I + 2 MU dev D, as the weak form has it,
    so that a free surface carries no traction. (A central pair viscosity was tried: in the reference strike the
    bird's momentum arrives up to 5 % early with it, against OpenRadioss, which has the stress as well.)
    Shock viscosity: Monaghan's form on velocities reconstructed linearly to the pair's midpoint under a van Leer
    limiter (Frontiere, Raskin & Owen, J. Comput. Phys. 332 (2017) 160): it vanishes where the flow is linear, so
    that shear is not damped and MU keeps its meaning. The linear coefficient carries the pair's mean shock share.
    The rows may list particles beyond the support: there the slope is zero. columns: (threads, ROW, length) scratch.
    """
    inverse_h = 1.0 / h
    core = 1e-4 * h * h  # keeps the shock viscosity finite should two particles meet
    linear, quadratic = 0.25 * shock[0], 0.5 * shock[1]
    for a in prange(n):
        xa, ya, za = row[a, 0], row[a, 1], row[a, 2]
        ua, va, wa = row[a, 3], row[a, 4], row[a, 5]
        pa, inv_rho_a, sa = row[a, 6], row[a, 7], row[a, 8]
        dxx, dyy, dzz, dxy, dyz, dzx = row[a, 9], row[a, 10], row[a, 11], row[a, 12], row[a, 13], row[a, 14]
        ka, ta = 2.0 * inv_rho_a * inv_rho_a, row[a, 15]
        ax = ay = az = 0.0
        unit_power = shock_power = 0.0
        column = columns[get_thread_id()]
        for m in range(start[a], stop[a], WIDTH):
            turn_rows(row, neighbour, m, column, m - start[a], 16)
        for m in range(np.uint64(stop[a] - start[a])):
            x, y, z = xa - column[0, m], ya - column[1, m], za - column[2, m]
            r2 = x * x + y * y + z * z
            f = slope(math.sqrt(r2) * inverse_h, constant)
            u, v, w = ua - column[3, m], va - column[4, m], wa - column[5, m]
            approach = u * x + v * y + w * z
            # D r of both particles: their strain along the pair, and their viscous traction
            ex, ey, ez = dxx * x + dxy * y + dzx * z, dxy * x + dyy * y + dyz * z, dzx * x + dyz * y + dzz * z
            gx = column[9, m] * x + column[12, m] * y + column[14, m] * z
            gy = column[12, m] * x + column[10, m] * y + column[13, m] * z
            gz = column[14, m] * x + column[13, m] * y + column[11, m] * z
            strain_a, strain_b = min(x * ex + y * ey + z * ez, 0.0), min(x * gx + y * gy + z * gz, 0.0)
            kb = 2.0 * column[7, m] * column[7, m]
            mean = ka * ta + kb * column[15, m]
            sx, sy, sz = ka * ex + kb * gx - mean * x, ka * ey + kb * gy - mean * y, ka * ez + kb * gz - mean * z
            # van Leer's 4r/(1+r)^2 times the mean strain is their harmonic mean: jump = h/r^2 (approach - 2ab/(a + b)),
            # with one division, which costs as much as all the rest
            both = strain_a + strain_b - TINY
            jump = min((approach * both - 2.0 * strain_a * strain_b) * h / (both * (r2 + core)), 0.0)
            jump = jump if approach < 0.0 else 0.0
            shock_push = (quadratic * jump - linear * (sa + column[8, m])) * jump * (inv_rho_a + column[7, m])
            unit_power -= (sx * u + sy * v + sz * w) * f
            shock_power += shock_push * approach * f
            push = pa + column[6, m] + shock_push
            ax += f * (viscosity * sx - push * x)
            ay += f * (viscosity * sy - push * y)
            az += f * (viscosity * sz - push * z)
        acceleration[a, 0] = mass * ax
        acceleration[a, 1] = mass * ay
        acceleration[a, 2] = mass * az
        dissipation[a, 0] = 0.5 * mass * mass * unit_power
        dissipation[a, 1] = 0.5 * mass * mass * shock_power
