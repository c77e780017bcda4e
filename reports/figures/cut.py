"""A target cut by a plane: a segment for each facet that the plane crosses; where facets have failed, a gap."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.histories import Array
from birdstrike.solver.target.mesh import ShellMesh

ON_PLANE = 1e-9
"""Distance [m] up to which a node counts as beyond the plane: of a row of nodes in it one side is cut."""


@dataclass(frozen=True)
class Sheets:
    """Facets of a target with what a picture says of each.

    quads (e, 4), the last node of a triangle twice; part (e,): place in `names`; thickness (e,) [m].
    """

    quads: NDArray[np.int64]
    part: NDArray[np.int64]
    names: tuple[str, ...]
    thickness: Array

    @staticmethod
    def of(mesh: ShellMesh, thickness: float | dict[str, float]) -> Sheets:
        """The facets of a mesh at rest; thickness [m]: of all, or of each named part."""
        parts = mesh.parts or {"plate": np.arange(len(mesh.quads))}
        part, height = np.zeros(len(mesh.quads), np.int64), np.zeros(len(mesh.quads))
        for number, (name, facets) in enumerate(parts.items()):
            part[facets] = number
            height[facets] = thickness[name] if isinstance(thickness, dict) else thickness
        return Sheets(mesh.quads, part, tuple(parts), height)

    def numbers(self, quads: NDArray[np.int64]) -> NDArray[np.int64]:
        """Places of some facets (k, 4), such as those that have not failed, among all."""
        return np.array([self._places[tuple(quad)] for quad in quads.tolist()], np.int64)

    @cached_property
    def _places(self) -> dict[tuple[int, ...], int]:
        return {tuple(quad): number for number, quad in enumerate(self.quads.tolist())}


def cut(nodes: Array, quads: NDArray[np.int64], y: float) -> tuple[Array, NDArray[np.int64]]:
    """Segments (k, 2, 3) [m] in which the plane of constant `y` [m] cuts facets, and the place of each facet (k,).

    A facet lies on one side or is cut once; one that is warped across the plane may be cut twice. Facets that lie in
    the plane are not cut by it.
    """
    beyond = nodes[:, 1] > y - ON_PLANE
    begin, end = quads, np.roll(quads, -1, axis=1)
    crossed = beyond[begin] != beyond[end]
    facet, side = np.nonzero(crossed)
    a, b = nodes[begin[facet, side]], nodes[end[facet, side]]
    share = np.clip((y - a[:, 1]) / (b[:, 1] - a[:, 1]), 0.0, 1.0)
    points = a + share[:, None] * (b - a)
    return points.reshape(-1, 2, 3), facet[::2]


def strips(segments: Array, thickness: Array) -> Array:
    """Outlines (k, 4, 2) [m] in x and z of segments (k, 2, 3) as thick as their sheets (k,) [m]."""
    along = np.diff(segments[:, :, [0, 2]], axis=1)[:, 0]
    length = np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-12)
    across = 0.5 * thickness[:, None] * np.column_stack([-along[:, 1], along[:, 0]]) / length
    first, last = segments[:, 0, [0, 2]], segments[:, 1, [0, 2]]
    return np.stack([first + across, last + across, last - across, first - across], axis=1)
