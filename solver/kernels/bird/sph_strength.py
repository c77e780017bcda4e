"""Strength of the bird in updated-Lagrangian SPH: divergence of the deviator.

It uses the corrected gradient of `kernels.bird.velocity_gradient`, with its B. The pair force
V_a V_b (s_a B_a + s_b B_b) grad W is then the exact counterpart of the rate: its power is -V s:D to rounding, and its
moment vanishes with the antisymmetric part of s, so that linear and angular momentum are both conserved.

Packed rows: 0-2 position [m], 3-5 velocity [m/s], 6 volume [m^3], 7-15 deviator times B [Pa].
"""

from __future__ import annotations

import math

from numba import njit, prange

from birdstrike.solver.kernels.bird.smoothing import slope


@njit(cache=True, parallel=True)
def pack_stress(n, x, v, push, last, last_but_one, dt, mass, rho, stress, correction, row):
    """State at the whole step; velocities predicted as in `sph.pack_state`."""
    for a in prange(n):
        for i in range(3):
            row[a, i] = x[a, i]
            row[a, 3 + i] = v[a, i] + push[a, i] + 0.25 * dt * (last[a, i] + last_but_one[a, i])
        row[a, 6] = mass / rho[a]
        s, c = stress[a], correction[a]
        row[a, 7] = s[0] * c[0] + s[3] * c[3] + s[5] * c[5]
        row[a, 8] = s[0] * c[3] + s[3] * c[1] + s[5] * c[4]
        row[a, 9] = s[0] * c[5] + s[3] * c[4] + s[5] * c[2]
        row[a, 10] = s[3] * c[0] + s[1] * c[3] + s[4] * c[5]
        row[a, 11] = s[3] * c[3] + s[1] * c[1] + s[4] * c[4]
        row[a, 12] = s[3] * c[5] + s[1] * c[4] + s[4] * c[2]
        row[a, 13] = s[5] * c[0] + s[4] * c[3] + s[2] * c[5]
        row[a, 14] = s[5] * c[3] + s[4] * c[1] + s[2] * c[4]
        row[a, 15] = s[5] * c[5] + s[4] * c[4] + s[2] * c[2]


@njit(cache=True, parallel=True, fastmath={"contract", "reassoc", "nsz"})
def add_stress_forces(n, row, mass, h, constant, repulsion, start, stop, neighbour, acceleration, power):
    """Divergence of the deviator joins the accelerations, and a spring between particles that clump.

    In tension SPH particles attract each other in pairs (J. W. Swegle, D. L. Hicks & S. W. Attaway, J. Comput. Phys.
    116 (1995) 123). Monaghan's artificial stress, proportional to the tension, takes no account of what it stores: it
    gave this bird a third of the impact's energy. A spring that acts below a distance alone gives back what it took.
    repulsion: (2,) stiffness [N/m] and that distance [m]; out: acceleration (N, 3) [m/s^2], added to; power (N,):
    taken by the springs [W].
    """
    inverse_h = 1.0 / h
    stiffness, shortest = repulsion[0], repulsion[1]
    for a in prange(n):
        ax = ay = az = taken = 0.0
        for m in range(start[a], stop[a]):
            b = neighbour[m]
            x, y, z = row[a, 0] - row[b, 0], row[a, 1] - row[b, 1], row[a, 2] - row[b, 2]
            distance = math.sqrt(x * x + y * y + z * z)
            f = slope(distance * inverse_h, constant) * row[a, 6] * row[b, 6]
            fx, fy, fz = f * x, f * y, f * z
            ax += (row[a, 7] + row[b, 7]) * fx + (row[a, 8] + row[b, 8]) * fy + (row[a, 9] + row[b, 9]) * fz
            ay += (row[a, 10] + row[b, 10]) * fx + (row[a, 11] + row[b, 11]) * fy + (row[a, 12] + row[b, 12]) * fz
            az += (row[a, 13] + row[b, 13]) * fx + (row[a, 14] + row[b, 14]) * fy + (row[a, 15] + row[b, 15]) * fz
            if 0.0 < distance < shortest:
                push = stiffness * (shortest / distance - 1.0)
                u, v, w = row[a, 3] - row[b, 3], row[a, 4] - row[b, 4], row[a, 5] - row[b, 5]
                taken -= push * (u * x + v * y + w * z)
                ax += push * x
                ay += push * y
                az += push * z
        acceleration[a, 0] += ax / mass
        acceleration[a, 1] += ay / mass
        acceleration[a, 2] += az / mass
        power[a] = 0.5 * taken
