"""Penalty contact of particles with the shell's surface: feet on facets and normal forces (friction: `friction`).

A particle or node touches where its distance from the mid-surface is below gap = half the thickness + the bird's skin.
The force acts along the normal of the facet through the foot of the perpendicular, so the pair of forces is equal,
opposite and on one line: linear and angular momentum are kept, the moment about the mid-surface included.
"""

from __future__ import annotations

import math

from numba import njit, prange

from birdstrike.solver.kernels.contact.triangle_contact import clamp_to_triangle, foot_on_triangle

OUTSIDE = 1.0 + 1e-9


@njit(cache=True, inline="always")
def bilinear(xi, eta):
    """Shape functions of the four corners at (xi, eta) in [-1, 1]^2."""
    return (
        0.25 * (1.0 - xi) * (1.0 - eta),
        0.25 * (1.0 + xi) * (1.0 - eta),
        0.25 * (1.0 + xi) * (1.0 + eta),
        0.25 * (1.0 - xi) * (1.0 + eta),
    )


@njit(cache=True)
def foot_on_facet(point, nodes, quad, foot):
    """Foot of the perpendicular on the facet's bilinear surface by Gauss-Newton. foot: xi, eta, distance, normal (3).

    The distance is signed along the normal; xi and eta may lie outside [-1, 1]. Returns False if the facet is void.
    """
    i, j, k, m = quad[0], quad[1], quad[2], quad[3]
    if k == m:
        return foot_on_triangle(point, nodes, quad, foot)
    xi, eta = foot[0], foot[1]
    for _ in range(12):
        n1, n2, n3, n4 = bilinear(xi, eta)
        g11 = g12 = g22 = r1 = r2 = 0.0
        for c in range(3):
            a, b, d, e = nodes[i, c], nodes[j, c], nodes[k, c], nodes[m, c]
            t1 = 0.25 * ((b - a) * (1.0 - eta) + (d - e) * (1.0 + eta))
            t2 = 0.25 * ((e - a) * (1.0 - xi) + (d - b) * (1.0 + xi))
            gap = point[c] - (n1 * a + n2 * b + n3 * d + n4 * e)
            g11 += t1 * t1
            g12 += t1 * t2
            g22 += t2 * t2
            r1 += t1 * gap
            r2 += t2 * gap
        det = g11 * g22 - g12 * g12
        if det <= 0.0:
            return False
        step1, step2 = (g22 * r1 - g12 * r2) / det, (g11 * r2 - g12 * r1) / det
        xi = min(max(xi + step1, -4.0), 4.0)
        eta = min(max(eta + step2, -4.0), 4.0)
        if abs(step1) + abs(step2) < 1e-9:
            break
    foot[0], foot[1] = xi, eta
    set_normal(point, nodes, quad, foot)
    return True


@njit(cache=True, inline="always")
def set_normal(point, nodes, quad, foot):
    """Facet normal at (xi, eta) and the signed distance of the point along it, into foot[2:6]."""
    i, j, k, m = quad[0], quad[1], quad[2], quad[3]
    xi, eta = foot[0], foot[1]
    n1, n2, n3, n4 = bilinear(xi, eta)
    s = 0.25 * (1.0 - eta)
    t = 0.25 * (1.0 + eta)
    u = 0.25 * (1.0 - xi)
    w = 0.25 * (1.0 + xi)
    ax = s * (nodes[j, 0] - nodes[i, 0]) + t * (nodes[k, 0] - nodes[m, 0])
    ay = s * (nodes[j, 1] - nodes[i, 1]) + t * (nodes[k, 1] - nodes[m, 1])
    az = s * (nodes[j, 2] - nodes[i, 2]) + t * (nodes[k, 2] - nodes[m, 2])
    bx = u * (nodes[m, 0] - nodes[i, 0]) + w * (nodes[k, 0] - nodes[j, 0])
    by = u * (nodes[m, 1] - nodes[i, 1]) + w * (nodes[k, 1] - nodes[j, 1])
    bz = u * (nodes[m, 2] - nodes[i, 2]) + w * (nodes[k, 2] - nodes[j, 2])
    nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    inverse = 1.0 / math.sqrt(nx * nx + ny * ny + nz * nz)
    foot[3], foot[4], foot[5] = nx * inverse, ny * inverse, nz * inverse
    distance = 0.0
    for c in range(3):
        surface = n1 * nodes[i, c] + n2 * nodes[j, c] + n3 * nodes[k, c] + n4 * nodes[m, c]
        distance += (point[c] - surface) * foot[3 + c]
    foot[2] = distance


