"""Three-node co-rotational shell: geometry, kinematics, stabilisation and nodal forces.

Membrane: constant strain. Plate: the assumed transverse shear of MITC3 (P. S. Lee & K. J. Bathe, Comput. Struct. 82
(2004) 945), the lowest-order edge element of F. Brezzi, M. Fortin & R. Stenberg, Math. Models Methods Appl. Sci. 1
(1991) 125, with the shear stiffness scaled by

    t^2/(t^2 + 0.1 h^2),   h the longest side                 (M. Lyly, R. Stenberg & T. Vihinen, CMAME 110 (1993) 343),

without which linear triangles lock when the plate is thin. Only the tangential shear along each side enters:
e_ij = w_j - w_i + (beta_i + beta_j)/2 . (x_j - x_i). At the centroid this is grad w + mean beta + G kappa with
G = sum_i grad(lambda_i) (x^2, y^2, x y)_i/2 about the centroid: in pure bending it vanishes exactly. The rest of the
edge field turns about the centroid with the curl of the rotations, the one deformation that one point does not see; it
is kept as an elastic stabilisation, integrated exactly. Strains are those of the middle of the step, as in `shell`.

Per element, in its frame:
    frame (9,): e1, e2, e3 in global axes; e1 turns with the best fit of the corners to those at rest
    shape (12,): A dlambda/dx of nodes 1, 2, A dlambda/dy of nodes 1, 2, area A, G (2 x 3 by rows) [m], mean |x|^2 [m^2]
    strain, resultant (8,): as in `shell`; both shears times the root of the scale, so that their product is its power
    hourglass (4,): turning shear [N m^2], drilling of the nodes [N m]
"""

from __future__ import annotations

import math

from numba import njit, prange

from birdstrike.solver.kernels.target.shell import SHEAR_FACTOR
from birdstrike.solver.kernels.target.shell_geometry import local, unit

SHEAR_STABILISATION = 0.1


@njit(cache=True, inline="always")
def corners_in_plane(frame, x, i, j, k):
    """Coordinates (x, y) of three nodes in the element's plane, about their mean."""
    cx, cy, cz = (
        (x[i, 0] + x[j, 0] + x[k, 0]) / 3.0,
        (x[i, 1] + x[j, 1] + x[k, 1]) / 3.0,
        (x[i, 2] + x[j, 2] + x[k, 2]) / 3.0,
    )
    x1, y1, _ = local(frame, x[i, 0] - cx, x[i, 1] - cy, x[i, 2] - cz)
    x2, y2, _ = local(frame, x[j, 0] - cx, x[j, 1] - cy, x[j, 2] - cz)
    return x1, y1, x2, y2, -x1 - x2, -y1 - y2


