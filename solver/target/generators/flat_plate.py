"""A flat rectangle of one part, its rim divided among load cells."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.solver.fields import Count
from birdstrike.solver.target.generators.interface import Generator
from birdstrike.solver.target.part_mesh import PartMesh, Patch, divided, merged


class FlatPlate(Generator):
    """Plate length x width in z = 0, its impact side z > 0.

    Sets: edges, the whole rim; cell_1, cell_2, ...: equal stretches of it, from the middle of the side at the length's
    high end towards the width's high end and on round, the first about that middle.
    """

    struck: ClassVar = "plate"

    kind: Literal["flat_plate"]
    cells: Annotated[int, Count(0, 64)] = 0

    @property
    def parts(self) -> tuple[str, ...]:
        return ("plate",)

    @property
    def sets(self) -> tuple[str, ...]:
        return ("edges", *(f"cell_{i + 1}" for i in range(self.cells)))

    def mesh(self) -> PartMesh:
        half = (0.5 * self.length, 0.5 * self.width)
        x, y = (divided([-side, 0.0, side], self.element_size) for side in half)
        grid = np.stack([*np.meshgrid(x, y, indexing="ij"), np.zeros((len(x), len(y)))], axis=-1)
        nodes, quads, owner = merged([Patch("plate", grid)])
        near = 1e-6 * self.element_size
        rim = (np.abs(np.abs(nodes[:, 0]) - half[0]) < near) | (np.abs(np.abs(nodes[:, 1]) - half[1]) < near)
        edges = np.flatnonzero(rim)
        found = {"edges": edges}
        if self.cells:
            way = self._way_round(nodes[edges]) * self.cells / (2.0 * (self.length + self.width))
            cell = np.floor(way + 0.5 + 1e-9).astype(np.int64) % self.cells
            found |= {f"cell_{i + 1}": edges[cell == i] for i in range(self.cells)}
        return PartMesh(nodes, quads, owner, self.parts, found)

    def _way_round(self, points: Array) -> Array:
        """Way along the rim [m] to its points (r, 3), from the middle of the side at the length's high end."""
        a, b, (x, y) = self.length, self.width, points[:, :2].T
        sides = (
            (np.isclose(x, 0.5 * a), y % (2.0 * (a + b))),
            (np.isclose(y, 0.5 * b), 0.5 * b + 0.5 * a - x),
            (np.isclose(x, -0.5 * a), b + a - y),
            (np.isclose(y, -0.5 * b), 1.5 * b + 1.5 * a + x),
        )
        return np.select([there for there, _ in sides], [way for _, way in sides])
