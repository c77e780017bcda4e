"""A mesh of named parts with named sets of nodes: what a generator or a mesh file gives, before thickness and metal."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.histories import Array
from birdstrike.solver.target.mesh import ShellMesh, shell_mesh, sides_of, vector_areas


@dataclass(frozen=True)
class Row:
    """A row of rivets: points (k, 3) [m] near which it joins two parts, the struck one first."""

    points: Array
    parts: tuple[str, str]


@dataclass(frozen=True, eq=False)
class PartMesh:
    """Shells of named parts; itself, not its content, is what it is the same as.

    nodes (m, 3) [m]; quads (e, 4), triangles last and the last node of each twice; part (e,): place of each in
    `parts`; sets: nodes by the name of their set; rows: the rivets that the mesh is made for; numbers (e,): of the
    shells in their file, where it has any; thicknesses [m]: that the file states of parts, and that are not used.
    """

    nodes: Array
    quads: NDArray[np.int64]
    part: NDArray[np.int64]
    parts: tuple[str, ...]
    sets: Mapping[str, NDArray[np.int64]]
    rows: Mapping[str, tuple[Row, ...]] = field(default_factory=dict)
    numbers: NDArray[np.int64] | None = None
    thicknesses: Mapping[str, float] = field(default_factory=dict)

    @cached_property
    def shells(self) -> ShellMesh:
        """The shells with the facets of each part, none of them rigid, which their metals say."""
        facets = {name: np.flatnonzero(self.part == number) for number, name in enumerate(self.parts)}
        return replace(shell_mesh(self.nodes, self.quads), parts=facets)

    @cached_property
    def element_size(self) -> float:
        """Side of a square of the shells' mean area [m]."""
        return float(np.sqrt(np.linalg.norm(vector_areas(self.nodes, self.quads), axis=1).mean()))

    @cached_property
    def pieces(self) -> int:
        """How many parts of it share no node."""
        from scipy.sparse import coo_array  # late: few cases read a mesh
        from scipy.sparse.csgraph import connected_components

        ends, nodes = sides_of(self.quads), len(self.nodes)
        graph = coo_array((np.ones(len(ends)), (ends[:, 0], ends[:, 1])), shape=(nodes, nodes))
        return int(connected_components(graph, directed=False, return_labels=False))

    def number(self, shell: int) -> int:
        """Of a shell in its file; counted from 1 where the file has none."""
        return shell + 1 if self.numbers is None else int(self.numbers[shell])


@dataclass(frozen=True)
class Patch:
    """A flat or curved grid of shells of one part: points (a, b, 3) [m].

    body: patches of one body share the nodes at which they meet; those of different bodies, which are riveted, do not.
    """

    part: str
    points: Array
    body: str = ""


def merged(patches: list[Patch], tolerance: float = 1e-9) -> tuple[Array, NDArray[np.int64], NDArray[np.int64]]:
    """Nodes, quadrilaterals and patch of each, nodes of one body at one place being one; numbered as the patches come.

    tolerance: of a place [m].
    """
    points = np.concatenate([patch.points.reshape(-1, 3) for patch in patches])
    bodies = {patch.body: number for number, patch in enumerate(patches)}
    body = np.repeat([bodies[patch.body] for patch in patches], [patch.points.size // 3 for patch in patches])
    place = np.column_stack([np.round(points / tolerance).astype(np.int64), body])
    _, first, same = np.unique(place, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    number = np.empty(len(order), np.int64)
    number[order] = np.arange(len(order))
    same, quads, owner, offset = number[same.ravel()], [], [], 0
    for at, patch in enumerate(patches):
        a, b, _ = patch.points.shape
        corner = offset + (np.arange(a - 1)[:, None] * b + np.arange(b - 1)).ravel()
        quads.append(same[np.stack([corner, corner + b, corner + b + 1, corner + 1], axis=1)])
        owner.append(np.full(len(corner), at))
        offset += a * b
    return points[first[order]], np.concatenate(quads), np.concatenate(owner)


def divided(places: list[float], size: float) -> Array:
    """Coordinates from the first of rising places to the last, each of them met, in steps near `size` [m]."""
    pieces = [places[:1]]
    for low, high in pairwise(places):
        pieces.append(list(np.linspace(low, high, max(round((high - low) / size), 1) + 1)[1:]))
    return np.array([place for piece in pieces for place in piece])