@njit(cache=True, parallel=True)
def triangle_geometry(x, triangles, alive, rest, frame, shape):
    """Frames and gradient operators of the present configuration. x: (m, 3) [m]; triangles: (e, 3).

    rest (e, 4): of the first two corners at rest, in their own frame about their mean [m]; all 0 before it is known,
    and then e1 runs along the first side.
    """
    for e in prange(triangles.shape[0]):
        if not alive[e]:
            continue
        i, j, k = triangles[e, 0], triangles[e, 1], triangles[e, 2]
        px, py, pz = x[j, 0] - x[i, 0], x[j, 1] - x[i, 1], x[j, 2] - x[i, 2]
        qx, qy, qz = x[k, 0] - x[i, 0], x[k, 1] - x[i, 1], x[k, 2] - x[i, 2]
        nx, ny, nz = unit(py * qz - pz * qy, pz * qx - px * qz, px * qy - py * qx)
        ex, ey, ez = unit(px, py, pz)
        f, s, r = frame[e], shape[e], rest[e]
        f[0], f[1], f[2] = ex, ey, ez
        f[3], f[4], f[5] = ny * ez - nz * ey, nz * ex - nx * ez, nx * ey - ny * ex
        f[6], f[7], f[8] = nx, ny, nz
        x1, y1, x2, y2, x3, y3 = corners_in_plane(f, x, i, j, k)
        r3, t3 = -r[0] - r[2], -r[1] - r[3]
        along = r[0] * x1 + r[1] * y1 + r[2] * x2 + r[3] * y2 + r3 * x3 + t3 * y3
        across = r[0] * y1 - r[1] * x1 + r[2] * y2 - r[3] * x2 + r3 * y3 - t3 * x3
        size = math.sqrt(along * along + across * across)
        if size > 0.0:
            c, d = along / size, across / size
            for a in range(3):
                one, two = f[a], f[3 + a]
                f[a], f[3 + a] = c * one + d * two, c * two - d * one
            x1, y1, x2, y2, x3, y3 = corners_in_plane(f, x, i, j, k)
        s[0], s[1] = 0.5 * (y2 - y3), 0.5 * (y3 - y1)
        s[2], s[3] = 0.5 * (x3 - x2), 0.5 * (x1 - x3)
        area = 0.5 * ((x2 - x1) * (y3 - y1) - (x3 - x1) * (y2 - y1))
        s[4] = area
        bx1, bx2, by1, by2 = s[0] / area, s[1] / area, s[2] / area, s[3] / area
        bx3, by3 = -bx1 - bx2, -by1 - by2
        s[5] = 0.5 * (bx1 * x1 * x1 + bx2 * x2 * x2 + bx3 * x3 * x3)
        s[6] = 0.5 * (bx1 * y1 * y1 + bx2 * y2 * y2 + bx3 * y3 * y3)
        s[7] = 0.5 * (bx1 * x1 * y1 + bx2 * x2 * y2 + bx3 * x3 * y3)
        s[8] = 0.5 * (by1 * x1 * x1 + by2 * x2 * x2 + by3 * x3 * x3)
        s[9] = 0.5 * (by1 * y1 * y1 + by2 * y2 * y2 + by3 * y3 * y3)
        s[10] = 0.5 * (by1 * x1 * y1 + by2 * x2 * y2 + by3 * x3 * y3)
        s[11] = (x1 * x1 + y1 * y1 + x2 * x2 + y2 * y2 + x3 * x3 + y3 * y3) / 12.0


@njit(cache=True, inline="always")
def slopes(shape, one, two, three):
    """d/dx and d/dy of a nodal field."""
    p, q = one - three, two - three
    return (shape[0] * p + shape[1] * q) / shape[4], (shape[2] * p + shape[3] * q) / shape[4]


@njit(cache=True, parallel=True)
def triangle_strain(v, omega, triangles, alive, frame, shape, shear_root, dt, strain, hourglass_strain):
    """Increments of strain, curvature and stabilising modes over dt. v, omega: (m, 3) [m/s, rad/s].

    shear_root (e,): root of the scale of the shear stiffness; out: strain (e, 8), hourglass_strain (e, 4) [1/m, 3 rad].
    """
    for e in prange(triangles.shape[0]):
        if not alive[e]:
            strain[e, :] = 0.0
            continue
        i, j, k = triangles[e, 0], triangles[e, 1], triangles[e, 2]
        f, s = frame[e], shape[e]
        i1, i2, i3 = local(f, v[i, 0], v[i, 1], v[i, 2])
        j1, j2, j3 = local(f, v[j, 0], v[j, 1], v[j, 2])
        k1, k2, k3 = local(f, v[k, 0], v[k, 1], v[k, 2])
        ux, uy = slopes(s, i1, j1, k1)
        vx, vy = slopes(s, i2, j2, k2)
        wx, wy = slopes(s, i3, j3, k3)
        o1, o2, o3 = local(f, omega[i, 0], omega[i, 1], omega[i, 2])
        p1, p2, p3 = local(f, omega[j, 0], omega[j, 1], omega[j, 2])
        q1, q2, q3 = local(f, omega[k, 0], omega[k, 1], omega[k, 2])
        ax, ay = slopes(s, o1, p1, q1)
        bx, by = slopes(s, o2, p2, q2)
        d = strain[e]
        half = 0.5 * dt
        d[0] = dt * (ux + half * (ux * ux + uy * vx - wx * wx))
        d[1] = dt * (vy + half * (vy * vy + uy * vx - wy * wy))
        d[2] = dt * (uy + vx + half * ((ux + vy) * (uy + vx) - 2.0 * wx * wy))
        d[3], d[4], d[5] = dt * bx, -dt * ay, dt * (by - ax)
        turn_x, turn_y = (o2 + p2 + q2) / 3.0, -(o1 + p1 + q1) / 3.0
        bent_x = s[5] * d[3] + s[6] * d[4] + s[7] * d[5]
        bent_y = s[8] * d[3] + s[9] * d[4] + s[10] * d[5]
        d[6] = shear_root[e] * (dt * (wx + turn_x + half * (wx * ux + wy * vx)) + bent_x)
        d[7] = shear_root[e] * (dt * (wy + turn_y + half * (wx * uy + wy * vy)) + bent_y)
        g = hourglass_strain[e]
        spin = 0.5 * (vx - uy)
        g[0] = -0.5 * dt * (ax + by)
        g[1], g[2], g[3] = dt * (o3 - spin), dt * (p3 - spin), dt * (q3 - spin)


