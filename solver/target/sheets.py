"""The surface that a bird can touch, cut into sheets on which every side of a facet has at most one neighbour.

Facets that share an edge of two nodes belong to one sheet where one goes on smoothly into the other; at a T-joint the
two that make the smaller angle go on, and the third begins a sheet of its own. Sheets are touched independently, so
that a particle in a corner feels both walls, and each is wound alike, whichever way the mesh was.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.histories import Array
from birdstrike.solver.arrays import node_rows
from birdstrike.solver.kernels.contact.sheet_contact import nearest_on_facet
from birdstrike.solver.target.mesh import is_triangle, sides_by_edge, sides_of, vector_areas

ON_A_SIDE = 1e-6  # of a facet's size: as near to a point as its neighbour is
TINY = 1e-300  # [m]: a side that is a point has no direction
SMOOTH = math.cos(math.radians(45.0))
"""Of the largest angle by which a sheet bends over an edge; a sharper fold makes two, one of which owns the edge."""
Numbers = NDArray[np.int64]
TURNED, TURNED_TRIANGLE = [0, 3, 2, 1], [1, 0, 2, 3]
"""Corners of a facet that run the other way; a triangle's last, which is there twice, stays the last."""
SWAPPED, SWAPPED_TRIANGLE = [2, 3, 0, 1], [1, 0, 2, 3]
"""Sides of a facet in the order that they have when its corners run the other way."""


@dataclass
class Sheet:
    """A part of the surface.

    facets (e,): numbers in the target; quads (e, 4): their corners, wound alike; across (e, 4): neighbour in the sheet
    beyond the sides xi < -1, xi > 1, eta < -1, eta > 1, or -1;
    others: numbers in the target of the other facets at the edge of side k = 4 f + s, but for one that goes on from it
    smoothly, `others[start[k] : start[k + 1]]`; beside: the sheets that they are of; first: whether the edge is theirs
    before it is this facet's, as long as they live; two_sided: touched from both sides and at its borders.
    """

    quads: Numbers
    across: Numbers
    facets: Numbers
    start: Numbers
    others: Numbers = field(default_factory=lambda: np.empty(0, np.int64))
    beside: Numbers = field(default_factory=lambda: np.empty(0, np.int64))
    first: NDArray[np.bool_] = field(default_factory=lambda: np.empty(0, np.bool_))
    two_sided: bool = True


def whole_sheet(quads: Numbers, across: Numbers) -> Sheet:
    """All facets of a surface that is wound alike and touched from one side."""
    return Sheet(quads, across, np.arange(len(quads)), np.zeros(4 * len(quads) + 1, np.int64), two_sided=False)


Meeting = dict[int, list[tuple[int, bool]]]
"""At a side, by its place 4 f + s: the facets of other sheets that meet there, and whether the edge is theirs first."""


def sheets_of(nodes: Array, quads: Numbers, tied: Mapping[int, Numbers] | None = None) -> list[Sheet]:
    """Cut facets (e, 4) on nodes (m, 3) into sheets; tied: the nodes that each tied node follows."""
    order, start, _ = sides_by_edge(quads)
    edges = np.split(order, start[1:])  # the sides that meet at each, by their places 4 f + s
    beyond = _beyond(nodes, quads, edges)
    meeting = _meeting(edges, beyond) | _welded(nodes, quads, edges, tied or {})
    label, turned = _wound_alike(quads, beyond)
    parts = [np.flatnonzero(label == one) for one in range(label.max() + 1)]
    return [_sheet(part, quads, label, turned, beyond, meeting) for part in parts]


def _beyond(nodes: Array, quads: Numbers, edges: Sequence[Numbers]) -> Numbers:
    """(4 e,) The side on which the surface goes on beyond each with the least bend; -1 where all bend sharply."""
    away = _away_from_sides(nodes, quads)
    beyond = np.full(4 * len(quads), -1)
    two = np.array([places for places in edges if len(places) == 2], np.int64).reshape(-1, 2)
    straight = -np.einsum("ij,ij->i", away[two[:, 0]], away[two[:, 1]])
    smooth = two[straight > SMOOTH]
    beyond[smooth] = smooth[:, ::-1]
    for places in edges:
        if len(places) > 2:
            bends = [(-float(away[i] @ away[j]), i, j) for i, j in combinations(places, 2)]
            best, i, j = max(bends)
            if best > SMOOTH:
                beyond[i], beyond[j] = j, i
    return beyond


def _away_from_sides(nodes: Array, quads: Numbers) -> Array:
    """(4 e, 3) Unit vector from each side into its facet, perpendicular to the side; any where a side is a point."""
    ends = np.sort(sides_of(quads), axis=1)
    line = nodes[ends[:, 1]] - nodes[ends[:, 0]]
    line = line / np.maximum(np.linalg.norm(line, axis=1), TINY)[:, None]
    into = np.repeat(nodes[quads].mean(axis=1), 4, axis=0) - nodes[ends[:, 0]]
    into = into - np.einsum("ij,ij->i", into, line)[:, None] * line
    return into / np.maximum(np.linalg.norm(into, axis=1), TINY)[:, None]


