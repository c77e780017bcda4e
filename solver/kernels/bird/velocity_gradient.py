"""Rate of density and velocity gradient of the bird's particles, half a step back.

The density keeps the plain gradient, because that is the one whose work the pair forces do exactly; the velocity
gradient is corrected to linear exactness (Bonet & Lok, CMAME 180 (1999) 97), B = M^-1 with M = -sum V x (x) grad W.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit, prange
from numba.np.ufunc import get_thread_id

from birdstrike.solver.kernels.bird.columns import WIDTH, turn_rows
from birdstrike.solver.kernels.bird.smoothing import slope

PAIR_MATH = {"contract", "reassoc", "arcp", "nsz"}
SMALLEST_MOMENT = 0.02  # det M (1 inside the bird) below which a particle is too lonely for a gradient


@njit(cache=True, parallel=True)
def pack_midpoint(n, x, v, lag, rho, dt, row):
    """Positions half a step back and the step's mean velocities v - lag, which live there; 1/rho in column 7."""
    for a in prange(n):
        for i in range(3):
            row[a, 3 + i] = v[a, i] - lag[a, i]
            row[a, i] = x[a, i] - 0.5 * dt * row[a, 3 + i]
        row[a, 7] = 1.0 / rho[a]


@njit(cache=True, inline="always")
def inverse_symmetric(xx, yy, zz, xy, yz, zx, smallest):
    """Inverse of a symmetric matrix by cofactors, in the same order; zero where its determinant is below `smallest`."""
    axx, ayy, azz = yy * zz - yz * yz, xx * zz - zx * zx, xx * yy - xy * xy
    axy, ayz, azx = zx * yz - xy * zz, xy * zx - xx * yz, xy * yz - zx * yy
    det = xx * axx + xy * axy + zx * azx
    scale = 1.0 / det if det > smallest else 0.0
    return scale * axx, scale * ayy, scale * azz, scale * axy, scale * ayz, scale * azx


@njit(cache=True, fastmath=PAIR_MATH)
def gradient_sums(a, row, mass, inverse_h, constant, start, stop, neighbour, column):
    """drho/dt of particle a by continuity, sum m (v_a - v_b).grad W; the nine of its velocity gradient; the six of B.

    row: see `kernels.bird.sph`; column: (ROW, length) scratch. Order: xx xy xz yx .. zz, and xx yy zz xy yz zx.
    The slopes go first, into column 6, which nothing else needs here: a root takes as long as a whole pass of the
    second loop, and in a loop of their own the roots of several vectors overlap.
    """
    xa, ya, za = row[a, 0], row[a, 1], row[a, 2]
    ua, va, wa = row[a, 3], row[a, 4], row[a, 5]
    for m in range(start[a], stop[a], WIDTH):
        turn_rows(row, neighbour, m, column, m - start[a], 8)
    for m in range(np.uint64(stop[a] - start[a])):
        x, y, z = xa - column[0, m], ya - column[1, m], za - column[2, m]
        column[6, m] = slope(math.sqrt(x * x + y * y + z * z) * inverse_h, constant)
    rate = 0.0
    gxx = gxy = gxz = gyx = gyy = gyz = gzx = gzy = gzz = 0.0
    mxx = myy = mzz = mxy = myz = mzx = 0.0
    for m in range(np.uint64(stop[a] - start[a])):
        x, y, z = xa - column[0, m], ya - column[1, m], za - column[2, m]
        u, v, w = ua - column[3, m], va - column[4, m], wa - column[5, m]
        f = column[6, m]
        rate += (u * x + v * y + w * z) * f
        f *= column[7, m]
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
    s = -mass
    b = inverse_symmetric(s * mxx, s * myy, s * mzz, s * mxy, s * myz, s * mzx, SMALLEST_MOMENT)
    bxx, byy, bzz, bxy, byz, bzx = s * b[0], s * b[1], s * b[2], s * b[3], s * b[4], s * b[5]
    lxx, lxy, lxz = (
        gxx * bxx + gxy * bxy + gxz * bzx,
        gxx * bxy + gxy * byy + gxz * byz,
        gxx * bzx + gxy * byz + gxz * bzz,
    )
    lyx, lyy, lyz = (
        gyx * bxx + gyy * bxy + gyz * bzx,
        gyx * bxy + gyy * byy + gyz * byz,
        gyx * bzx + gyy * byz + gyz * bzz,
    )
    lzx, lzy, lzz = (
        gzx * bxx + gzy * bxy + gzz * bzx,
        gzx * bxy + gzy * byy + gzz * byz,
        gzx * bzx + gzy * byz + gzz * bzz,
    )
    return mass * rate, (lxx, lxy, lxz, lyx, lyy, lyz, lzx, lzy, lzz), b


@njit(cache=True, parallel=True, fastmath=PAIR_MATH)
def rate_of_deformation(n, row, mass, h, constant, start, stop, neighbour, columns, drho_dt, deformation):
    """Continuity and D = sym(grad v); lonely particles get D = 0.

    row: (N, ROW); mass [kg]; h [m]; constant: of `slope` [1/m^5]; columns: (threads, ROW, length) scratch;
    out: drho_dt (N,) [kg/m^3/s], deformation (N, 6) xx yy zz xy yz zx [1/s].
    """
    for a in prange(n):
        scratch = columns[get_thread_id()]
        drho_dt[a], g, _ = gradient_sums(a, row, mass, 1.0 / h, constant, start, stop, neighbour, scratch)
        d = deformation[a]
        d[0], d[1], d[2] = g[0], g[4], g[8]
        d[3], d[4], d[5] = 0.5 * (g[1] + g[3]), 0.5 * (g[5] + g[7]), 0.5 * (g[6] + g[2])


@njit(cache=True, parallel=True, fastmath=PAIR_MATH)
def velocity_gradient(n, row, mass, h, constant, start, stop, neighbour, columns, drho_dt, rates, correction):
    """As `rate_of_deformation`; out: rates (N, 9): D, spin x y z [1/s]; correction (N, 6): B."""
    for a in prange(n):
        scratch = columns[get_thread_id()]
        drho_dt[a], g, b = gradient_sums(a, row, mass, 1.0 / h, constant, start, stop, neighbour, scratch)
        d = rates[a]
        d[0], d[1], d[2] = g[0], g[4], g[8]
        d[3], d[4], d[5] = 0.5 * (g[1] + g[3]), 0.5 * (g[5] + g[7]), 0.5 * (g[6] + g[2])
        d[6], d[7], d[8] = 0.5 * (g[7] - g[5]), 0.5 * (g[2] - g[6]), 0.5 * (g[3] - g[1])
        for i in range(6):
            correction[a, i] = b[i]
