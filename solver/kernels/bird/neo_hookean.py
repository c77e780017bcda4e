"""Neo-Hookean stress of the elastic bird from its deformation gradient, one particle at a time.

The rows are those of `kernels.bird.total_lagrangian`: 6-14 F, 15-23 P B.
"""

from __future__ import annotations

import math

from numba import njit, prange


@njit(cache=True)
def cofactors(f11, f12, f13, f21, f22, f23, f31, f32, f33):
    """Cofactor matrix of F, J F^-T, row by row."""
    c11, c12, c13 = f22 * f33 - f23 * f32, f23 * f31 - f21 * f33, f21 * f32 - f22 * f31
    c21, c22, c23 = f13 * f32 - f12 * f33, f11 * f33 - f13 * f31, f12 * f31 - f11 * f32
    c31, c32, c33 = f12 * f23 - f13 * f22, f13 * f21 - f11 * f23, f11 * f22 - f12 * f21
    return c11, c12, c13, c21, c22, c23, c31, c32, c33


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
        c11, c12, c13, c21, c22, c23, c31, c32, c33 = cofactors(f11, f12, f13, f21, f22, f23, f31, f32, f33)
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


@njit(cache=True, parallel=True)
def unit_shear_power(n, dt, row, before, power):
    """Power that a unit shear viscosity would take, 2 D':D' J per reference volume [1/s^2], over the step that ended.

    L = (F - F_before)/dt F^-1; before: (n, 9) F of the step before, then of this; power: (n,).
    """
    for a in prange(n):
        f11, f12, f13 = row[a, 6], row[a, 7], row[a, 8]
        f21, f22, f23 = row[a, 9], row[a, 10], row[a, 11]
        f31, f32, f33 = row[a, 12], row[a, 13], row[a, 14]
        c11, c12, c13, c21, c22, c23, c31, c32, c33 = cofactors(f11, f12, f13, f21, f22, f23, f31, f32, f33)
        j = f11 * c11 + f12 * c12 + f13 * c13
        scale = 1.0 / (j * dt) if dt > 0.0 else 0.0
        r11, r12, r13 = f11 - before[a, 0], f12 - before[a, 1], f13 - before[a, 2]
        r21, r22, r23 = f21 - before[a, 3], f22 - before[a, 4], f23 - before[a, 5]
        r31, r32, r33 = f31 - before[a, 6], f32 - before[a, 7], f33 - before[a, 8]
        xx = scale * (r11 * c11 + r12 * c12 + r13 * c13)
        yy = scale * (r21 * c21 + r22 * c22 + r23 * c23)
        zz = scale * (r31 * c31 + r32 * c32 + r33 * c33)
        xy = 0.5 * scale * (r11 * c21 + r12 * c22 + r13 * c23 + r21 * c11 + r22 * c12 + r23 * c13)
        yz = 0.5 * scale * (r21 * c31 + r22 * c32 + r23 * c33 + r31 * c21 + r32 * c22 + r33 * c23)
        zx = 0.5 * scale * (r31 * c11 + r32 * c12 + r33 * c13 + r11 * c31 + r12 * c32 + r13 * c33)
        trace = (xx + yy + zz) / 3.0
        squared = (xx - trace) ** 2 + (yy - trace) ** 2 + (zz - trace) ** 2
        power[a] = 2.0 * j * (squared + 2.0 * (xy * xy + yz * yz + zx * zx))
        before[a] = row[a, 6:15]
