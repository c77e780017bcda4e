"""Smoothed particle hydrodynamics of the bird: rate of density, rate of deformation, and pair forces.

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

from numba import njit, prange

from solver.kernels.smoothing import slope

ROW = 16
PAIR_MATH = {"contract", "reassoc", "arcp", "nsz"}
TINY = 1e-300  # against 0/0
SMALLEST_MOMENT = 0.02  # det of the moment matrix below which a particle is too lonely for a gradient


@njit(cache=True, parallel=True)
def pack_midpoint(n, x, v, lag, rho, dt, row):
    """Positions half a step back and the step's mean velocities v - lag, which live there; 1/rho in column 7."""
    for a in prange(n):
        for i in range(3):
            row[a, 3 + i] = v[a, i] - lag[a, i]
            row[a, i] = x[a, i] - 0.5 * dt * row[a, 3 + i]
        row[a, 7] = 1.0 / rho[a]


@njit(cache=True, parallel=True, fastmath=PAIR_MATH)
def rate_of_deformation(n, row, mass, h, constant, start, neighbour, drho_dt, deformation):
    """Continuity drho/dt = sum m (v_a - v_b).grad W, and D = sym(grad v) with the linear-exact gradient.

    row: (N, 16); mass [kg]; h [m]; constant: of `slope` [1/m^5];
    out: drho_dt (N,) [kg/m^3/s], deformation (N, 6) [1/s].
    The density keeps the plain gradient, because that is the one whose work the pair forces do exactly; the corrected
    one (Bonet & Lok, CMAME 180 (1999) 97) is used where only accuracy counts. Lonely particles get D = 0.
    """
    inverse_h = 1.0 / h
    for a in prange(n):
        xa, ya, za = row[a, 0], row[a, 1], row[a, 2]
        ua, va, wa = row[a, 3], row[a, 4], row[a, 5]
        rate = 0.0
        gxx = gxy = gxz = gyx = gyy = gyz = gzx = gzy = gzz = 0.0
        mxx = myy = mzz = mxy = myz = mzx = 0.0
        for m in range(start[a], start[a + 1]):
            b = neighbour[m]
            x, y, z = xa - row[b, 0], ya - row[b, 1], za - row[b, 2]
            u, v, w = ua - row[b, 3], va - row[b, 4], wa - row[b, 5]
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
        # inverse of the symmetric moment matrix by cofactors; mass cancels between gradient and moment
        axx = myy * mzz - myz * myz
        ayy = mxx * mzz - mzx * mzx
        azz = mxx * myy - mxy * mxy
        axy = mzx * myz - mxy * mzz
        ayz = mxy * mzx - mxx * myz
        azx = mxy * myz - mzx * myy
        det = mxx * axx + mxy * axy + mzx * azx
        scale = 0.0
        if abs(det) * mass**3 > SMALLEST_MOMENT:
            scale = 1.0 / det
        deformation[a, 0] = scale * (gxx * axx + gxy * axy + gxz * azx)
        deformation[a, 1] = scale * (gyx * axy + gyy * ayy + gyz * ayz)
        deformation[a, 2] = scale * (gzx * azx + gzy * ayz + gzz * azz)
        lxy = gxx * axy + gxy * ayy + gxz * ayz
        lyx = gyx * axx + gyy * axy + gyz * azx
        lyz = gyx * azx + gyy * ayz + gyz * azz
        lzy = gzx * axy + gzy * ayy + gzz * ayz
        lzx = gzx * axx + gzy * axy + gzz * azx
        lxz = gxx * azx + gxy * ayz + gxz * azz
        deformation[a, 3] = 0.5 * scale * (lxy + lyx)
        deformation[a, 4] = 0.5 * scale * (lyz + lzy)
        deformation[a, 5] = 0.5 * scale * (lzx + lxz)


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
def pack_state(n, x, v, push, last, last_but_one, rho, p, c, deformation, dt, row):
    """State at the whole step.

    Velocities are predicted by half a kick of the mean of the last two accelerations (n, 3): see `stable_step`; push:
    (n, 3) [m/s], half the kick of outer forces.
    """
    for a in prange(n):
        for i in range(3):
            row[a, i] = x[a, i]
            row[a, 3 + i] = v[a, i] + push[a, i] + 0.25 * dt * (last[a, i] + last_but_one[a, i])
        row[a, 6] = p[a] / (rho[a] * rho[a])
        row[a, 7] = 1.0 / rho[a]
        row[a, 8] = c[a] * shock_share(deformation[a])
        row[a, 15] = (deformation[a, 0] + deformation[a, 1] + deformation[a, 2]) / 3.0
        for i in range(6):
            row[a, 9 + i] = deformation[a, i]


