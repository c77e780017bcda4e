"""Feet of perpendiculars on triangular facets, in the coordinates of quadrilaterals whose last node is there twice.

With the corners' areas l1, l2, l3 these are xi = (l2 - l1)/(l2 + l1) and eta = 2 l3 - 1, so that the shape functions of
a quadrilateral give its corners their areas. Beyond a side the coordinate belonging to it grows with the distance:
xi < -1 beyond the side from the third corner to the first, xi > 1 beyond that from the second to the third, eta < -1
beyond that from the first to the second. Beyond the first two at once eta is above 1, by less than xi.
"""

from __future__ import annotations

import math

from numba import njit


@njit(cache=True)
def foot_on_triangle(point, nodes, quad, foot):
    """As `contact.foot_on_facet`, exact and without iteration."""
    i, j, k = quad[0], quad[1], quad[2]
    ax, ay, az = nodes[j, 0] - nodes[i, 0], nodes[j, 1] - nodes[i, 1], nodes[j, 2] - nodes[i, 2]
    bx, by, bz = nodes[k, 0] - nodes[i, 0], nodes[k, 1] - nodes[i, 1], nodes[k, 2] - nodes[i, 2]
    nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    squared = nx * nx + ny * ny + nz * nz
    if squared <= 0.0:
        return False
    px, py, pz = point[0] - nodes[i, 0], point[1] - nodes[i, 1], point[2] - nodes[i, 2]
    second = ((py * bz - pz * by) * nx + (pz * bx - px * bz) * ny + (px * by - py * bx) * nz) / squared
    third = ((ay * pz - az * py) * nx + (az * px - ax * pz) * ny + (ax * py - ay * px) * nz) / squared
    place_in_triangle(1.0 - second - third, second, third, foot)
    inverse = 1.0 / math.sqrt(squared)
    foot[2] = (px * nx + py * ny + pz * nz) * inverse
    foot[3], foot[4], foot[5] = nx * inverse, ny * inverse, nz * inverse
    return True


@njit(cache=True)
def place_in_triangle(first, second, third, foot):
    """xi and eta of the areas of the corners into foot[0:2]."""
    if first < 0.0 and second < 0.0:
        foot[0] = 1.0 - 2.0 * first if first <= second else -1.0 + 2.0 * second
        foot[1] = 1.0 - 2.0 * max(first, second)
        return
    foot[1] = min(2.0 * third - 1.0, 1.0)
    if first < 0.0:
        foot[0] = 1.0 - 2.0 * first
    elif second < 0.0:
        foot[0] = -1.0 + 2.0 * second
    else:
        foot[0] = (second - first) / (second + first) if second + first > 0.0 else 0.0


@njit(cache=True)
def share_along(point, nodes, one, other):
    """Where on the side between two nodes a point is nearest, 0 to 1, and its squared distance from there [m^2]."""
    along = squared = 0.0
    for c in range(3):
        side = nodes[other, c] - nodes[one, c]
        along += side * (point[c] - nodes[one, c])
        squared += side * side
    share = min(max(along / squared, 0.0), 1.0)
    distance = 0.0
    for c in range(3):
        distance += (point[c] - nodes[one, c] - share * (nodes[other, c] - nodes[one, c])) ** 2
    return share, distance


@njit(cache=True)
def clamp_to_triangle(point, nodes, quad, foot):
    """As `contact.clamp_to_facet`: nearest point of the triangle, the normal along the line from there to the point."""
    i, j, k = quad[0], quad[1], quad[2]
    if not foot_on_triangle(point, nodes, quad, foot):
        return
    side = 1.0 if foot[2] >= 0.0 else -1.0
    if abs(foot[0]) > 1.0 or abs(foot[1]) > 1.0:
        a, first = share_along(point, nodes, i, j)
        b, second = share_along(point, nodes, j, k)
        c, third = share_along(point, nodes, k, i)
        if first <= second and first <= third:
            place_in_triangle(1.0 - a, a, 0.0, foot)
        elif second <= third:
            place_in_triangle(0.0, 1.0 - b, b, foot)
        else:
            place_in_triangle(c, 0.0, 1.0 - c, foot)
    third = 0.5 * (1.0 + foot[1])
    second = 0.5 * (1.0 + foot[0]) * (1.0 - third)
    first = 1.0 - second - third
    squared = 0.0
    for c in range(3):
        surface = first * nodes[i, c] + second * nodes[j, c] + third * nodes[k, c]
        foot[3 + c] = side * (point[c] - surface)
        squared += foot[3 + c] ** 2
    distance = math.sqrt(squared)
    foot[2] = side * distance
    if distance > 0.0:
        for c in range(3):
            foot[3 + c] /= distance
    else:
        foot_on_triangle(point, nodes, quad, foot)
