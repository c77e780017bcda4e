"""Elastic bird in total-Lagrangian SPH: deformation gradient, pair forces, hourglass control.

All sums run over the neighbours and distances of the undeformed bird, which is why it neither clumps nor tears
(J. Bonet & S. Kulasegaram, Int. J. Numer. Meth. Eng. 52 (2001) 1203).
With the gradient corrected to linear exactness, B = M^-1, and the pair force V^2 (P_a B_a + P_b B_b) grad W, the
internal force is minus the gradient of the stored energy: linear and angular momentum are kept, and so is energy.
"""

from __future__ import annotations

import math

from numba import njit, prange

from birdstrike.solver.kernels.bird.smoothing import slope, wendland
from birdstrike.solver.kernels.bird.velocity_gradient import inverse_symmetric

ROW = 24
"""0-2 position [m], 3-5 reference position [m], 6-14 F, 15-23 P B [Pa]."""
SMALLEST_MOMENT = 1e-3  # det M below which a particle has no gradient: all its neighbours in one plane
PAIR_MATH = {"contract", "reassoc", "nsz"}


@njit(cache=True, parallel=True)
def reference_correction(n, reference, volume, h, constant, start, neighbour, correction):
    """B = (-sum V X (x) grad W)^-1 of the undeformed lattice, (n, 6); reference: (n, 3) [m], volume [m^3]."""
    for a in prange(n):
        m = correction[a]
        m[:] = 0.0
        for k in range(start[a], start[a + 1]):
            b = neighbour[k]
            x, y, z = (
                reference[a, 0] - reference[b, 0],
                reference[a, 1] - reference[b, 1],
                reference[a, 2] - reference[b, 2],
            )
            f = -volume * slope(math.sqrt(x * x + y * y + z * z) / h, constant)
            m[0] += f * x * x
            m[1] += f * y * y
            m[2] += f * z * z
            m[3] += f * x * y
            m[4] += f * y * z
            m[5] += f * z * x
        m[0], m[1], m[2], m[3], m[4], m[5] = inverse_symmetric(m[0], m[1], m[2], m[3], m[4], m[5], SMALLEST_MOMENT)


@njit(cache=True, parallel=True, fastmath=PAIR_MATH)
def deformation_gradient(n, x, volume, h, constant, start, neighbour, correction, row):
    """F = sum V (x_b - x_a) (x) B grad W into row[6:15], position into row[0:3]; row[3:6] holds the reference."""
    inverse_h = 1.0 / h
    for a in prange(n):
        gxx = gxy = gxz = gyx = gyy = gyz = gzx = gzy = gzz = 0.0
        for k in range(start[a], start[a + 1]):
            b = neighbour[k]
            rx, ry, rz = row[a, 3] - row[b, 3], row[a, 4] - row[b, 4], row[a, 5] - row[b, 5]
            f = -volume * slope(math.sqrt(rx * rx + ry * ry + rz * rz) * inverse_h, constant)
            fx, fy, fz = f * rx, f * ry, f * rz
            ux, uy, uz = x[a, 0] - x[b, 0], x[a, 1] - x[b, 1], x[a, 2] - x[b, 2]
            gxx += ux * fx
            gxy += ux * fy
            gxz += ux * fz
            gyx += uy * fx
            gyy += uy * fy
            gyz += uy * fz
            gzx += uz * fx
            gzy += uz * fy
            gzz += uz * fz
        c = correction[a]
        row[a, 0], row[a, 1], row[a, 2] = x[a, 0], x[a, 1], x[a, 2]
        row[a, 6] = gxx * c[0] + gxy * c[3] + gxz * c[5]
        row[a, 7] = gxx * c[3] + gxy * c[1] + gxz * c[4]
        row[a, 8] = gxx * c[5] + gxy * c[4] + gxz * c[2]
        row[a, 9] = gyx * c[0] + gyy * c[3] + gyz * c[5]
        row[a, 10] = gyx * c[3] + gyy * c[1] + gyz * c[4]
        row[a, 11] = gyx * c[5] + gyy * c[4] + gyz * c[2]
        row[a, 12] = gzx * c[0] + gzy * c[3] + gzz * c[5]
        row[a, 13] = gzx * c[3] + gzy * c[1] + gzz * c[4]
        row[a, 14] = gzx * c[5] + gzy * c[4] + gzz * c[2]


@njit(cache=True, parallel=True, fastmath=PAIR_MATH)
def elastic_forces(n, row, mass, volume, h, constant, hourglass, start, neighbour, acceleration, penalty):
    """Accelerations from stress and hourglass control; penalty (n, 3) [m/s^2]: the latter's part alone.

    Stress: V^2 (P_a B_a + P_b B_b) grad W. Hourglass: what the pair's separation lacks of the mean of the two affine
    maps, (F_a + F_b)/2 X - x, along the pair, times hourglass V^2 W/X^2 (G. C. Ganzenmueller, CMAME 286 (2015) 87,
    eq. 22; there hourglass = 50 E). Central, so that it conserves both momenta; zero in any affine deformation.
    """
    inverse_h = 1.0 / h
    for a in prange(n):
        ax = ay = az = sx = sy = sz = 0.0
        for k in range(start[a], start[a + 1]):
            b = neighbour[k]
            if b == a:  # rows are filled up with their own particle
                continue
            rx, ry, rz = row[a, 3] - row[b, 3], row[a, 4] - row[b, 4], row[a, 5] - row[b, 5]
            x, y, z = row[a, 0] - row[b, 0], row[a, 1] - row[b, 1], row[a, 2] - row[b, 2]
            r2 = rx * rx + ry * ry + rz * rz
            q = math.sqrt(r2) * inverse_h
            f = slope(q, constant)
            fx, fy, fz = f * rx, f * ry, f * rz
            ax += (row[a, 15] + row[b, 15]) * fx + (row[a, 16] + row[b, 16]) * fy + (row[a, 17] + row[b, 17]) * fz
            ay += (row[a, 18] + row[b, 18]) * fx + (row[a, 19] + row[b, 19]) * fy + (row[a, 20] + row[b, 20]) * fz
            az += (row[a, 21] + row[b, 21]) * fx + (row[a, 22] + row[b, 22]) * fy + (row[a, 23] + row[b, 23]) * fz
            mx = 0.5 * ((row[a, 6] + row[b, 6]) * rx + (row[a, 7] + row[b, 7]) * ry + (row[a, 8] + row[b, 8]) * rz)
            my = 0.5 * ((row[a, 9] + row[b, 9]) * rx + (row[a, 10] + row[b, 10]) * ry + (row[a, 11] + row[b, 11]) * rz)
            mz = 0.5 * (
                (row[a, 12] + row[b, 12]) * rx + (row[a, 13] + row[b, 13]) * ry + (row[a, 14] + row[b, 14]) * rz
            )
            inverse = 1.0 / (x * x + y * y + z * z)
            lack = (mx * x + my * y + mz * z) * inverse - 1.0
            push = hourglass * wendland(q, h) * lack / r2
            sx += push * x
            sy += push * y
            sz += push * z
        scale = volume * volume / mass
        penalty[a, 0], penalty[a, 1], penalty[a, 2] = scale * sx, scale * sy, scale * sz
        acceleration[a, 0] = scale * ax + penalty[a, 0]
        acceleration[a, 1] = scale * ay + penalty[a, 1]
        acceleration[a, 2] = scale * az + penalty[a, 2]
