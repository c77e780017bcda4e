"""Four-node one-point co-rotational shell: kinematics, hourglass control and nodal forces.

T. Belytschko, J. I. Lin & C. S. Tsay, CMAME 42 (1984) 225: bilinear Mindlin shell, velocity strains at the centre in
a frame that turns with the element; stabilised by hourglass stiffnesses on membrane, bending and deflection modes.
The deflection's hourglass mode is taken relative to the element's twist, w_xy = -curvature xy/2 of a thin plate:
without that the paper's stiffness, which grows as the mesh is refined, adds a fixed 2 % to the plate's twisting
rigidity (0.15 % to the frequencies of a clamped plate) on every mesh.

Two terms keep rigid motion free of strain. Strains are those of the middle of the step, D + dt/2 sym(L^2) from the
gradient L in the configuration that ended it (L_a3 = -L_3a: the normal turns with the surface); without that a spinning
shell would gain the strain angle^2/2 at every step. And the membrane's hourglass modes of a warped element are taken
less what its tilting alone gives them.

Per element, in its frame (see shell_geometry):
    strain (8,): xx yy xy | curvature xx yy xy | shear xz yz (engineering xy, xz, yz), increments
    resultant (8,): forces xx yy xy [N/m] | moments xx yy xy [N] | shear xz yz [N/m]
    hourglass (9,): bending x, bending y [N m], deflection, membrane x, membrane y [N], drilling of the nodes [N m]

Drilling is a node's turn about the normal less the element's own spin. A weak spring on it keeps the facets of a curved
shell from passing their bending into it; without it the Scordelis-Lo roof deflects half as much again.
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from birdstrike.solver.kernels.target.shell_geometry import gradient_and_hourglass, local

SHEAR_FACTOR = 5.0 / 6.0


@njit(cache=True, parallel=True)
def shell_strain(v, omega, quads, alive, frame, shape, dt, strain, hourglass_strain):
    """Increments of strain, curvature and hourglass modes over dt. v, omega: (m, 3) [m/s, rad/s].

    out: strain (e, 8), hourglass_strain (e, 9) [rad, rad, m, m, m, 4 rad].
    """
    for e in prange(quads.shape[0]):
        if not alive[e]:
            strain[e, :] = 0.0  # a gauge on it has read its last
            continue
        i, j, k, m = quads[e, 0], quads[e, 1], quads[e, 2], quads[e, 3]
        f, s = frame[e], shape[e]
        p1, p2, p3 = local(f, v[i, 0] - v[k, 0], v[i, 1] - v[k, 1], v[i, 2] - v[k, 2])
        q1, q2, q3 = local(f, v[j, 0] - v[m, 0], v[j, 1] - v[m, 1], v[j, 2] - v[m, 2])
        h1, h2, h3 = local(
            f,
            v[i, 0] - v[j, 0] + v[k, 0] - v[m, 0],
            v[i, 1] - v[j, 1] + v[k, 1] - v[m, 1],
            v[i, 2] - v[j, 2] + v[k, 2] - v[m, 2],
        )
        ux, uy, hu = gradient_and_hourglass(s, p1, q1, h1)
        vx, vy, hv = gradient_and_hourglass(s, p2, q2, h2)
        wx, wy, hw = gradient_and_hourglass(s, p3, q3, h3)
        i1, i2, i3 = local(f, omega[i, 0], omega[i, 1], omega[i, 2])
        j1, j2, j3 = local(f, omega[j, 0], omega[j, 1], omega[j, 2])
        k1, k2, k3 = local(f, omega[k, 0], omega[k, 1], omega[k, 2])
        m1, m2, m3 = local(f, omega[m, 0], omega[m, 1], omega[m, 2])
        ax, ay, ha = gradient_and_hourglass(s, i1 - k1, j1 - m1, i1 - j1 + k1 - m1)
        bx, by, hb = gradient_and_hourglass(s, i2 - k2, j2 - m2, i2 - j2 + k2 - m2)
        d = strain[e]
        half = 0.5 * dt
        d[0] = dt * (ux + half * (ux * ux + uy * vx - wx * wx))
        d[1] = dt * (vy + half * (vy * vy + uy * vx - wy * wy))
        d[2] = dt * (uy + vx + half * ((ux + vy) * (uy + vx) - 2.0 * wx * wy))
        d[3], d[4], d[5] = dt * bx, -dt * ay, dt * (by - ax)
        d[6] = dt * (wx + 0.25 * (i2 + j2 + k2 + m2) + half * (wx * ux + wy * vx))
        d[7] = dt * (wy - 0.25 * (i1 + j1 + k1 + m1) + half * (wx * uy + wy * vy))
        g = hourglass_strain[e]
        g[0], g[1], g[2] = dt * ha, dt * hb, dt * hw + 0.5 * s[7] * d[5]
        g[3], g[4] = dt * (hu + s[8] * wx), dt * (hv + s[8] * wy)
        spin = 0.5 * (vx - uy)
        g[5], g[6], g[7], g[8] = dt * (i3 - spin), dt * (j3 - spin), dt * (k3 - spin), dt * (m3 - spin)


@njit(cache=True, parallel=True)
def shell_hourglass(hourglass_strain, shape, alive, section, elastic, coefficient, hourglass, work):
    """Hourglass resultants by the stiffnesses of Belytschko, Lin & Tsay (1984); work [J] of the step per element.

    section: (e,); elastic: thickness [m], E [Pa], nu of each section (s, 3); coefficient: dimensionless, 0.01 to 0.1.
    """
    for e in prange(shape.shape[0]):
        work[e] = 0.0
        if not alive[e]:
            continue
        thickness, young, nu = elastic[section[e], 0], elastic[section[e], 1], elastic[section[e], 2]
        shear = SHEAR_FACTOR * young / (2.0 * (1.0 + nu))
        area = shape[e, 4]
        bb = 2.0 * (shape[e, 0] ** 2 + shape[e, 1] ** 2 + shape[e, 2] ** 2 + shape[e, 3] ** 2)
        bending = coefficient * young * thickness**3 * bb / (192.0 * area)
        deflection = coefficient * shear * thickness**3 * bb / (12.0 * area * area)
        membrane = coefficient * young * thickness * bb / (8.0 * area)
        drilling = 0.25 * coefficient * shear * thickness * area
        for i in range(9):
            stiffness = bending if i < 2 else (deflection if i == 2 else (membrane if i < 5 else drilling))
            before = hourglass[e, i]
            hourglass[e, i] += stiffness * hourglass_strain[e, i]
            work[e] += 0.5 * (before + hourglass[e, i]) * hourglass_strain[e, i]


@njit(cache=True, parallel=True)
def shell_forces(frame, shape, alive, resultant, hourglass, force):
    """Internal forces and moments on the four nodes in global axes; force: (e, 4, 6) [N, N m], acting on the nodes.

    The transpose of `shell_strain` in the limit of small steps: the power of these forces is area * resultant . strain
    rate + hourglass power.
    """
    for e in prange(shape.shape[0]):
        if not alive[e]:
            force[e, :, :] = 0.0
            continue
        f, s, r, g = frame[e], shape[e], resultant[e], hourglass[e]
        area = s[4]
        hx, hy = s[5] / area, s[6] / area
        twisting = r[5] + 0.5 * s[7] / area * g[2]
        shear_x, shear_y = r[6] + s[8] / area * g[3], r[7] + s[8] / area * g[4]
        spin = 0.5 * (g[5] + g[6] + g[7] + g[8]) / area
        for node in range(4):
            sign = 1.0 if node < 2 else -1.0
            bx, by = sign * s[node % 2], sign * s[2 + node % 2]
            gamma = (1.0 if node % 2 == 0 else -1.0) - hx * bx - hy * by
            f1 = bx * r[0] + by * (r[2] + spin) + gamma * g[3]
            f2 = by * r[1] + bx * (r[2] - spin) + gamma * g[4]
            f3 = bx * shear_x + by * shear_y + gamma * g[2]
            m1 = -by * r[4] - bx * twisting - 0.25 * area * r[7] + gamma * g[0]
            m2 = bx * r[3] + by * twisting + 0.25 * area * r[6] + gamma * g[1]
            for i in range(3):
                force[e, node, i] = -(f[i] * f1 + f[3 + i] * f2 + f[6 + i] * f3)
                force[e, node, 3 + i] = -(f[i] * m1 + f[3 + i] * m2 + f[6 + i] * g[5 + node])


@njit(cache=True, parallel=True)
def gather_nodal_forces(start, member, force, nodal):
    """Add the element forces at each node to `nodal` in a fixed order; start, member: rows of 4 element + corner."""
    for p in prange(nodal.shape[0]):
        fx = fy = fz = mx = my = mz = 0.0
        for m in range(start[p], start[p + 1]):
            place = np.uint64(member[m])
            f = force[place >> np.uint64(2), place & np.uint64(3)]
            fx, fy, fz = fx + f[0], fy + f[1], fz + f[2]
            mx, my, mz = mx + f[3], my + f[4], mz + f[5]
        nodal[p, 0] += fx
        nodal[p, 1] += fy
        nodal[p, 2] += fz
        nodal[p, 3] += mx
        nodal[p, 4] += my
        nodal[p, 5] += mz
