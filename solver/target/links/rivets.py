"""Rivets: springs in six freedoms between two parts, which break at a strength in tension and shear."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from birdstrike.data.errors import UserError
from birdstrike.data.histories import Array
from birdstrike.solver.kernels.target.links import EITHER_WAY, NO_LIMIT, ONE_WAY, rivet_forces
from birdstrike.solver.target.links.anchors import Anchors, Foot, Surface
from birdstrike.solver.target.nodes import Nodes
from birdstrike.solver.target.part_mesh import PartMesh, Row

if TYPE_CHECKING:
    from scipy.sparse import csc_array

CONSTANTS = 8
TOUCHING = 1e-6  # m: mid-surfaces no farther apart are in one plane (files round their nodes), and none is the first
FARTHEST = 0.02  # m, between the mid-surfaces that a rivet joins
BESIDE = 1e-4  # m: a point no farther beyond a part's edge lies on it (files round their nodes)
SLANTED = 0.2
"""Share of a point's distance from a part by which it may lie beyond its edge: facets stand for a curved sheet."""


@dataclass(frozen=True)
class RivetData:
    """Of every rivet of a row: stiffness [N/m] along and across it and [N m/rad], strengths [N], exponents."""

    along: float
    across: float
    rotational: float
    tension: float
    shear: float
    exponents: tuple[float, float] = (2.0, 2.0)

    def row(self, limit: float = ONE_WAY) -> Array:
        """As the kernel reads it, see `kernels.target.links.rivet_forces`; limit: NO_LIMIT, ONE_WAY or EITHER_WAY."""
        springs = (self.along, self.across, self.rotational)
        return np.array([*springs, self.tension, self.shear, *self.exponents, limit])


