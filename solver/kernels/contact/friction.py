"""Coulomb friction of particles on the shell's surface, with the couple that it turns the shell by.

The friction acts on the particle, at the height D above its foot on the mid-surface. For the angular momentum the
shell gets, beside -F at the foot, the moment -D n x F. It is given as forces along n on the facet's corners,

    f_i = D (S^-1 F) . r_i,   S = sum r_i r_i^T,

r_i the corners from their mean, in the tangent plane: they sum to nothing and turn as they should. The slip is what
these forces work against, v - v_foot + D grad(v . n): the particle against the surface carried along at its height.
Hence the friction's power is -|F| |slip|, never positive. A facet that is touched from its border, where n leans far
out of its own normal, is turned otherwise: `border_friction`.
"""

from __future__ import annotations

import math

from numba import njit

from birdstrike.solver.kernels.contact.border_friction import rub_border
from birdstrike.solver.kernels.contact.contact import bilinear

ON_A_LINE = 1e-6  # of (trace of S)^2: a facet whose corners lie so nearly on one carries no friction
FACING = 0.5  # cosine of the foot's normal to the facet's own below which it is touched from its border


@njit(cache=True)
def is_facing(nodes, quad, foot):
    """Whether a facet's own normal is near that of the foot, along the line to the particle."""
    i, j, k, m = quad[0], quad[1], quad[2], quad[3]
    px, py, pz = nodes[k, 0] - nodes[i, 0], nodes[k, 1] - nodes[i, 1], nodes[k, 2] - nodes[i, 2]
    qx, qy, qz = nodes[m, 0] - nodes[j, 0], nodes[m, 1] - nodes[j, 1], nodes[m, 2] - nodes[j, 2]
    nx, ny, nz = py * qz - pz * qy, pz * qx - px * qz, px * qy - py * qx
    along = nx * foot[3] + ny * foot[4] + nz * foot[5]
    return along * along >= FACING * FACING * (nx * nx + ny * ny + nz * nz)


@njit(cache=True, inline="always")
def tangents(foot, base):
    """Two unit vectors across the foot's normal n, base: (2, 3)."""
    nx, ny, nz = foot[3], foot[4], foot[5]
    if abs(nx) > 0.8:
        inverse = 1.0 / math.sqrt(nz * nz + nx * nx)
        base[0, 0], base[0, 1], base[0, 2] = nz * inverse, 0.0, -nx * inverse
    else:
        inverse = 1.0 / math.sqrt(ny * ny + nz * nz)
        base[0, 0], base[0, 1], base[0, 2] = 0.0, nz * inverse, -ny * inverse
    base[1, 0] = ny * base[0, 2] - nz * base[0, 1]
    base[1, 1] = nz * base[0, 0] - nx * base[0, 2]
    base[1, 2] = nx * base[0, 1] - ny * base[0, 0]


@njit(cache=True)
def slip_on_facet(v, nodes, node_v, quad, foot, base, corner, slip):
    """Slip (2,) [m/s] in the tangents `base`, and the corners' r_i in them, corner: (4, 2) [m]; returns S^-1.

    S^-1 is given by its three components [1/m^2], all 0 where the corners lie on one line.
    """
    shape = bilinear(foot[0], foot[1])
    s11 = s12 = s22 = g1 = g2 = 0.0
    for i in range(4):
        for t in range(2):
            corner[i, t] = 0.0
            for c in range(3):
                mean = 0.25 * (nodes[quad[0], c] + nodes[quad[1], c] + nodes[quad[2], c] + nodes[quad[3], c])
                corner[i, t] += (nodes[quad[i], c] - mean) * base[t, c]
        rising = 0.0
        for c in range(3):
            rising += node_v[quad[i], c] * foot[3 + c]
        s11 += corner[i, 0] * corner[i, 0]
        s12 += corner[i, 0] * corner[i, 1]
        s22 += corner[i, 1] * corner[i, 1]
        g1 += corner[i, 0] * rising
        g2 += corner[i, 1] * rising
    det = s11 * s22 - s12 * s12
    if det <= ON_A_LINE * (s11 + s22) ** 2:
        return 0.0, 0.0, 0.0
    i11, i12, i22 = s22 / det, -s12 / det, s11 / det
    slip[0] = foot[2] * (i11 * g1 + i12 * g2)
    slip[1] = foot[2] * (i12 * g1 + i22 * g2)
    for t in range(2):
        for c in range(3):
            carried = 0.0
            for i in range(4):
                carried += shape[i] * node_v[quad[i], c]
            slip[t] += (v[c] - carried) * base[t, c]
    return i11, i12, i22