@njit(cache=True)
def clamp_to_facet(point, nodes, quad, foot):
    """Nearest point on the facet's edge: the normal becomes the line from there to the particle (a ridge)."""
    if quad[2] == quad[3]:
        clamp_to_triangle(point, nodes, quad, foot)
        return
    foot[0] = min(max(foot[0], -1.0), 1.0)
    foot[1] = min(max(foot[1], -1.0), 1.0)
    set_normal(point, nodes, quad, foot)
    shape = bilinear(foot[0], foot[1])
    side = 1.0 if foot[2] >= 0.0 else -1.0
    squared = 0.0
    for c in range(3):
        surface = 0.0
        for corner in range(4):
            surface += shape[corner] * nodes[quad[corner], c]
        foot[3 + c] = side * (point[c] - surface)
        squared += foot[3 + c] ** 2
    distance = math.sqrt(squared)
    if distance > 0.0:
        foot[2] = side * distance
        for c in range(3):
            foot[3 + c] /= distance
    else:
        set_normal(point, nodes, quad, foot)


@njit(cache=True, inline="always")
def beyond_side(across, alive, facet, side):
    """Facet beyond a side; -1 at the rim, which is also where the neighbour has torn."""
    neighbour = across[facet, side]
    return neighbour if neighbour >= 0 and alive[neighbour] else -1


@njit(cache=True, inline="always")
def sides_beyond(quad, xi, eta):
    """The two sides of a facet that a foot at (xi, eta) may be beyond, the one that it is farther beyond first."""
    along, across_it = (0 if xi < 0.0 else 1), (2 if eta < 0.0 else 3)
    if across_it == 3 and quad[2] == quad[3]:
        across_it = 1 - along  # a triangle has no fourth side
    return (along, across_it) if abs(xi) > abs(eta) else (across_it, along)


@njit(cache=True)
def walk_to_foot(point, nodes, quads, across, alive, facet, foot):
    """The facet that holds the foot, walking from `facet` over its sides; sets foot, infinitely far beyond the rim.

    The walk leaves by the side that the foot is farthest beyond; where that is rim, by the other that it is beyond.
    """
    came_from = -1
    for _ in range(64):
        if not (alive[facet] and foot_on_facet(point, nodes, quads[facet], foot)):
            break
        xi, eta = foot[0], foot[1]
        if abs(xi) <= OUTSIDE and abs(eta) <= OUTSIDE:
            return facet
        first, second = sides_beyond(quads[facet], xi, eta)
        beyond = beyond_side(across, alive, facet, first)
        around = beyond < 0
        if around and min(abs(xi), abs(eta)) > OUTSIDE:
            beyond = beyond_side(across, alive, facet, second)
        if beyond < 0 or (around and beyond == came_from):
            break
        if beyond == came_from:
            clamp_to_facet(point, nodes, quads[facet], foot)
            return facet
        came_from = facet
        facet = beyond
        foot[0] = foot[1] = 0.0
    foot[2] = math.inf
    return facet


@njit(cache=True, parallel=True)
def follow_facets(followed, x, nodes, quads, across, alive, gap, facet, foot, past_rim):
    """Foot of each particle that is followed, walking to the neighbouring facet when it leaves its own.

    followed: (k,) particle numbers, shared out among the threads; of all particles most would fall to one of them;
    across: (e, 4) facet beyond the sides xi < -1, xi > 1, eta < -1, eta > 1, or -1 at the rim; alive: (e,) facets that
    have not torn; in and out: facet (n,), foot (n, 6), past_rim (n,). Beyond the rim, and over a torn facet, the
    distance is set to infinity: nothing to touch there. A particle that comes back from there within the gap (e,) [m]
    came in from beside: the springs know nothing of it until it has been clear of the surface on the impact side, for a
    spring that starts stretched would make energy from nothing.
    """
    for i in prange(followed.shape[0]):
        a = followed[i]
        facet[a] = walk_to_foot(x[a], nodes, quads, across, alive, facet[a], foot[a])
        past_rim[a] = foot[a, 2] == math.inf or (past_rim[a] and foot[a, 2] < gap[facet[a]])
        if past_rim[a]:
            foot[a, 2] = math.inf


@njit(cache=True)
def contact_forces(n, room, stiffness, quads, watched, active, facet, touch, foot, overlaps, on_bird, on_plate):
    """Add contact forces [N] to those on particles (n, 3) and on nodes (m, 3), summed in particle order.

    touch (n,): the distance from the mid-surface at which contact begins [m]; room: how much more than that is the
    overlap beyond which a particle has passed through [m]; stiffness [N/m]; out: overlaps (n,) [m].
    Returns the number of touching particles, the deepest overlap [m], the energy in the springs [J], and how many have
    passed.
    """
    touching = passed = 0
    deepest = 0.0
    stored = 0.0
    for a in range(n):
        overlaps[a] = 0.0
        if not (watched[a] and active[a]) or foot[a, 2] >= touch[a]:
            continue
        overlap = touch[a] - foot[a, 2]
        overlaps[a] = overlap
        shape = bilinear(foot[a, 0], foot[a, 1])
        for c in range(3):
            force = stiffness * overlap * foot[a, 3 + c]
            on_bird[a, c] += force
            for corner in range(4):
                on_plate[quads[facet[a], corner], c] -= force * shape[corner]
        touching += 1
        deepest = max(deepest, overlap)
        stored += 0.5 * stiffness * overlap * overlap
        passed += overlap > touch[a] + room
    return touching, deepest, stored, passed