class Rivets:
    """All rivets of a target.

    points (k, 3) [m] midway between the parts, axes (k, 3): from the first to the second; anchors: of both ends;
    constants (k, 8); rows (k,): names of their rows; broken (k,): 2 where it no longer carries; held (k,) [s]: for how
    long it has carried; force (k, 6): on the second part [N, N m].
    """

    def __init__(
        self, points: Array, axes: Array, anchors: Anchors, constants: Array, rest: Array, rows: Sequence[str]
    ) -> None:
        self.points, self.along, self.anchors, self.constants, self.rest = points, axes, anchors, constants, rest
        self.rows = tuple(rows)
        self.relax()

    def __len__(self) -> int:
        return len(self.points)

    def relax(self) -> None:
        """Whole and free of force."""
        k = len(self)
        means = self.anchors.means(self.rest)
        self.arm = np.repeat(self.points, 2, axis=0) - means
        self.lever = self.arm.copy()
        self.axes, self.give, self.force = frames_along(self.along), np.zeros((k, 6)), np.zeros((k, 6))
        self.broken, self.taken, self.room = np.zeros(k, np.int64), np.zeros(k), np.zeros((8, 3))
        self.held = np.zeros(k)

    @property
    def lost(self) -> int:
        """How many no longer carry anything."""
        return int(np.count_nonzero(self.broken == 2))

    def losses(self, begin: float) -> str:
        """Of each row of which some broke, how many and when; begin: when the run began [s]."""
        told = list[str]()
        for name in dict.fromkeys(self.rows):
            row = np.array(self.rows) == name
            lost = 1e3 * (begin + self.held[row & (self.broken == 2)])
            if len(lost):
                last = f" to {lost.max():.3f}" if len(lost) > 1 else ""
                told.append(f"{len(lost)} of {row.sum()} of {name} at {lost.min():.3f}{last} ms")
        return ", ".join(told)

    def elastic(self) -> Rivets:
        """The same without strength's limit."""
        constants = self.constants.copy()
        constants[:, 7] = NO_LIMIT
        return Rivets(self.points, self.along, self.anchors, constants, self.rest, self.rows)

    def update_forces(self, nodes: Nodes, dt: float) -> float:
        """Forces of the step that ended join those of the nodes; returns the energy that they took [J]."""
        state = (self.arm, self.lever, self.axes, self.give, self.force, self.broken, self.held, self.taken)
        moving = (nodes.x, nodes.v, nodes.omega)
        return float(rivet_forces(self.anchors.packed, self.constants, dt, *moving, state, nodes.nodal, self.room))

    def stiffness(self, m: int) -> csc_array:
        """Of whole rivets at rest, (6 m, 6 m)."""
        from scipy.sparse import coo_array, csc_array  # late: the time loop needs none

        start, member, weight = self.anchors.packed
        row = np.repeat(np.arange(len(start) - 1), np.diff(start))
        sign = np.where(row % 2, 1.0, -1.0) * weight
        lever, axes, rivet = self.lever[row], self.axes[row // 2], row // 2
        rows, columns, values = [], [], []
        for axis in range(3):
            turned = np.cross(lever, axes[:, axis])
            for c in range(3):
                for at, column, value in (
                    (axis, c, axes[:, axis, c]),
                    (axis, 3 + c, turned[:, c]),
                    (3 + axis, 3 + c, axes[:, axis, c]),
                ):
                    rows.append(6 * rivet + at)
                    columns.append(6 * member + column)
                    values.append(sign * value)
        flat = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
        gap = csc_array(coo_array(flat, shape=(6 * len(self), 6 * m)))
        springs = self.constants[:, [0, 1, 1, 2, 2, 2]].ravel()
        return csc_array(gap.T @ (coo_array(gap).multiply(springs[:, None])))


def frames_along(axis: Array) -> Array:
    """Orthonormal axes (k, 3, 3) as rows, the first along the unit vectors (k, 3)."""
    helper = np.where(np.abs(axis[:, :1]) < 0.9, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
    second = np.cross(axis, helper)
    second /= np.linalg.norm(second, axis=1, keepdims=True)
    return np.stack([axis, second, np.cross(axis, second)], axis=1)


def rivets_of(parts: PartMesh, said: Sequence[tuple[str, Row, RivetData]]) -> Rivets | None:
    """The rivets of a target, row by row; None where there are none. Raises UserError for a point far from a part."""
    points: list[Array] = []
    axes: list[Array] = []
    ends: list[dict[int, float]] = []
    constants: list[Array] = []
    rows: list[str] = []
    surfaces = {name: Surface.of(parts, name) for _, row, _ in said for name in row.parts}
    for name, row, data in said:
        for number, point in enumerate(row.points):
            feet = [surfaces[part].foot(point) for part in row.parts]
            far = max(foot.distance for foot in feet)
            if far > FARTHEST:
                place = ", ".join(f"{1e3 * c:.4g}" for c in point)
                raise UserError(
                    f"target.rivets.{name}: rivet {number + 1} at ({place}) mm is {1e3 * far:.4g} mm away from a part "
                    f"that it joins ({' and '.join(row.parts)}); place it within {1e3 * FARTHEST:.0f} mm of both"
                )
            for part, foot in zip(row.parts, feet, strict=True):
                _refuse_beside(point, surfaces[part], foot, f"target.rivets.{name}: rivet {number + 1}", part)
            places = [foot.weights @ parts.nodes[foot.nodes] for foot in feet]
            gap = places[1] - places[0]
            size = float(np.linalg.norm(gap))
            apart = size > TOUCHING
            axes.append(gap / size if apart else feet[0].normal)
            points.append(0.5 * (places[0] + places[1]))
            ends += [foot.row() for foot in feet]
            constants.append(data.row(ONE_WAY if apart else EITHER_WAY))
            rows.append(name)
    if not points:
        return None
    return Rivets(np.array(points), np.array(axes), Anchors.of(ends), np.array(constants), parts.nodes, rows)


def _refuse_beside(point: Array, surface: Surface, foot: Foot, said: str, part: str) -> None:
    """Raise UserError for a rivet beyond a part's edge: its axis would be slanted, and shear be taken for tension."""
    way = point - foot.weights @ surface.nodes[foot.nodes]
    beyond = float(np.linalg.norm(way - (way @ foot.normal) * foot.normal))
    if beyond > max(BESIDE, SLANTED * foot.distance) and surface.on_border(foot):
        place = ", ".join(f"{1e3 * c:.4g}" for c in point)
        raise UserError(
            f"{said} at ({place}) mm lies {1e3 * beyond:.4g} mm beyond the edge of {part}, which it joins; place it "
            "where both parts lie behind each other"
        )
