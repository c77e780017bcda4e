"""Meshes of four-node shells: flat plates, cylindrical panels, and any quadrilaterals, with their rim."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.histories import Array

LEVEL = 0.7
"""Cosine from which on two shells that meet are one surface."""


@dataclass(frozen=True)
class ShellMesh:
    """Nodes and quadrilaterals of shells.

    nodes (m, 3) [m]; quads (e, 4), counter-clockwise seen from the impact side, the last node of a triangle twice;
    across (e, 4): facet beyond each side,
    -1 at the rim, see `contact`; rim (r,): nodes of the free border; surface (m, 2): the nodes' coordinates [m] along
    length and width on the surface itself (arc length on a curved panel), in which sensors are placed; parts: facets of
    each named part; rigid: names of those that neither move nor strain.
    """

    nodes: Array
    quads: NDArray[np.int64]
    across: NDArray[np.int64]
    rim: NDArray[np.int64]
    surface: Array
    parts: Mapping[str, NDArray[np.int64]] = field(default_factory=dict)
    rigid: tuple[str, ...] = ()

    def part_of(self, facet: int) -> str:
        """Name of the part that a facet is of; empty where none is named."""
        return next((name for name, own in self.parts.items() if facet in own), "")

    def edge_lengths(self) -> Array:
        """Length of border that belongs to each node of the rim: half of either border side it ends, (r,) [m]."""
        ends = sides_of(self.quads)[self.across.ravel() < 0]
        length = np.linalg.norm(self.nodes[ends[:, 0]] - self.nodes[ends[:, 1]], axis=1)
        share = np.zeros(len(self.nodes))
        np.add.at(share, ends.ravel(), np.repeat(0.5 * length, 2))
        return share[self.rim]

    def normals(self) -> Array:
        """Unit normal at every node, the mean over its quadrilaterals weighted by area, (m, 3).

        A facet that is wound against the first one there counts as if it were wound with it.
        """
        vectors = vector_areas(self.nodes, self.quads)
        sizes = np.linalg.norm(vectors, axis=1)
        first, summed = np.zeros(len(self.nodes), np.int64), np.zeros_like(self.nodes)
        first[self.quads[::-1]] = np.arange(len(self.quads))[::-1, None]
        for corner in range(4):
            own = ~is_triangle(self.quads) if corner == 3 else np.ones(len(self.quads), np.bool_)
            node, vector = self.quads[own, corner], vectors[own]
            along = (vector * vectors[first[node]]).sum(axis=1)
            against = along < -LEVEL * sizes[own] * sizes[first[node]]
            np.add.at(summed, node, np.where(against[:, None], -vector, vector))
        size = np.linalg.norm(summed, axis=1)
        area = np.bincount(self.quads.ravel(), np.repeat(sizes, 4), len(summed))
        for node in np.flatnonzero(size <= 1e-6 * area):  # several sheets meet, and their normals cancel: the first
            summed[node] = vectors[np.argmax((self.quads == node).any(axis=1))]
        return summed / np.linalg.norm(summed, axis=1, keepdims=True)


def plate_mesh(length: float, width: float, elements: tuple[int, int]) -> ShellMesh:
    """Flat rectangular mesh in z = 0, centred at the origin; the impact side is z > 0."""
    surface, quads = rectangle(length, width, elements)
    return shell_mesh(np.column_stack([surface, np.zeros(len(surface))]), quads, surface)


def cylindrical_panel(length: float, width: float, radius: float, elements: tuple[int, int]) -> ShellMesh:
    """Panel curved about the width's direction, its crown at the origin and convex to the impact side z > 0.

    length: along the arc, `radius` of the mid-surface [m]; the axis runs along y at z = -radius.
    """
    surface, quads = rectangle(length, width, elements)
    angle = surface[:, 0] / radius
    nodes = np.column_stack([radius * np.sin(angle), surface[:, 1], radius * (np.cos(angle) - 1.0)])
    return shell_mesh(nodes, quads, surface)


def rectangle(length: float, width: float, elements: tuple[int, int]) -> tuple[Array, NDArray[np.int64]]:
    """Grid of points (m, 2) [m] centred at the origin and its quadrilaterals (e, 4)."""
    nx, ny = elements
    x, y = np.linspace(-0.5 * length, 0.5 * length, nx + 1), np.linspace(-0.5 * width, 0.5 * width, ny + 1)
    points = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    i, j = (a.ravel() for a in np.meshgrid(np.arange(nx), np.arange(ny), indexing="ij"))
    corner = i * (ny + 1) + j
    return points, np.column_stack([corner, corner + ny + 1, corner + ny + 2, corner + 1]).astype(np.int64)


def shell_mesh(nodes: Array, quads: NDArray[np.int64], surface: Array | None = None) -> ShellMesh:
    """Any mesh of quadrilaterals with its facet neighbours and the nodes of its rim."""
    order, start, count = sides_by_edge(quads)
    across = np.full(4 * len(quads), -1, dtype=np.int64)
    first = start[count == 2]
    one, other = order[first], order[first + 1]
    across[one], across[other] = other // 4, one // 4
    rim = np.unique(sides_of(quads)[order[start[count == 1]]])
    flattened = nodes[:, :2].copy() if surface is None else surface
    return ShellMesh(nodes, quads, across.reshape(-1, 4), rim.astype(np.int64), flattened)


def vector_areas(nodes: Array, quads: NDArray[np.int64]) -> Array:
    """Vector areas (..., 3) [m^2] of facets (..., 4) of nodes (m, 3): along the normal, half the diagonals' product.

    Exact for triangles, whose last corner stands twice, and for warped facets, whose border alone counts.
    """
    corners = nodes[quads]
    return 0.5 * np.cross(corners[..., 2, :] - corners[..., 0, :], corners[..., 3, :] - corners[..., 1, :])


def is_triangle(quads: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Which facets (e, 4) are triangles: those whose last node is there twice."""
    return quads[:, 2] == quads[:, 3]


