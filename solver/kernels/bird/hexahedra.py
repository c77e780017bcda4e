"""One-point eight-node hexahedron: exact volume, uniform gradient, rate of deformation, nodal forces.

D. P. Flanagan & T. Belytschko, Int. J. Numer. Meth. Eng. 17 (1981) 679. The gradient B_iI = dV/dx_iI is exact for any
shape, so that a linear field has its exact gradient, the forces sigma_ij B_jI on the nodes keep linear and angular
momentum, and their power is V sigma : D. The four modes that B does not see, Gamma, are left to `hexahedra_hourglass`.

Per element: gradient (3, 8) [m^2]; rate (9,): L_ij = dv_i/dx_j by rows [1/s]; tensors (6,): xx, yy, zz, xy, yz, zx.
"""

from __future__ import annotations

from numba import njit, prange


@njit(cache=True, inline="always")
def corner_gradient(y2, y3, y4, y5, y6, y8, z2, z3, z4, z5, z6, z8):
    """dV/dx of corner 1 from the y and z of the six corners that share a face with it (eq. 79)."""
    return (
        y2 * ((z6 - z3) - (z4 - z5))
        + y3 * (z2 - z4)
        + y4 * ((z3 - z8) - (z5 - z2))
        + y5 * ((z8 - z6) - (z2 - z4))
        + y6 * (z5 - z2)
        + y8 * (z4 - z5)
    ) / 12.0


@njit(cache=True)
def volume_gradient(y, z):
    """dV/dx of the eight corners; y, z: tuples of 8. With (z, x) and (x, y) instead it is dV/dy and dV/dz."""
    y1, y2, y3, y4, y5, y6, y7, y8 = y
    z1, z2, z3, z4, z5, z6, z7, z8 = z
    return (
        corner_gradient(y2, y3, y4, y5, y6, y8, z2, z3, z4, z5, z6, z8),
        corner_gradient(y3, y4, y1, y6, y7, y5, z3, z4, z1, z6, z7, z5),
        corner_gradient(y4, y1, y2, y7, y8, y6, z4, z1, z2, z7, z8, z6),
        corner_gradient(y1, y2, y3, y8, y5, y7, z1, z2, z3, z8, z5, z7),
        corner_gradient(y8, y7, y6, y1, y4, y2, z8, z7, z6, z1, z4, z2),
        corner_gradient(y5, y8, y7, y2, y1, y3, z5, z8, z7, z2, z1, z3),
        corner_gradient(y6, y5, y8, y3, y2, y4, z6, z5, z8, z3, z2, z4),
        corner_gradient(y7, y6, y5, y4, y3, y1, z7, z6, z5, z4, z3, z1),
    )


@njit(cache=True, inline="always")
def corners(values, cell, axis):
    """One component of the eight nodes of a cell."""
    return (
        values[cell[0], axis],
        values[cell[1], axis],
        values[cell[2], axis],
        values[cell[3], axis],
        values[cell[4], axis],
        values[cell[5], axis],
        values[cell[6], axis],
        values[cell[7], axis],
    )


@njit(cache=True, inline="always")
def earlier(x, v, shift):
    """x - shift v of two tuples of 8."""
    return (
        x[0] - shift * v[0],
        x[1] - shift * v[1],
        x[2] - shift * v[2],
        x[3] - shift * v[3],
        x[4] - shift * v[4],
        x[5] - shift * v[5],
        x[6] - shift * v[6],
        x[7] - shift * v[7],
    )


@njit(cache=True, inline="always")
def dot(a, b):
    """Scalar product of two tuples of 8."""
    return (a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]) + (
        a[4] * b[4] + a[5] * b[5] + a[6] * b[6] + a[7] * b[7]
    )


@njit(cache=True, inline="always")
def modes(a):
    """Products of a tuple of 8 with the four hourglass vectors Gamma: eta zeta, xi zeta, xi eta, xi eta zeta."""
    return (
        (a[0] + a[1] + a[6] + a[7]) - (a[2] + a[3] + a[4] + a[5]),
        (a[0] + a[3] + a[5] + a[6]) - (a[1] + a[2] + a[4] + a[7]),
        (a[0] + a[2] + a[4] + a[6]) - (a[1] + a[3] + a[5] + a[7]),
        (a[1] + a[3] + a[4] + a[6]) - (a[0] + a[2] + a[5] + a[7]),
    )


