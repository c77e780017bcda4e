"""Strength of the bird in updated-Lagrangian SPH: velocity gradient and divergence of the deviator.

Both use the gradient corrected to linear exactness (Bonet & Lok, CMAME 180 (1999) 97), B = M^-1. The pair force
V_a V_b (s_a B_a + s_b B_b) grad W is then the exact counterpart of the rate: its power is -V s:D to rounding, and its
moment vanishes with the antisymmetric part of s, so that linear and angular momentum are both conserved.
"""

from __future__ import annotations

import math

from numba import njit, prange

from solver.kernels.smoothing import slope

ROW = 16
"""0-2 position [m], 3-5 velocity [m/s], 6 volume [m^3], 7-15 deviator times B [Pa]."""
SMALLEST_MOMENT = 0.02  # det M (1 inside the bird) below which a particle is too lonely for a gradient


@njit(cache=True, inline="always")
def invert_symmetric(m, smallest, result):
    """Inverse of a symmetric matrix (6,) xx yy zz xy yz zx; zero for one whose determinant is below `smallest`."""
    axx, ayy, azz = m[1] * m[2] - m[4] * m[4], m[0] * m[2] - m[5] * m[5], m[0] * m[1] - m[3] * m[3]
    axy, ayz, azx = m[5] * m[4] - m[3] * m[2], m[3] * m[5] - m[0] * m[4], m[3] * m[4] - m[5] * m[1]
    det = m[0] * axx + m[3] * axy + m[5] * azx
    scale = 1.0 / det if det > smallest else 0.0
    result[0], result[1], result[2] = scale * axx, scale * ayy, scale * azz
    result[3], result[4], result[5] = scale * axy, scale * ayz, scale * azx


@njit(cache=True, parallel=True, fastmath={"contract", "reassoc", "nsz"})
def velocity_gradient(n, row, mass, h, constant, start, neighbour, drho_dt, rates, correction):
    """Continuity drho/dt = sum m (v_a - v_b).grad W, and D and spin by the corrected gradient.

    row: (N, 16) of `kernels.sph` (position, velocity, 7: 1/rho); mass [kg]; h [m]; constant: of `slope` [1/m^5];
    out: drho_dt (N,) [kg/m^3/s]; rates (N, 9): D xx yy zz xy yz zx, spin x y z [1/s]; correction (N, 6): B.
    """
    inverse_h = 1.0 / h
    for a in prange(n):
        rate = 0.0
        gxx = gxy = gxz = gyx = gyy = gyz = gzx = gzy = gzz = 0.0
        mxx = myy = mzz = mxy = myz = mzx = 0.0
        for m in range(start[a], start[a + 1]):
            b = neighbour[m]
            x, y, z = row[a, 0] - row[b, 0], row[a, 1] - row[b, 1], row[a, 2] - row[b, 2]
            u, v, w = row[a, 3] - row[b, 3], row[a, 4] - row[b, 4], row[a, 5] - row[b, 5]
            f = slope(math.sqrt(x * x + y * y + z * z) * inverse_h, constant)
            rate += (u * x + v * y + w * z) * f
            f *= row[b, 7]
            fx, fy, fz = f * x, f * y, f * z
            gxx += u * fx
            gxy += u * fy
            gxz += u * fz
            gyx += v * fx
            gyy += v * fy
            gyz += v * fz
            gzx += w * fx
            gzy += w * fy
            gzz += w * fz
            mxx += x * fx
            myy += y * fy
            mzz += z * fz
            mxy += x * fy
            myz += y * fz
            mzx += z * fx
        drho_dt[a] = mass * rate
        c = correction[a]
        invert_symmetric(
            (-mass * mxx, -mass * myy, -mass * mzz, -mass * mxy, -mass * myz, -mass * mzx), SMALLEST_MOMENT, c
        )
        lxy = gxx * c[3] + gxy * c[1] + gxz * c[4]
        lyx = gyx * c[0] + gyy * c[3] + gyz * c[5]
        lyz = gyx * c[5] + gyy * c[4] + gyz * c[2]
        lzy = gzx * c[3] + gzy * c[1] + gzz * c[4]
        lzx = gzx * c[0] + gzy * c[3] + gzz * c[5]
        lxz = gxx * c[5] + gxy * c[4] + gxz * c[2]
        rates[a, 0] = -mass * (gxx * c[0] + gxy * c[3] + gxz * c[5])
        rates[a, 1] = -mass * (gyx * c[3] + gyy * c[1] + gyz * c[4])
        rates[a, 2] = -mass * (gzx * c[5] + gzy * c[4] + gzz * c[2])
        rates[a, 3], rates[a, 4], rates[a, 5] = (
            -0.5 * mass * (lxy + lyx),
            -0.5 * mass * (lyz + lzy),
            -0.5 * mass * (lzx + lxz),
        )
        rates[a, 6], rates[a, 7], rates[a, 8] = (
            -0.5 * mass * (lzy - lyz),
            -0.5 * mass * (lxz - lzx),
            -0.5 * mass * (lyx - lxy),
        )


@njit(cache=True, parallel=True)
def pack_stress(n, x, v, acceleration, dt, mass, rho, stress, correction, row):
    """State at the whole step, see ROW; velocities predicted by half a kick."""
    for a in prange(n):
        for i in range(3):
            row[a, i] = x[a, i]
            row[a, 3 + i] = v[a, i] + 0.5 * dt * acceleration[a, i]
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
def add_stress_forces(n, row, mass, h, constant, repulsion, start, neighbour, acceleration, power):
    """Divergence of the deviator joins the accelerations, and a spring between particles that clump.

    In tension SPH particles attract each other in pairs (J. W. Swegle, D. L. Hicks & S. W. Attaway, J. Comput. Phys.
    116 (1995) 123). Monaghan's artificial stress, proportional to the tension, takes no account of what it stores: it
    gave this bird a third of the strike's energy. A spring that acts below a distance alone gives back what it took.
    repulsion: (2,) stiffness [N/m] and that distance [m]; out: acceleration (N, 3) [m/s^2], added to; power (N,):
    taken by the springs [W].
    """
    inverse_h = 1.0 / h
    stiffness, shortest = repulsion[0], repulsion[1]
    for a in prange(n):
        ax = ay = az = taken = 0.0
        for m in range(start[a], start[a + 1]):
            b = neighbour[m]
            x, y, z = row[a, 0] - row[b, 0], row[a, 1] - row[b, 1], row[a, 2] - row[b, 2]
            distance = math.sqrt(x * x + y * y + z * z)
            f = slope(distance * inverse_h, constant) * row[a, 6] * row[b, 6]
            fx, fy, fz = f * x, f * y, f * z
            ax += (row[a, 7] + row[b, 7]) * fx + (row[a, 8] + row[b, 8]) * fy + (row[a, 9] + row[b, 9]) * fz
            ay += (row[a, 10] + row[b, 10]) * fx + (row[a, 11] + row[b, 11]) * fy + (row[a, 12] + row[b, 12]) * fz
            az += (row[a, 13] + row[b, 13]) * fx + (row[a, 14] + row[b, 14]) * fy + (row[a, 15] + row[b, 15]) * fz
            if distance < shortest:
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
