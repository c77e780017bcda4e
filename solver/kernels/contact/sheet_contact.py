"""Feet of particles on sheets of facets that can be touched from both sides and at their borders.

A sheet is a part of the surface on which every side of a facet has at most one neighbour (see `target.sheets`). A
particle touches it at the point that is nearest: between facets that face each other as in a valley, no less than over
a ridge, so that what a spring stores never jumps. Over a sheet's inside a particle stays on the side that it came from,
however deep it is pressed; beyond a border it touches the border's edge, along the line from there, and may change
sides. Where sheets meet at an edge, one of them lets it be touched, by what is over none of them.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit, prange

from birdstrike.solver.kernels.contact.contact import OUTSIDE, beyond_side, clamp_to_facet, foot_on_facet, sides_beyond
from birdstrike.solver.kernels.contact.triangle_contact import share_along

INSIDE, NOTHING = -1, -2
HOLE = 32
"""Torn facets of a hole that are looked around, the nearest by sides first."""
FAN = 32
"""Facets around a node that are looked at, either way."""
FREE, OWN = -1, -2
NEARER = 1.0 - 1e-9
"""Of a distance, by which another facet must be nearer: on a ridge both are as far, and the particle stays."""


@njit(cache=True)
def nearest_on_facet(point, nodes, quad, foot):
    """As `foot_on_facet`, at the facet's nearest point: on its edge the normal is the line from there to the point."""
    if not foot_on_facet(point, nodes, quad, foot):
        return False
    if abs(foot[0]) <= OUTSIDE and abs(foot[1]) <= OUTSIDE:
        return True
    if quad[2] != quad[3]:
        least = math.inf
        for side in range(4):
            one, other = ends_of_side(quad, side)
            share, squared = share_along(point, nodes, one, other)
            if squared < least:
                least = squared
                along, end = 2.0 * share - 1.0, -1.0 if side % 2 == 0 else 1.0
                foot[0], foot[1] = (end, along) if side < 2 else (along, end)
    clamp_to_facet(point, nodes, quad, foot)
    return True


@njit(cache=True, inline="always")
def ends_of_side(quad, side):
    """Nodes of a quadrilateral's side, in the order in which its coordinate grows."""
    if side == 0:
        return quad[0], quad[3]
    if side == 1:
        return quad[1], quad[2]
    if side == 2:
        return quad[0], quad[1]
    return quad[3], quad[2]


@njit(cache=True, inline="always")
def is_on_side(quad, xi, eta, side):
    """Whether a nearest point is on a side of the facet; at a triangle's tip it is on two, whatever xi."""
    if side > 1:
        return eta <= -1.0 if side == 2 else eta >= 1.0
    at_tip = eta >= 1.0 and quad[2] == quad[3]
    return at_tip or (xi <= -1.0 if side == 0 else xi >= 1.0)


@njit(cache=True)
def may_be_nearer(point, nodes, quad, foot):
    """False where no point of a facet is nearer to the point than foot, as its corners alone tell, without iteration.

    With w from the foot to the point, s from the foot to q, and t the part of s across w, q is nearer where
    |t|^2 < 2 s.w - (s.w/|w|)^2. A facet lies within the hull of its corners, so that s.w is at most their largest, and
    |t| at least their smallest share along any direction across w: here that of the facet's middle.
    """
    wx, wy, wz = foot[2] * foot[3], foot[2] * foot[4], foot[2] * foot[5]
    bx, by, bz = wx - point[0], wy - point[1], wz - point[2]  # less the foot
    squared = wx * wx + wy * wy + wz * wz
    mx = my = mz = 0.0
    highest = 0.0
    for corner in range(4):
        x, y, z = nodes[quad[corner], 0] + bx, nodes[quad[corner], 1] + by, nodes[quad[corner], 2] + bz
        highest = max(highest, x * wx + y * wy + z * wz)
        mx, my, mz = mx + x, my + y, mz + z
    if highest <= 0.0:
        return False
    up = (mx * wx + my * wy + mz * wz) / squared
    mx, my, mz = mx - up * wx, my - up * wy, mz - up * wz
    least = math.inf
    for corner in range(4):
        x, y, z = nodes[quad[corner], 0] + bx, nodes[quad[corner], 1] + by, nodes[quad[corner], 2] + bz
        least = min(least, x * mx + y * my + z * mz)
    return least <= 0.0 or least * least < 2.0 * highest * (mx * mx + my * my + mz * mz)


