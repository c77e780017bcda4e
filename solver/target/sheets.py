"""The surface that a bird can touch, cut into sheets on which every side of a facet has at most one neighbour.

Facets that share an edge of two nodes belong to one sheet where one goes on smoothly into the other; at a T-joint the
two that make the smaller angle go on, and the third begins a sheet of its own. Sheets are touched independently, so
that a particle in a corner feels both walls, and each is wound alike, whichever way the mesh was.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.histories import Array
from birdstrike.solver.target.mesh import is_triangle, sides_of

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


Edge = tuple[int, int]
Edges = dict[Edge, list[int]]
"""Sides, by their places 4 f + s, that meet at the edge between two nodes."""
Pairs = dict[Edge, tuple[int, int]]


def sheets_of(nodes: Array, quads: Numbers) -> list[Sheet]:
    """Cut facets (e, 4) on nodes (m, 3) into sheets."""
    edges: Edges = {}
    for place, ends in enumerate(np.sort(sides_of(quads), axis=1)):
        if ends[0] != ends[1]:  # else a side of a triangle that has shrunk to a point
            edges.setdefault((int(ends[0]), int(ends[1])), []).append(place)
    pairs: Pairs = {}
    for edge, places in edges.items():
        pair = _smoothest(nodes, quads, edge, places)
        if pair is not None:
            pairs[edge] = pair
    label, turned = _wound_alike(quads, pairs)
    return [_sheet(np.flatnonzero(label == one), quads, label, turned, edges, pairs) for one in range(label.max() + 1)]


def _smoothest(nodes: Array, quads: Numbers, edge: Edge, places: Sequence[int]) -> tuple[int, int] | None:
    """The two sides at an edge over which the surface goes on with the least bend; None where all bend sharply."""
    line = nodes[edge[1]] - nodes[edge[0]]
    line = line / np.linalg.norm(line)
    away = []
    for place in places:
        into = nodes[quads[place // 4]].mean(axis=0) - nodes[edge[0]]
        into = into - (into @ line) * line
        away.append(into / np.linalg.norm(into))
    straight = [(-float(away[i] @ away[j]), i, j) for i, j in combinations(range(len(places)), 2)]
    best, i, j = max(straight, default=(-1.0, 0, 0))
    return (places[i], places[j]) if best > SMOOTH else None


def _wound_alike(quads: Numbers, pairs: Pairs) -> tuple[Numbers, NDArray[np.bool_]]:
    """Sheet of each facet (e,), and whether its corners must run the other way for the sheet to be wound alike."""
    beside: list[list[tuple[int, bool]]] = [[] for _ in quads]
    ends = np.stack([quads, np.roll(quads, -1, axis=1)], axis=2)[:, [3, 1, 0, 2]]  # in the corners' own order
    for one, other in pairs.values():
        f, g = one // 4, other // 4
        flips = bool(ends[f, one % 4, 0] == ends[g, other % 4, 0])
        beside[f].append((g, flips))
        beside[g].append((f, flips))
    label, turned, count = np.full(len(quads), -1), np.zeros(len(quads), np.bool_), 0
    for first in range(len(quads)):
        if label[first] >= 0:
            continue
        label[first], waiting = count, [first]
        while waiting:
            now = waiting.pop()
            for neighbour, flips in beside[now]:
                if label[neighbour] < 0:
                    label[neighbour], turned[neighbour] = count, turned[now] ^ flips
                    waiting.append(neighbour)
        count += 1
    return label, turned


def _sheet(
    facets: Numbers, quads: Numbers, label: Numbers, turned: NDArray[np.bool_], edges: Edges, pairs: Pairs
) -> Sheet:
    """The sheet of these facets, with what it meets at its borders; those that go on smoothly have an edge first."""
    local = {int(facet): i for i, facet in enumerate(facets)}
    own = quads[facets].copy()
    across = np.full((len(facets), 4), -1)
    meeting: list[list[list[tuple[int, bool]]]] = [[[] for _ in range(4)] for _ in facets]
    triangle = is_triangle(own)
    for i, facet in enumerate(facets):
        swapped = SWAPPED_TRIANGLE if triangle[i] else SWAPPED
        if turned[facet]:
            own[i] = own[i][TURNED_TRIANGLE if triangle[i] else TURNED]
        for side, (one, two) in enumerate(np.sort(sides_of(quads[facet : facet + 1]), axis=1)):
            places, pair = edges.get((int(one), int(two)), []), pairs.get((int(one), int(two)))
            place, to = 4 * int(facet) + side, swapped[side] if turned[facet] else side
            if pair is not None and place in pair:
                across[i, to] = local[(pair[0] if place == pair[1] else pair[1]) // 4]
            meeting[i][to] = _met(place, places, pair or ())
    flat = [entry for facet in meeting for entry in facet]
    start = np.concatenate([[0], np.cumsum([len(entry) for entry in flat])]).astype(np.int64)
    others = np.array([number for entry in flat for number, _ in entry], np.int64)
    first = np.array([ahead for entry in flat for _, ahead in entry], np.bool_)
    return Sheet(own, across, facets, start, others, label[others].astype(np.int64), first)


def _met(place: int, places: Sequence[int], pair: Sequence[int]) -> list[tuple[int, bool]]:
    """Facets of other sheets at the edge of a side, and whether they have it first: a smooth pair, then in order."""
    if place in pair:
        return [(other // 4, False) for other in places if other not in pair]
    return [(other // 4, other in pair or other < place) for other in places if other != place]
