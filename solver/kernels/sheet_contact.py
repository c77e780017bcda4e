"""Feet of particles on sheets of facets that can be touched from both sides and at their borders.

A sheet is a part of the surface on which every side of a facet has at most one neighbour (see `target.sheets`). Over
its inside a particle stays on the side that it came from, however deep it is pressed; beyond a border it touches the
border's edge, along the line from there, and may change sides.
"""

from __future__ import annotations

import math

from numba import njit, prange

from birdstrike.solver.kernels.contact import OUTSIDE, beyond_side, clamp_to_facet, foot_on_facet, sides_beyond

INSIDE, NOTHING = -1, -2


@njit(cache=True)
def walk_on_sheet(point, nodes, quads, across, alive, facet, foot):
    """The facet nearest to the point's foot, walking from `facet`, and the border side that the point is beyond.

    INSIDE: it is beyond none, over a facet or a ridge; NOTHING: `facet` has torn. foot: as of `foot_on_facet`, clamped
    to the border or the ridge.
    """
    came_from = -1
    for _ in range(64):
        if not (alive[facet] and foot_on_facet(point, nodes, quads[facet], foot)):
            return facet, NOTHING
        xi, eta = foot[0], foot[1]
        if abs(xi) <= OUTSIDE and abs(eta) <= OUTSIDE:
            return facet, INSIDE
        first, second = sides_beyond(quads[facet], xi, eta)
        beyond = beyond_side(across, alive, facet, first)
        around = beyond < 0
        if around and min(abs(xi), abs(eta)) > OUTSIDE:
            beyond = beyond_side(across, alive, facet, second)
        if beyond < 0 or beyond == came_from:
            clamp_to_facet(point, nodes, quads[facet], foot)
            return facet, (first if around else INSIDE)
        came_from = facet
        facet = beyond
        foot[0] = foot[1] = 0.0
    clamp_to_facet(point, nodes, quads[facet], foot)
    return facet, INSIDE


@njit(cache=True)
def border_is_bare(point, nodes, quad, side, others, owner, quads, alive):
    """Whether a point beyond a border side can touch its edge.

    others: facets of other sheets at that edge, numbers in quads (f, 4) and alive (f,) of the whole target. Where none
    is left the edge is free. Else the sheet that owns the edge lets it be touched where the point is beyond all of them
    too: the outer side of a sharp fold.
    """
    left = 0
    i = quad[3] if side == 0 else (quad[1] if side == 1 else (quad[0] if side == 2 else quad[2]))
    j = quad[0] if side == 0 else (quad[2] if side == 1 else (quad[1] if side == 2 else quad[3]))
    for number in others:
        if not alive[number]:
            continue
        left += 1
        if not owner:
            return False
        squared = inward = off = 0.0
        for c in range(3):
            squared += (nodes[j, c] - nodes[i, c]) ** 2
        for c in range(3):
            centre = 0.25 * (
                nodes[quads[number, 0], c]
                + nodes[quads[number, 1], c]
                + nodes[quads[number, 2], c]
                + nodes[quads[number, 3], c]
            )
            inward += (centre - nodes[i, c]) * (nodes[j, c] - nodes[i, c])
            off += (point[c] - nodes[i, c]) * (nodes[j, c] - nodes[i, c])
        behind = 0.0
        for c in range(3):
            edge = nodes[j, c] - nodes[i, c]
            centre = 0.25 * (
                nodes[quads[number, 0], c]
                + nodes[quads[number, 1], c]
                + nodes[quads[number, 2], c]
                + nodes[quads[number, 3], c]
            )
            tangent = centre - nodes[i, c] - inward / squared * edge
            behind += tangent * (point[c] - nodes[i, c] - off / squared * edge)
        if behind > 0.0:
            return False
    return True


@njit(cache=True, parallel=True)
def follow_sheet(followed, x, nodes, sheet, target, gap, facet, foot, hidden, side, distance):
    """Foot of each particle that is followed on a sheet, as of the side that it is on.

    followed: (k,) particle numbers.
    sheet: quads and across (e, 4), alive (e,), start (4 e + 1,) and others of each side, owner (4 e,); target: quads
    and alive of all facets; gap (e,) [m]. In and out: facet (n,), foot (n, 6), hidden (n,): what touches nothing until
    it is clear, side (n,): 1 where the facets' normals point, -1, or 0 before it is known; out: distance (n,) [m] from
    the sheet, touched or not. The distance in the foot is counted on the particle's side, infinite of what touches
    nothing, and so is its normal.
    """
    quads, across, alive, start, others, owner = sheet
    all_quads, all_alive = target
    for i in prange(followed.shape[0]):
        a = followed[i]
        facet[a], border = walk_on_sheet(x[a], nodes, quads, across, alive, facet[a], foot[a])
        distance[a] = abs(foot[a, 2])
        f = facet[a]
        if border == NOTHING:
            foot[a, 2] = distance[a] = math.inf
            continue
        if border != INSIDE:
            place = 4 * f + border
            there = others[start[place] : start[place + 1]]
            if not border_is_bare(x[a], nodes, quads[f], border, there, owner[place], all_quads, all_alive):
                foot[a, 2] = math.inf
                continue
        if border != INSIDE or side[a] == 0 or distance[a] >= gap[f]:
            side[a] = 1 if foot[a, 2] >= 0.0 else -1
        for c in range(2, 6):
            foot[a, c] *= side[a]
        hidden[a] = hidden[a] and foot[a, 2] < gap[f]
        if hidden[a]:
            foot[a, 2] = math.inf