@njit(cache=True, parallel=True)
def hex_rates(cells, alive, x, v, dt, rate, hourglass_rate):
    """Velocity gradient (e, 9) and hourglass rates (e, 3, 4) [m/s] half a step ago, from x (m, 3) now and v then.

    The hourglass rate is v_iI gamma_aI with gamma = (Gamma - B (x . Gamma)/V)/sqrt(8): no linear field has any.
    """
    for e in prange(cells.shape[0]):
        if not alive[e]:
            continue
        cell = cells[e]
        vx, vy, vz = corners(v, cell, 0), corners(v, cell, 1), corners(v, cell, 2)
        x0 = earlier(corners(x, cell, 0), vx, 0.5 * dt)
        y0 = earlier(corners(x, cell, 1), vy, 0.5 * dt)
        z0 = earlier(corners(x, cell, 2), vz, 0.5 * dt)
        bx, by, bz = volume_gradient(y0, z0), volume_gradient(z0, x0), volume_gradient(x0, y0)
        inverse = 1.0 / dot(x0, bx)
        gx, gy, gz = modes(x0), modes(y0), modes(z0)
        for row, w in enumerate((vx, vy, vz)):
            lx, ly, lz = dot(w, bx) * inverse, dot(w, by) * inverse, dot(w, bz) * inverse
            rate[e, 3 * row], rate[e, 3 * row + 1], rate[e, 3 * row + 2] = lx, ly, lz
            h = modes(w)
            for a in range(4):
                hourglass_rate[e, row, a] = (h[a] - lx * gx[a] - ly * gy[a] - lz * gz[a]) * 0.35355339059327373


@njit(cache=True, parallel=True)
def hex_geometry(cells, alive, x, volume, gradient, shape):
    """Volume (e,) [m^3], its gradient (e, 3, 8) and the products x . Gamma, shape (e, 3, 4) [m], of the present x."""
    for e in prange(cells.shape[0]):
        if not alive[e]:
            continue
        cell = cells[e]
        x0, y0, z0 = corners(x, cell, 0), corners(x, cell, 1), corners(x, cell, 2)
        bx, by, bz = volume_gradient(y0, z0), volume_gradient(z0, x0), volume_gradient(x0, y0)
        volume[e] = dot(x0, bx)
        for i in range(8):
            gradient[e, 0, i], gradient[e, 1, i], gradient[e, 2, i] = bx[i], by[i], bz[i]
        gx, gy, gz = modes(x0), modes(y0), modes(z0)
        for a in range(4):
            shape[e, 0, a], shape[e, 1, a], shape[e, 2, a] = gx[a], gy[a], gz[a]


@njit(cache=True, parallel=True)
def hex_forces(alive, stress, hourglass, volume, gradient, shape, force):
    """Forces of the elements on their nodes, (e, 8, 3) [N]; stress (e, 6) [Pa], hourglass Q (e, 3, 4) [N].

    f_iI = -sigma_ij B_jI - Q_ia gamma_aI. As gamma is Gamma less a combination of B, the hourglass forces are those of
    Gamma and a stress.
    """
    for e in prange(alive.shape[0]):
        if not alive[e]:
            force[e, :, :] = 0.0
            continue
        s, q, b = stress[e], hourglass[e], gradient[e]
        for i in range(3):
            t0, t1, t2 = s[(0, 3, 5)[i]], s[(3, 1, 4)[i]], s[(5, 4, 2)[i]]
            q0, q1 = q[i, 0] * 0.35355339059327373, q[i, 1] * 0.35355339059327373
            q2, q3 = q[i, 2] * 0.35355339059327373, q[i, 3] * 0.35355339059327373
            h, inverse = shape[e], 1.0 / volume[e]
            t0 -= (q0 * h[0, 0] + q1 * h[0, 1] + q2 * h[0, 2] + q3 * h[0, 3]) * inverse
            t1 -= (q0 * h[1, 0] + q1 * h[1, 1] + q2 * h[1, 2] + q3 * h[1, 3]) * inverse
            t2 -= (q0 * h[2, 0] + q1 * h[2, 1] + q2 * h[2, 2] + q3 * h[2, 3]) * inverse
            spread = (
                q0 + q1 + q2 - q3,
                q0 - q1 - q2 + q3,
                q2 - q0 - q1 - q3,
                q1 - q0 - q2 + q3,
                q2 - q0 - q1 + q3,
                q1 - q0 - q2 - q3,
                q0 + q1 + q2 + q3,
                q0 - q1 - q2 - q3,
            )
            for corner in range(8):
                f = t0 * b[0, corner] + t1 * b[1, corner] + t2 * b[2, corner] + spread[corner]
                force[e, corner, i] = -f


@njit(cache=True, parallel=True)
def gather_accelerations(start, member, force, mass, acceleration):
    """Sum of element forces at each node in a fixed order, over its mass. start, member: rows of 8 element + corner."""
    for p in prange(mass.shape[0]):
        for i in range(3):
            total = 0.0
            for m in range(start[p], start[p + 1]):
                total += force[member[m] // 8, member[m] % 8, i]
            acceleration[p, i] = total / mass[p]