def centres_of(nodes: Array, quads: NDArray[np.int64]) -> Array:
    """Means of the corners of facets, (e, 3)."""
    centres, triangle = nodes[quads].mean(axis=1), is_triangle(quads)
    centres[triangle] = nodes[quads[triangle, :3]].mean(axis=1)
    return centres


def reach_of(nodes: Array, quads: NDArray[np.int64], centres: Array) -> Array:
    """Distance of each facet's farthest corner from its centre, (e,) [m]."""
    return np.linalg.norm(nodes[quads] - centres[:, None], axis=2).max(axis=1)


def border_sides(quads: NDArray[np.int64]) -> NDArray[np.int64]:
    """Node pairs (k, 2), rising, of the sides that one facet alone has."""
    order, start, count = sides_by_edge(quads)
    return np.sort(sides_of(quads)[order[start[count == 1]]], axis=1)


def sides_by_edge(quads: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Sides by their places 4 f + s, those of one edge together and in rising order; where each edge's begin; how many.

    Edges rise by their nodes. A triangle's fourth side, which is a point, is none.
    """
    ends = np.sort(sides_of(quads), axis=1)
    real = np.flatnonzero(ends[:, 0] != ends[:, 1])
    order = real[np.lexsort((ends[real, 1], ends[real, 0]))]
    another = np.any(np.diff(ends[order], axis=0, prepend=-1) != 0, axis=1)
    start = np.flatnonzero(another)
    return order, start, np.diff(start, append=len(order))


def sides_of(quads: NDArray[np.int64]) -> NDArray[np.int64]:
    """Node pairs of the sides xi < -1, xi > 1, eta < -1, eta > 1 of every facet, (4 e, 2); a triangle has no last."""
    return np.stack([quads[:, [3, 0]], quads[:, [1, 2]], quads[:, [0, 1]], quads[:, [2, 3]]], axis=1).reshape(-1, 2)