@njit(cache=True)
def rub_face(most, resistance, v, nodes, node_v, quad, foot, room, force, rub_plate):
    """Friction of a particle with v (3,) on a facet, force (3,) [N], and its opposite added to that on the nodes.

    |F| = min(most, c |slip|) [N], the resistance c [N s/m] lowered where the shell yields to the couple more than to F
    itself; room (8, 3): tangents, corners, slip in them, and last the slip in space [m/s], out.
    """
    base, corner, slip = room[0:2], room[2:6, :2], room[6, :2]
    tangents(foot, base)
    slip[0] = slip[1] = 0.0
    i11, i12, i22 = slip_on_facet(v, nodes, node_v, quad, foot, base, corner, slip)
    for c in range(3):
        room[7, c] = slip[0] * base[0, c] + slip[1] * base[1, c]
    speed = math.sqrt(slip[0] ** 2 + slip[1] ** 2)
    if i11 == 0.0 or speed == 0.0:
        return
    yielding = i11 * slip[0] ** 2 + 2.0 * i12 * slip[0] * slip[1] + i22 * slip[1] ** 2
    leverage = yielding * (foot[2] / speed) ** 2  # sum of f_i^2 over F^2
    size = min(most / speed, resistance / max(leverage, 1.0))
    f1, f2 = -size * slip[0], -size * slip[1]
    g1, g2 = foot[2] * (i11 * f1 + i12 * f2), foot[2] * (i12 * f1 + i22 * f2)
    shape = bilinear(foot[0], foot[1])
    for c in range(3):
        force[c] = f1 * base[0, c] + f2 * base[1, c]
        for i in range(4):
            turn = (g1 * corner[i, 0] + g2 * corner[i, 1]) * foot[3 + c]
            rub_plate[quad[i], c] += turn - force[c] * shape[i]


@njit(cache=True)
def friction_forces(
    n, law, v, nodes, node_v, quads, watched, active, facet, touch, foot, room, own, rub_bird, rub_plate
):
    """Add friction [N] to that on particles (n, 3) and on nodes (m, 3), summed in particle order.

    law: coefficient mu, contact stiffness [N/m], sticking resistance [N s/m], see `rub_face`, most = mu times the
    normal force; touch (n,): where contact begins [m]. v (N, 3), node_v (m, 3) [m/s]: half a step behind; room: (8, 3)
    scratch; own: before and now (n, 3) [N], the friction of this sheet alone. Returns the power [W] that friction gave,
    over the step that ended, to particles of which it took none.
    """
    mu, stiffness, resistance = law
    before, now = own
    given = 0.0
    for a in range(n):
        now[a, 0] = now[a, 1] = now[a, 2] = 0.0
        if not (watched[a] and active[a]) or foot[a, 2] >= touch[a]:
            continue
        most, quad = mu * stiffness * (touch[a] - foot[a, 2]), quads[facet[a]]
        if is_facing(nodes, quad, foot[a]):
            rub_face(most, resistance, v[a], nodes, node_v, quad, foot[a], room, now[a], rub_plate)
        else:
            rub_border(most, resistance, v[a], nodes, node_v, quad, foot[a], room, now[a], rub_plate)
        power = 0.0
        for c in range(3):
            rub_bird[a, c] += now[a, c]
            power += 0.5 * (before[a, c] + now[a, c]) * room[7, c]
        given += max(power, 0.0)
    return given
