"""Frames and one-point gradient operators of four-node shells, in a frame that turns with the element.

T. Belytschko, J. I. Lin & C. S. Tsay, CMAME 42 (1984) 225.

Per element:
    frame (9,): e1, e2, e3 in global axes
    shape (9,): b_x1, b_x2, b_y1, b_y2, area, h.x, h.y, gamma.(x y), h.z   (b of nodes 3, 4 are minus 1, 2)
with h = +1 -1 +1 -1 and gamma = h less its linear part; h.z is the element's warp.
"""

from __future__ import annotations

import math

from numba import njit, prange


@njit(cache=True, inline="always")
def unit(x, y, z):
    """Unit vector along (x, y, z)."""
    inverse = 1.0 / math.sqrt(x * x + y * y + z * z)
    return x * inverse, y * inverse, z * inverse


@njit(cache=True, inline="always")
def local(frame, x, y, z):
    """Components of a global vector in the element's frame."""
    return (
        frame[0] * x + frame[1] * y + frame[2] * z,
        frame[3] * x + frame[4] * y + frame[5] * z,
        frame[6] * x + frame[7] * y + frame[8] * z,
    )


@njit(cache=True, inline="always")
def gradient_and_hourglass(shape, p, q, h):
    """d/dx, d/dy and the hourglass part of a nodal field from its differences p = 1-3, q = 2-4, h = 1-2+3-4."""
    dx = (shape[0] * p + shape[1] * q) / shape[4]
    dy = (shape[2] * p + shape[3] * q) / shape[4]
    return dx, dy, h - shape[5] * dx - shape[6] * dy


@njit(cache=True, inline="always")
def twist_of_corners(x, i, j, k, m, frame, shape):
    """gamma.(x y) [m^2]: the hourglass part of a unit twist w = x y, from corners about their mean."""
    cx, cy, cz = 0.0, 0.0, 0.0
    for node in (i, j, k, m):
        cx, cy, cz = cx + 0.25 * x[node, 0], cy + 0.25 * x[node, 1], cz + 0.25 * x[node, 2]
    x1, y1, _ = local(frame, x[i, 0] - cx, x[i, 1] - cy, x[i, 2] - cz)
    x2, y2, _ = local(frame, x[j, 0] - cx, x[j, 1] - cy, x[j, 2] - cz)
    x3, y3, _ = local(frame, x[k, 0] - cx, x[k, 1] - cy, x[k, 2] - cz)
    x4, y4, _ = local(frame, x[m, 0] - cx, x[m, 1] - cy, x[m, 2] - cz)
    _, _, twist = gradient_and_hourglass(
        shape, x1 * y1 - x3 * y3, x2 * y2 - x4 * y4, x1 * y1 - x2 * y2 + x3 * y3 - x4 * y4
    )
    return twist


@njit(cache=True, parallel=True)
def shell_geometry(x, quads, alive, frame, shape):
    """Frames and one-point gradient operators of the current configuration. x: (m, 3) [m]; quads: (e, 4).

    e3 is normal to both diagonals, e1 runs along the line between the midpoints of two opposite sides.
    """
    for e in prange(quads.shape[0]):
        if not alive[e]:
            continue
        i, j, k, m = quads[e, 0], quads[e, 1], quads[e, 2], quads[e, 3]
        px, py, pz = x[k, 0] - x[i, 0], x[k, 1] - x[i, 1], x[k, 2] - x[i, 2]
        qx, qy, qz = x[m, 0] - x[j, 0], x[m, 1] - x[j, 1], x[m, 2] - x[j, 2]
        nx, ny, nz = unit(py * qz - pz * qy, pz * qx - px * qz, px * qy - py * qx)
        sx, sy, sz = px - qx, py - qy, pz - qz
        along = sx * nx + sy * ny + sz * nz
        ex, ey, ez = unit(sx - along * nx, sy - along * ny, sz - along * nz)
        f = frame[e]
        f[0], f[1], f[2] = ex, ey, ez
        f[3], f[4], f[5] = ny * ez - nz * ey, nz * ex - nx * ez, nx * ey - ny * ex
        f[6], f[7], f[8] = nx, ny, nz
        p1, p2, _ = local(f, px, py, pz)
        q1, q2, _ = local(f, qx, qy, qz)
        hx = x[i, 0] - x[j, 0] + x[k, 0] - x[m, 0]
        hy = x[i, 1] - x[j, 1] + x[k, 1] - x[m, 1]
        hz = x[i, 2] - x[j, 2] + x[k, 2] - x[m, 2]
        shape[e, 0], shape[e, 1] = -0.5 * q2, 0.5 * p2
        shape[e, 2], shape[e, 3] = 0.5 * q1, -0.5 * p1
        shape[e, 4] = 0.5 * (p1 * q2 - p2 * q1)
        shape[e, 5], shape[e, 6], shape[e, 8] = local(f, hx, hy, hz)
        shape[e, 7] = twist_of_corners(x, i, j, k, m, f, shape[e])