@njit(cache=True)
def nearer_of(point, nodes, quads, facet, other, foot, room):
    """The other facet where it is nearer to the point than foot, which is then there; else the facet."""
    if not may_be_nearer(point, nodes, quads[other], foot):
        return facet
    room[0] = room[1] = 0.0
    if not nearest_on_facet(point, nodes, quads[other], room) or abs(room[2]) >= NEARER * abs(foot[2]):
        return facet
    foot[:] = room
    return other


@njit(cache=True)
def nearest_around_hole(point, nodes, quads, across, alive, facet, torn, foot, room):
    """As `nearer_of`, of the facets around the hole that a torn facet is in; around its first HOLE if it is larger."""
    hole = np.empty(HOLE, np.int64)
    hole[0], count, at = torn, 1, 0
    while at < count:
        for side in range(4):
            other = across[hole[at], side]
            if other < 0 or other == facet:
                continue
            if alive[other]:
                facet = nearer_of(point, nodes, quads, facet, other, foot, room)
            elif count < HOLE and not (hole[:count] == other).any():
                hole[count] = other
                count += 1
        at += 1
    return facet


@njit(cache=True)
def nearest_beside(point, nodes, quads, across, alive, facet, foot, room):
    """As `nearer_of`, of the facets and the holes beyond the sides that the point may be beyond."""
    first, second = sides_beyond(quads[facet], foot[0], foot[1])
    nearest = facet
    for side in (first, second):
        beyond = across[facet, side]
        if beyond < 0:
            continue
        if alive[beyond]:
            nearest = nearer_of(point, nodes, quads, nearest, beyond, foot, room)
        else:
            nearest = nearest_around_hole(point, nodes, quads, across, alive, nearest, beyond, foot, room)
    return nearest


@njit(cache=True, inline="always")
def node_at(quad, xi, eta):
    """The corner of a triangle that a nearest point is on, by its node; -1 where it is on none."""
    if eta >= 1.0:
        return quad[2]
    if abs(xi) < 1.0 or eta > -1.0:
        return -1
    return quad[0] if xi < 0.0 else quad[1]


@njit(cache=True, inline="always")
def is_end_of_side(quad, side, node):
    """Whether a node ends a side of the facet; of a triangle's last side, which is a point, none does."""
    one, other = ends_of_side(quad, side)
    return one != other and node in (one, other)


@njit(cache=True)
def nearest_around_node(point, nodes, quads, across, alive, facet, node, foot, room):
    """As `nearer_of`, of the facets around a node, from `facet` on either way to a border, a tear, or all around.

    Where the foot is a node, the facets beside may have it nearest as well, and one farther around be nearer. Of
    quadrilaterals, four to a node, the two beside a facet are all that can be.
    """
    nearest = facet
    for begin in range(4):
        if not is_end_of_side(quads[facet], begin, node):
            continue
        before, at = facet, across[facet, begin]
        for _ in range(FAN):
            if at < 0 or at == facet or not alive[at]:
                break
            nearest = nearer_of(point, nodes, quads, nearest, at, foot, room)
            beyond = -1
            for side in range(4):
                if is_end_of_side(quads[at], side, node) and across[at, side] != before:
                    beyond = across[at, side]
            before, at = at, beyond
    return nearest


@njit(cache=True)
def nearest_on_sheet(point, nodes, quads, across, alive, facet, foot, room):
    """The facet nearest to the point, from `facet` on over sides and holes, and the border that the point is beyond.

    INSIDE: it is beyond none, over a facet, a ridge or a valley; NOTHING: `facet` has torn. foot: as of
    `nearest_on_facet`; room (6,).
    """
    if not (alive[facet] and nearest_on_facet(point, nodes, quads[facet], foot)):
        return facet, NOTHING
    for _ in range(64):
        nearest = nearest_beside(point, nodes, quads, across, alive, facet, foot, room)
        if nearest == facet and quads[facet, 2] == quads[facet, 3]:
            node = node_at(quads[facet], foot[0], foot[1])
            if node >= 0:
                nearest = nearest_around_node(point, nodes, quads, across, alive, facet, node, foot, room)
        if nearest == facet:
            break
        facet = nearest
    first, second = sides_beyond(quads[facet], foot[0], foot[1])
    for side in (first, second):
        if is_on_side(quads[facet], foot[0], foot[1], side) and beyond_side(across, alive, facet, side) < 0:
            return facet, side
    return facet, INSIDE