@njit(cache=True, parallel=True, fastmath=PAIR_MATH)
def pair_forces(n, row, mass, h, constant, viscosity, shock, start, neighbour, acceleration, dissipation):
    """Accelerations from pressure, Newtonian viscosity and shock viscosity; dissipated power per particle.

    viscosity: MU [Pa s]; shock: (2,) linear and quadratic coefficients; out: acceleration (N, 3) [m/s^2],
    dissipation (N, 2): power of a unit shear viscosity (times MU: the viscous power) and of the shock viscosity [W].

    Stress: sum m (sigma_a/rho_a^2 + sigma_b/rho_b^2).grad W with sigma = -p I + 2 MU dev D, as the weak form has it,
    so that a free surface carries no traction. (A central pair viscosity was tried: in the reference strike the
    bird's momentum arrives up to 5 % early with it, against OpenRadioss, which has the stress as well.)
    Shock viscosity: Monaghan's form on velocities reconstructed linearly to the pair's midpoint under a van Leer
    limiter (Frontiere, Raskin & Owen, J. Comput. Phys. 332 (2017) 160): it vanishes where the flow is linear, so
    that shear is not damped and MU keeps its meaning. The linear coefficient carries the pair's mean shock share.
    The rows may list particles beyond the support: there the slope is zero.
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
        for m in range(start[a], start[a + 1]):
            b = neighbour[m]
            x, y, z = xa - row[b, 0], ya - row[b, 1], za - row[b, 2]
            r2 = x * x + y * y + z * z
            f = slope(math.sqrt(r2) * inverse_h, constant)
            u, v, w = ua - row[b, 3], va - row[b, 4], wa - row[b, 5]
            approach = u * x + v * y + w * z
            inverse = 1.0 / (r2 + core)
            # D r of both particles: their strain along the pair, and their viscous traction
            ex, ey, ez = dxx * x + dxy * y + dzx * z, dxy * x + dyy * y + dyz * z, dzx * x + dyz * y + dzz * z
            gx = row[b, 9] * x + row[b, 12] * y + row[b, 14] * z
            gy = row[b, 12] * x + row[b, 10] * y + row[b, 13] * z
            gz = row[b, 14] * x + row[b, 13] * y + row[b, 11] * z
            strain_a, strain_b = min(x * ex + y * ey + z * ez, 0.0), min(x * gx + y * gy + z * gz, 0.0)
            kb = 2.0 * row[b, 7] * row[b, 7]
            mean = ka * ta + kb * row[b, 15]
            sx, sy, sz = ka * ex + kb * gx - mean * x, ka * ey + kb * gy - mean * y, ka * ez + kb * gz - mean * z
            # van Leer's 4r/(1+r)^2 times the mean strain is their harmonic mean
            jump = min(approach - 2.0 * strain_a * strain_b / (strain_a + strain_b - TINY), 0.0)
            jump = (jump if approach < 0.0 else 0.0) * h * inverse
            shock_push = (quadratic * jump - linear * (sa + row[b, 8])) * jump * (inv_rho_a + row[b, 7])
            unit_power -= (sx * u + sy * v + sz * w) * f
            shock_power += shock_push * approach * f
            push = pa + row[b, 6] + shock_push
            ax += f * (viscosity * sx - push * x)
            ay += f * (viscosity * sy - push * y)
            az += f * (viscosity * sz - push * z)
        acceleration[a, 0] = mass * ax
        acceleration[a, 1] = mass * ay
        acceleration[a, 2] = mass * az
        dissipation[a, 0] = 0.5 * mass * mass * unit_power
        dissipation[a, 1] = 0.5 * mass * mass * shock_power
