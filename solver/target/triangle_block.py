"""Blocks of three-node shells beside those of four nodes: same layers, laws, erosion and energies, another element."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.histories import Array
from birdstrike.solver.arrays import node_rows
from birdstrike.solver.kernels.target.triangle import (
    SHEAR_STABILISATION,
    triangle_forces,
    triangle_geometry,
    triangle_hourglass,
    triangle_strain,
)
from birdstrike.solver.target.mesh import is_triangle
from birdstrike.solver.target.nodes import Nodes
from birdstrike.solver.target.section import Section
from birdstrike.solver.target.shell_block import HOURGLASS_COEFFICIENT, ShellBlock

ALIKE = 1e-6
"""Of the square of a side, by which another is as long: files round their nodes."""


class TriangleBlock(ShellBlock):
    """Triangles of one or several sections, `kernels.target.triangle`; quads (e, 4): the last node twice."""

    shape_size, modes, corners = 12, 4, 3
    square_share = 0.5

    def set_up(self, nodes: Array) -> None:
        """Geometry at rest. A crack costs as much as in squares of two triangles each."""
        self.triangles = np.ascontiguousarray(self.quads[:, :3])
        start, member = node_rows(self.triangles, len(nodes))
        self.start, self.member = start, member // 3 * 4 + member % 3  # as `gather_nodal_forces` counts
        self.at_rest = np.zeros((len(self.quads), 4))
        self.update_geometry(nodes)
        first, second = self.frame[:, None, 0:3], self.frame[:, None, 3:6]
        about = nodes[self.triangles] - nodes[self.triangles].mean(axis=1, keepdims=True)
        plane = np.stack([(about * first).sum(axis=2), (about * second).sum(axis=2)], axis=2)
        self.at_rest[:] = plane[:, :2].reshape(-1, 4)
        longest = np.linalg.norm(about - np.roll(about, 1, axis=1), axis=2).max(axis=1)
        squared = self.thickness**2
        self.shear_root = np.sqrt(squared / (squared + SHEAR_STABILISATION * longest**2))

    def mid_lines(self, nodes: Array) -> tuple[Array, ...]:
        """The two sides beside the longest, 3 x (e, 3) [m]: mid-lines of the quadrilateral of two such triangles.

        Where several sides are the longest, each is left out for an equal share, so that the metric is the mean over
        these quadrilaterals and no corner counts before another.
        """
        corners = nodes[self.triangles]
        sides = np.roll(corners, -1, axis=1) - corners
        squared = (sides**2).sum(axis=2)
        longest = squared > (1.0 - ALIKE) * squared.max(axis=1, keepdims=True)
        share = np.sqrt(1.0 - longest / longest.sum(axis=1, keepdims=True))
        first, second, third = np.moveaxis(share[:, :, None] * sides, 1, 0)
        return first, second, third

    def update_geometry(self, x: Array) -> None:
        """Frames and gradients of the present positions (m, 3) [m]."""
        triangle_geometry(x, self.triangles, self.alive, self.at_rest, self.frame, self.shape)

    def update_strain(self, nodes: Nodes, dt: float) -> None:
        """Increments of the step from the half-step velocities."""
        rates = (nodes.v, nodes.omega, self.triangles, self.alive, self.frame, self.shape, self.shear_root, dt)
        triangle_strain(*rates, self.strain, self.hourglass_strain)

    def update_hourglass(self) -> None:
        """Stabilising resultants, and their work."""
        where = (self.shape, self.alive, self.shear_root, self.section, self.table.elastic, HOURGLASS_COEFFICIENT)
        triangle_hourglass(self.hourglass_strain, *where, self.hourglass, self.works[1])

    def element_forces(self) -> None:
        """Forces of each element on its nodes."""
        where = (self.frame, self.shape, self.alive, self.shear_root)
        triangle_forces(*where, self.resultant, self.hourglass, self.force)


def shell_blocks(
    nodes: Array,
    quads: NDArray[np.int64],
    sections: Sequence[Section],
    section: NDArray[np.int64] | None = None,
    scaled_inertia: bool = False,
) -> list[ShellBlock]:
    """A block of the quadrilaterals and one of the triangles, which come last in quads (e, 4); see `ShellBlock`."""
    owner = np.zeros(len(quads), np.int64) if section is None else section
    triangle = is_triangle(quads)
    assert (np.diff(triangle.astype(np.int64)) >= 0).all(), "triangles come last"
    kinds = ((ShellBlock, ~triangle), (TriangleBlock, triangle))
    return [kind(nodes, quads[own], sections, owner[own], scaled_inertia) for kind, own in kinds if own.any()]
