"""Elastic bird in total-Lagrangian SPH: deformation gradient, neo-Hookean stress, pair forces, hourglass control.

All sums run over the neighbours and distances of the undeformed bird, which is why it neither clumps nor tears
(J. Bonet & S. Kulasegaram, Int. J. Numer. Meth. Eng. 52 (2001) 1203).
With the gradient corrected to linear exactness, B = M^-1, and the pair force V^2 (P_a B_a + P_b B_b) grad W, the
internal force is minus the gradient of the stored energy: linear and angular momentum are kept, and so is energy.
"""

from __future__ import annotations

import math

from numba import njit, prange

from solver.kernels.smoothing import slope, wendland
from solver.kernels.sph_strength import invert_symmetric

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
        invert_symmetric((m[0], m[1], m[2], m[3], m[4], m[5]), SMALLEST_MOMENT, m)


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


@njit(cache=True, parallel=True)
def neo_hookean_stress(n, dt, rho0, moduli, bulk_viscosity, correction, row, jacobian, q_stress, stress, energy, work):
    """First Piola-Kirchhoff stress with the shock's bulk viscosity, times B, into row[15:24].

    W = G/2 (J^(-2/3) F:F - 3) + K/2 (ln J)^2, P = G J^(-2/3) (F - F:F/3 F^-T) + (K ln J - J q) F^-T;
    q = rho0/J (linear c - quadratic D) (-D) with D = dJ/dt/J of the step that ended, in compression only.
    moduli: (2,) G, K [Pa]; bulk_viscosity: (2,) linear [m^2/s], quadratic [m^2]; in and out: jacobian (n,) J,
    q_stress (n,) q [Pa]; out: stress (n, 2): von Mises and pressure [Pa], energy (n,) W [J/m^3], work (n,): that q
    took over the step per reference volume [J/m^3].
    """
    g, bulk = moduli[0], moduli[1]
    for a in prange(n):
        f11, f12, f13 = row[a, 6], row[a, 7], row[a, 8]
        f21, f22, f23 = row[a, 9], row[a, 10], row[a, 11]
        f31, f32, f33 = row[a, 12], row[a, 13], row[a, 14]
        c11, c12, c13 = f22 * f33 - f23 * f32, f23 * f31 - f21 * f33, f21 * f32 - f22 * f31
        c21, c22, c23 = f13 * f32 - f12 * f33, f11 * f33 - f13 * f31, f12 * f31 - f11 * f32
        c31, c32, c33 = f12 * f23 - f13 * f22, f13 * f21 - f11 * f23, f11 * f22 - f12 * f21
        j = f11 * c11 + f12 * c12 + f13 * c13
        before = jacobian[a]
        jacobian[a] = j
        if not j > 0.0:
            continue
        squared = f11 * f11 + f12 * f12 + f13 * f13 + f21 * f21 + f22 * f22 + f23 * f23
        squared += f31 * f31 + f32 * f32 + f33 * f33
        shrink = j ** (-2.0 / 3.0)
        log = math.log(j)
        rate = (j - before) / (dt * j) if dt > 0.0 else 0.0
        q_before, q = q_stress[a], 0.0
        if rate < 0.0:
            q = rho0 / j * (bulk_viscosity[0] - bulk_viscosity[1] * rate) * -rate
        q_stress[a] = q
        work[a] = -0.5 * (q_before + q) * (j - before)
        energy[a] = 0.5 * g * (shrink * squared - 3.0) + 0.5 * bulk * log * log
        even = (bulk * log - j * q - g * shrink * squared / 3.0) / j
        odd = g * shrink
        p11, p12, p13 = odd * f11 + even * c11, odd * f12 + even * c12, odd * f13 + even * c13
        p21, p22, p23 = odd * f21 + even * c21, odd * f22 + even * c22, odd * f23 + even * c23
        p31, p32, p33 = odd * f31 + even * c31, odd * f32 + even * c32, odd * f33 + even * c33
        stress[a, 0] = equivalent_stress(row[a], g * shrink / j, squared)
        stress[a, 1] = q - bulk * log / j
        c = correction[a]
        row[a, 15], row[a, 16], row[a, 17] = times_symmetric(p11, p12, p13, c)
        row[a, 18], row[a, 19], row[a, 20] = times_symmetric(p21, p22, p23, c)
        row[a, 21], row[a, 22], row[a, 23] = times_symmetric(p31, p32, p33, c)


@njit(cache=True, inline="always")
def times_symmetric(x, y, z, c):
    """Row vector times a symmetric matrix (6,)."""
    return x * c[0] + y * c[3] + z * c[5], x * c[3] + y * c[1] + z * c[4], x * c[5] + y * c[4] + z * c[2]


@njit(cache=True, inline="always")
def equivalent_stress(row, factor, squared):
    """Von Mises stress [Pa] of the Cauchy deviator factor (F F^T - F:F/3 I)."""
    xx = row[6] * row[6] + row[7] * row[7] + row[8] * row[8] - squared / 3.0
    yy = row[9] * row[9] + row[10] * row[10] + row[11] * row[11] - squared / 3.0
    zz = row[12] * row[12] + row[13] * row[13] + row[14] * row[14] - squared / 3.0
    xy = row[6] * row[9] + row[7] * row[10] + row[8] * row[11]
    yz = row[9] * row[12] + row[10] * row[13] + row[11] * row[14]
    zx = row[12] * row[6] + row[13] * row[7] + row[14] * row[8]
    return factor * math.sqrt(1.5 * (xx * xx + yy * yy + zz * zz + 2.0 * (xy * xy + yz * yz + zx * zx)))


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
