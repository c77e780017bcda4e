"""Friction on a facet that is touched from its border, with the couple given as on a rigid facet.

The line from the foot to the particle may lie in the facet's plane there, where forces along it turn nothing. The
moment M = -D n x F that goes with a friction F at the height D above the foot, along n, is given as

    f_i = (J^-1 M) x r_i,   J = sum (r_i^2 I - r_i r_i^T),

r_i the corners from their mean: they sum to nothing, turn as they should, and are small however n lies, since J is that
of the facet itself. The slip is what these forces work against, the part across n of v - v_foot - D spin x n,
spin = J^-1 sum r_i x v_i.
"""

from __future__ import annotations

import math

from numba import njit

from birdstrike.solver.kernels.contact.contact import bilinear

ON_A_LINE = 1e-9  # of (trace of J)^3: corners on one line; facets 1000 times as long as wide have more


@njit(cache=True)
def invert_inertia(nodes, quad, corner, inverse):
    """r_i of the corners from their mean, corner: (4, 3) [m], and J^-1, inverse: (3, 3) [1/m^2]; False on a line."""
    xx = yy = zz = xy = xz = yz = 0.0
    for i in range(4):
        for c in range(3):
            mean = 0.25 * (nodes[quad[0], c] + nodes[quad[1], c] + nodes[quad[2], c] + nodes[quad[3], c])
            corner[i, c] = nodes[quad[i], c] - mean
        x, y, z = corner[i, 0], corner[i, 1], corner[i, 2]
        xx, yy, zz = xx + y * y + z * z, yy + x * x + z * z, zz + x * x + y * y
        xy, xz, yz = xy - x * y, xz - x * z, yz - y * z
    a, b, d = yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy
    det = xx * a + xy * b + xz * d
    if det <= ON_A_LINE * (xx + yy + zz) ** 3:
        return False
    inverse[0, 0], inverse[0, 1], inverse[0, 2] = a / det, b / det, d / det
    inverse[1, 1], inverse[1, 2] = (xx * zz - xz * xz) / det, (xz * xy - xx * yz) / det
    inverse[2, 2] = (xx * yy - xy * xy) / det
    inverse[1, 0], inverse[2, 0], inverse[2, 1] = inverse[0, 1], inverse[0, 2], inverse[1, 2]
    return True


@njit(cache=True, inline="always")
def turned_by(inverse, x, y, z):
    """J^-1 times a vector."""
    return (
        inverse[0, 0] * x + inverse[0, 1] * y + inverse[0, 2] * z,
        inverse[1, 0] * x + inverse[1, 1] * y + inverse[1, 2] * z,
        inverse[2, 0] * x + inverse[2, 1] * y + inverse[2, 2] * z,
    )


@njit(cache=True)
def slip_at_border(v, node_v, quad, foot, corner, inverse, slip):
    """Slip (3,) [m/s] across the foot's normal, of a particle with v (3,) against the surface; returns its size."""
    shape = bilinear(foot[0], foot[1])
    lx = ly = lz = 0.0
    for i in range(4):
        x, y, z = corner[i, 0], corner[i, 1], corner[i, 2]
        vx, vy, vz = node_v[quad[i], 0], node_v[quad[i], 1], node_v[quad[i], 2]
        lx, ly, lz = lx + y * vz - z * vy, ly + z * vx - x * vz, lz + x * vy - y * vx
    wx, wy, wz = turned_by(inverse, lx, ly, lz)
    height, nx, ny, nz = foot[2], foot[3], foot[4], foot[5]
    slip[0] = v[0] - height * (wy * nz - wz * ny)
    slip[1] = v[1] - height * (wz * nx - wx * nz)
    slip[2] = v[2] - height * (wx * ny - wy * nx)
    for c in range(3):
        for i in range(4):
            slip[c] -= shape[i] * node_v[quad[i], c]
    rising = slip[0] * nx + slip[1] * ny + slip[2] * nz
    for c in range(3):
        slip[c] -= rising * foot[3 + c]
    return math.sqrt(slip[0] ** 2 + slip[1] ** 2 + slip[2] ** 2)


@njit(cache=True)
def rub_border(most, resistance, v, nodes, node_v, quad, foot, room, force, rub_plate):
    """As `friction.rub_face`, at a border; room (8, 3): the corners, J^-1, and last the slip, out."""
    corner, inverse, slip = room[0:4], room[4:7], room[7]
    slip[0] = slip[1] = slip[2] = 0.0
    if not invert_inertia(nodes, quad, corner, inverse):
        return
    speed = slip_at_border(v, node_v, quad, foot, corner, inverse, slip)
    if speed == 0.0:
        return
    height, nx, ny, nz = foot[2], foot[3], foot[4], foot[5]
    mx = height * (ny * slip[2] - nz * slip[1])
    my = height * (nz * slip[0] - nx * slip[2])
    mz = height * (nx * slip[1] - ny * slip[0])
    tx, ty, tz = turned_by(inverse, mx, my, mz)
    leverage = (mx * tx + my * ty + mz * tz) / speed**2
    size = min(most / speed, resistance / max(leverage, 1.0))
    shape = bilinear(foot[0], foot[1])
    for i in range(4):
        x, y, z = corner[i, 0], corner[i, 1], corner[i, 2]
        rub_plate[quad[i], 0] += size * (slip[0] * shape[i] + ty * z - tz * y)
        rub_plate[quad[i], 1] += size * (slip[1] * shape[i] + tz * x - tx * z)
        rub_plate[quad[i], 2] += size * (slip[2] * shape[i] + tx * y - ty * x)
    for c in range(3):
        force[c] = -size * slip[c]