def _meeting(edges: Sequence[Numbers], beyond: Numbers) -> Meeting:
    """What meets at the borders of sheets: a smooth pair has an edge first, then the others in order."""
    found: Meeting = {}
    for places in edges:
        if len(places) == 1 or (len(places) == 2 and beyond[places[0]] >= 0):
            continue
        for place in places:
            if beyond[place] >= 0:
                others = [(int(one) // 4, False) for one in places if one not in (place, beyond[place])]
            else:
                others = [(int(one) // 4, bool(beyond[one] >= 0 or one < place)) for one in places if one != place]
            found[int(place)] = others
    return found


def _welded(nodes: Array, quads: Numbers, edges: Sequence[Numbers], tied: Mapping[int, Numbers]) -> Meeting:
    """The borders by which webs that stand on a surface are tied onto it: the edge is the surface's, as at a T-joint.

    The border of a sheet that is tied flat onto another is touched as any.
    """
    found: Meeting = {}
    if not tied:
        return found
    ends, away, (start, member) = sides_of(quads), _away_from_sides(nodes, quads), node_rows(quads, len(nodes))
    follows = np.isin(np.arange(len(nodes)), [*tied])
    border = np.array([places[0] for places in edges if len(places) == 1], np.int64)
    for place in border[follows[ends[border]].all(axis=1)].tolist():
        one, other = ends[place].tolist()
        rows = [member[start[node] : start[node + 1]] for node in (*tied[one].tolist(), *tied[other].tolist())]
        near = np.unique(np.concatenate(rows) // 4)
        under = _nearest_facets(nodes[ends[place]].mean(axis=0), nodes, quads, near)
        vector = vector_areas(nodes, quads[under[0]])
        if abs(float(vector @ away[place])) > SMOOTH * float(np.linalg.norm(vector)):
            found[place] = [(facet, True) for facet in under]
    return found


def _nearest_facets(point: Array, nodes: Array, quads: Numbers, near: Numbers) -> list[int]:
    """Of these facets (k,) those that a point (3,) is nearest to: two where that is on their common side."""
    distance = np.full(len(near), np.inf)
    for number, facet in enumerate(near):
        foot = np.zeros(6)
        if nearest_on_facet(point, nodes, quads[facet], foot):
            distance[number] = abs(foot[2])
    size = np.linalg.norm(np.ptp(nodes[quads[near[0]]], axis=0))
    return near[distance <= distance.min() + ON_A_SIDE * size].tolist()


def _wound_alike(quads: Numbers, beyond: Numbers) -> tuple[Numbers, NDArray[np.bool_]]:
    """Sheet of each facet (e,), and whether its corners must run the other way for the sheet to be wound alike."""
    begin = quads[:, [3, 1, 0, 2]].ravel()  # of each side, in the corners' own order
    flips = (begin == begin[beyond]).reshape(-1, 4).tolist()
    beside = np.where(beyond >= 0, beyond // 4, -1).reshape(-1, 4).tolist()
    label, turned, count = [-1] * len(quads), [False] * len(quads), 0
    for first in range(len(quads)):
        if label[first] >= 0:
            continue
        label[first], waiting = count, [first]
        while waiting:
            now = waiting.pop()
            for neighbour, flip in zip(beside[now], flips[now], strict=True):
                if neighbour >= 0 and label[neighbour] < 0:
                    label[neighbour], turned[neighbour] = count, turned[now] ^ flip
                    waiting.append(neighbour)
        count += 1
    return np.array(label), np.array(turned)


def _sheet(
    facets: Numbers, quads: Numbers, label: Numbers, turned: NDArray[np.bool_], beyond: Numbers, meeting: Meeting
) -> Sheet:
    """The sheet of these facets, with what it meets at its borders."""
    local = np.full(len(quads), -1)
    local[facets] = np.arange(len(facets))
    own, triangle, runs_back = quads[facets], is_triangle(quads[facets]), turned[facets]
    corners, sides = np.tile(np.arange(4), (2, len(facets), 1))
    corners[runs_back & ~triangle], corners[runs_back & triangle] = TURNED, TURNED_TRIANGLE
    sides[runs_back & ~triangle], sides[runs_back & triangle] = SWAPPED, SWAPPED_TRIANGLE
    places = 4 * facets[:, None] + sides  # of the target's sides, in the order of the sheet's
    across = np.where(beyond[places] >= 0, local[beyond[places] // 4], -1)
    met = [meeting.get(place, []) for place in places.ravel().tolist()]
    start = np.concatenate([[0], np.cumsum([len(entry) for entry in met])]).astype(np.int64)
    others = np.array([number for entry in met for number, _ in entry], np.int64)
    first = np.array([ahead for entry in met for _, ahead in entry], np.bool_)
    return Sheet(np.take_along_axis(own, corners, 1), across, facets, start, others, label[others], first)