@njit(cache=True, parallel=True)
def find_feet(followed, x, nodes, sheet, facet, foot, border, distance):
    """Nearest point of a sheet to each particle that is followed, whichever side it is on.

    followed: (k,) particle numbers; sheet: quads and across (e, 4), alive (e,). In and out: facet (n,), foot (n, 6);
    out: border (n,): the side that the particle is beyond, INSIDE or NOTHING; distance (n,) [m] from the sheet.
    """
    quads, across, alive = sheet
    for i in prange(followed.shape[0]):
        a = followed[i]
        room = foot[a].copy()
        facet[a], border[a] = nearest_on_sheet(x[a], nodes, quads, across, alive, facet[a], foot[a], room)
        distance[a] = abs(foot[a, 2]) if border[a] != NOTHING else math.inf


@njit(cache=True, inline="always")
def keeper_of_border(others, sheets, first, alive, borders, a):
    """FREE: no other facet is left at this edge; OWN: particle a, beyond it, touches it here; else the sheet before it.

    others: facets of other sheets at that edge; sheets: theirs; first: whether the edge is theirs before it is this
    sheet's; alive (f,); borders (s, n) of all sheets.
    """
    state = FREE
    for k in range(len(others)):
        if not alive[others[k]]:
            continue
        if first[k] or borders[sheets[k], a] == INSIDE:
            return sheets[k]
        state = OWN
    return state


@njit(cache=True, parallel=True)
def settle_feet(followed, meeting, alive, of_all, gap, facet, foot, hidden, barred, side, distance):
    """Which of the found feet are touched, and from which side.

    followed: (k,) particle numbers; meeting: start (4 e + 1,), others, their sheets, and whether they come first, by
    side of a facet; alive (f,) of all facets; of_all: borders (s, n) of all sheets, touches (s, n), and the number of
    this one; gap (e,) [m]. In and out: this one's touch (n,) [m], the gap of the facet that each was last clear of, or
    0; foot (n, 6); hidden (n,): what touches nothing until it is clear; barred (n,): what another sheet kept off a
    border within the gap; side (n,): 1 where the facets' normals point, -1, or 0 before it is known. The distance in
    the foot is then counted on the particle's side, infinite of what touches nothing, and so is its normal.

    What another sheet keeps off a border is touched as there, so that no spring jumps where it comes round the edge.
    A border that is laid bare by a tear is not touched by what was within the gap: a spring that starts stretched would
    make energy from nothing.
    """
    start, others, sheets, first = meeting
    borders, touches, number = of_all
    touch = touches[number]
    for i in prange(followed.shape[0]):
        a = followed[i]
        f, border = facet[a], borders[number, a]
        if border == NOTHING:
            foot[a, 2] = math.inf
            continue
        if touch[a] == 0.0 or distance[a] >= max(touch[a], gap[f]):
            touch[a] = gap[f]
        if border != INSIDE or side[a] == 0 or distance[a] >= touch[a]:
            side[a] = 1 if foot[a, 2] >= 0.0 else -1
        if border != INSIDE:
            there = slice(start[4 * f + border], start[4 * f + border + 1])
            keeper = keeper_of_border(others[there], sheets[there], first[there], alive, borders, a)
            if keeper >= 0:
                touch[a] = touches[keeper, a]
                barred[a] = distance[a] < touch[a]
                foot[a, 2] = math.inf
                continue
            hidden[a] = hidden[a] or (barred[a] and keeper == FREE)
        barred[a] = False
        for c in range(2, 6):
            foot[a, c] *= side[a]
        hidden[a] = hidden[a] and foot[a, 2] < touch[a]
        if hidden[a]:
            foot[a, 2] = math.inf