@njit(cache=True, parallel=True)
def triangle_hourglass(strain, shape, alive, shear_root, section, elastic, coefficient, hourglass, work):
    """Resultants of the stabilising modes; work [J] of the step per element.

    strain: (e, 4); section: (e,); elastic: thickness [m], E [Pa], nu of each section (s, 3); coefficient: of drilling,
    0.01 to 0.1.
    """
    for e in prange(shape.shape[0]):
        work[e] = 0.0
        if not alive[e]:
            continue
        thickness, young, nu = elastic[section[e], 0], elastic[section[e], 1], elastic[section[e], 2]
        whole = SHEAR_FACTOR * young / (2.0 * (1.0 + nu)) * thickness * shape[e, 4]
        turning, drilling = whole * shear_root[e] ** 2 * shape[e, 11], coefficient * whole / 3.0
        for i in range(4):
            before = hourglass[e, i]
            hourglass[e, i] += (turning if i == 0 else drilling) * strain[e, i]
            work[e] += 0.5 * (before + hourglass[e, i]) * strain[e, i]


@njit(cache=True, parallel=True)
def triangle_forces(frame, shape, alive, shear_root, resultant, hourglass, force):
    """Internal forces and moments on the nodes in global axes; force: (e, 4, 6) [N, N m], the fourth row unused.

    The transpose of `triangle_strain` in the limit of small steps.
    """
    for e in prange(shape.shape[0]):
        if not alive[e]:
            force[e, :, :] = 0.0
            continue
        f, s, r, g = frame[e], shape[e], resultant[e], hourglass[e]
        area = s[4]
        qx, qy = shear_root[e] * r[6], shear_root[e] * r[7]
        m_x = r[3] + s[5] * qx + s[8] * qy
        m_y = r[4] + s[6] * qx + s[9] * qy
        m_xy = r[5] + s[7] * qx + s[10] * qy
        spin, turning = 0.5 * (g[1] + g[2] + g[3]) / area, 0.5 * g[0] / area
        for node in range(3):
            bx = s[node] if node < 2 else -s[0] - s[1]
            by = s[2 + node] if node < 2 else -s[2] - s[3]
            f1 = bx * r[0] + by * (r[2] + spin)
            f2 = by * r[1] + bx * (r[2] - spin)
            f3 = bx * qx + by * qy
            m1 = -by * m_y - bx * (m_xy + turning) - area / 3.0 * qy
            m2 = bx * m_x + by * (m_xy - turning) + area / 3.0 * qx
            for i in range(3):
                force[e, node, i] = -(f[i] * f1 + f[3 + i] * f2 + f[6 + i] * f3)
                force[e, node, 3 + i] = -(f[i] * m1 + f[3 + i] * m2 + f[6 + i] * g[1 + node])
