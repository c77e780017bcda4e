"""Blocks of four-node shells: their state and one step of their forces; and shells that never move."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.histories import Array
from birdstrike.solver.arrays import node_rows
from birdstrike.solver.kernels.sums import total
from birdstrike.solver.kernels.target.metal import EPS_P, FLOW, MEMORY
from birdstrike.solver.kernels.target.shell import gather_nodal_forces, shell_forces, shell_hourglass, shell_strain
from birdstrike.solver.kernels.target.shell_erosion import erode_shells
from birdstrike.solver.kernels.target.shell_geometry import shell_geometry
from birdstrike.solver.kernels.target.shell_stress import update_shell_stress
from birdstrike.solver.target.nodes import Nodes
from birdstrike.solver.target.section import Section, SectionTable

HOURGLASS_COEFFICIENT = 0.05
SQUARE = 1e-9  # of the metric: rounding of a square
ENERGIES = ("plate_internal", "plate_hourglass", "plate_eroded")


class ShellBlock:
    """Shells of one or several sections; quads (e, 4) of nodes, section (e,): which one each element has.

    nodes: of the target at rest, (m, 3) [m]; scaled_inertia: rotary inertia of at least area/12 per mass in place of
    thickness^2/12, so that thin shells do not rule the step (T. J. R. Hughes, M. Cohen & M. Haroun, Nucl. Eng. Des. 46
    (1978) 203); like the mesh's own error, what it changes falls with the square of the shells' size.
    """

    shape_size, modes, corners = 9, 9, 4
    """Numbers that the kernels keep of an element's shape and of its hourglass modes, and its nodes."""
    square_share = 1.0
    """Of the square of an element's size, the area of one."""

    def __init__(
        self,
        nodes: Array,
        quads: NDArray[np.int64],
        sections: Sequence[Section],
        section: NDArray[np.int64] | None = None,
        scaled_inertia: bool = False,
    ) -> None:
        e = len(quads)
        self.rest, self.quads, self.scaled_inertia = nodes, quads, scaled_inertia
        self.sections, self.table = list(sections), SectionTable(sections)
        self.section = np.zeros(e, np.int64) if section is None else section
        self.thickness = self.table.elastic[self.section, 0]
        self.facets, self.alive = quads, np.ones(e, np.bool_)
        self.skin: Array = 0.5 * self.thickness
        self.can_fail = any(one.can_fail for one in self.sections)
        self.frame, self.shape = np.zeros((e, 9)), np.zeros((e, self.shape_size))
        self.clear_stress()
        self.watch(np.empty(0, np.int64))
        self.strain, self.hourglass_strain = np.zeros((e, 8)), np.zeros((e, self.modes))
        self.force = np.zeros((e, 4, 6))
        self.works, self.taken = np.zeros((2, e)), np.zeros((2, e))
        self.set_up(nodes)
        self.size = self.sizes_across_a_crack(nodes)
        self.energies: dict[str, float] = dict.fromkeys(ENERGIES, 0.0)
        self.lost = (0, 0.0, 0.0)

    def sizes_across_a_crack(self, nodes: Array) -> Array:
        """(e, 4) The element's size [m], and by what it is longer or shorter along a direction, see `crack_band`."""
        axes = self.frame.reshape(-1, 3, 3)[:, :2]
        jacobian = np.stack([np.einsum("eac,ec->ea", axes, one) for one in self.mid_lines(nodes)], axis=2)
        area = self.shape[:, 4] / self.square_share
        metric = jacobian @ jacobian.transpose(0, 2, 1) / area[:, None, None]
        off = np.stack([metric[:, 0, 0] - 1.0, metric[:, 1, 1] - 1.0, metric[:, 0, 1]], axis=1)
        off[np.abs(off).max(axis=1) < SQUARE] = 0.0
        return np.column_stack([np.sqrt(area), off])

    def mid_lines(self, nodes: Array) -> tuple[Array, ...]:
        """The lines between the middles of opposite sides, 2 x (e, 3) [m]."""
        a, b, c, d = (nodes[self.quads[:, corner]] for corner in range(4))
        return 0.5 * (b + c - a - d), 0.5 * (c + d - a - b)

    def set_up(self, nodes: Array) -> None:
        """Geometry at rest: nodes of the target (m, 3) [m]."""
        self.start, self.member = node_rows(self.quads, len(nodes))
        self.update_geometry(nodes)

    @property
    def eps_p(self) -> Array:
        """Plastic strain of every layer, (e, k)."""
        return self.memory[:, :, EPS_P]

    @property
    def work(self) -> Array:
        """Work of the stresses over the step that ended, (e,) [J]."""
        return self.works[0]

    @property
    def hourglass_work(self) -> Array:
        """Work of the hourglass forces over the step that ended, (e,) [J]."""
        return self.works[1]

    @property
    def eroded(self) -> int:
        """Elements that are gone."""
        return int(np.count_nonzero(~self.alive))

    def clear_stress(self) -> None:
        """Stress-free, and no memory of plastic strain."""
        e, k = len(self.quads), int(self.table.layers.max())
        self.stress, self.back = np.zeros((e, k, 3)), np.zeros((e, k, 3))
        self.memory, self.gone = np.zeros((e, k, MEMORY)), np.zeros((e, k), np.bool_)
        self.memory[:, :, FLOW] = self.table.start[self.section, None]
        self.resultant, self.hourglass = np.zeros((e, 8)), np.zeros((e, self.modes))

    def watch(self, elements: NDArray[np.int64]) -> None:
        """From now on, `felt` (k, 8) sums the strain increments of these elements (k,), for strain gauges."""
        self.watched, self.felt = elements, np.zeros((len(elements), 8))

    def add_mass(self, nodes: Nodes) -> None:
        """An equal part of each element to each corner; unscaled inertia is that of the thickest section there."""
        density = np.array([section.density for section in self.sections])[self.section]
        share = density * self.thickness * self.shape[:, 4] / self.corners
        ends = self.quads[:, : self.corners].ravel()
        mass = np.bincount(ends, np.repeat(share, self.corners), minlength=len(nodes))
        nodes.mass += mass
        if self.scaled_inertia:
            rotary = share * np.maximum(self.thickness**2, self.shape[:, 4] / self.square_share) / 12.0
            nodes.inertia += np.bincount(ends, np.repeat(rotary, self.corners), minlength=len(nodes))
            return
        thickest = np.zeros(len(nodes))
        np.maximum.at(thickest, ends, np.repeat(self.thickness, self.corners))
        nodes.inertia += mass * thickest**2 / 12.0

    def prestress(self, along_x: float, along_y: float) -> None:
        """Add membrane stresses [Pa] along x and y."""
        first, second = self.frame[:, 0:3], self.frame[:, 3:6]
        for axis, value in ((0, along_x), (1, along_y)):
            a, b = first[:, axis], second[:, axis]
            self.stress += value * np.stack([a * a, b * b, a * b], axis=1)[:, None, :]

    def add_forces(self, nodes: Nodes, dt: float) -> None:
        """Stress over the step that ended, and the forces of the present shape added to `nodes.nodal`."""
        self.update_geometry(nodes.x)
        self.stress_increment(nodes, dt)
        self.element_forces()
        gather_nodal_forces(self.start, self.member, self.force, nodes.nodal)

    def stress_increment(self, nodes: Nodes, dt: float) -> None:
        """Strains from the half-step velocities, then layers, resultants, hourglass forces, and who failed."""
        self.update_strain(nodes, dt)
        if len(self.watched):
            self.felt += self.strain[self.watched]
        area, table = self.shape[:, 4], self.table
        sections = (self.section, table.first, table.heights, table.rows)
        layers = (self.stress, self.back, self.memory, self.gone)
        where = (area, self.alive, sections, self.size, dt)
        update_shell_stress(self.strain, *where, layers, self.resultant, self.works[0])
        self.update_hourglass()
        if self.can_fail:
            step = (area, self.strain, self.hourglass_strain, self.alive, self.resultant, self.hourglass)
            count = table.layers[self.section]
            self.lost = erode_shells(count, self.gone, *step, self.works, self.taken)

    def update_geometry(self, x: Array) -> None:
        """Frames and gradients of the present positions (m, 3) [m]."""
        shell_geometry(x, self.quads, self.alive, self.frame, self.shape)

    def update_strain(self, nodes: Nodes, dt: float) -> None:
        """Increments of the step from the half-step velocities."""
        rates = (nodes.v, nodes.omega, self.quads, self.alive, self.frame, self.shape, dt)
        shell_strain(*rates, self.strain, self.hourglass_strain)

    def update_hourglass(self) -> None:
        """Hourglass resultants, and their work."""
        hourglass = (self.section, self.table.elastic, HOURGLASS_COEFFICIENT, self.hourglass, self.works[1])
        shell_hourglass(self.hourglass_strain, self.shape, self.alive, *hourglass)

    def element_forces(self) -> None:
        """Forces of each element on its nodes."""
        shell_forces(self.frame, self.shape, self.alive, self.resultant, self.hourglass, self.force)

    def update_energies(self) -> None:
        """Works of the step that ended [J]; what an eroded element had taken in is frozen as `plate_eroded`."""
        _, internal, hourglass = self.lost
        self.energies["plate_internal"] += total(self.works[0]) - internal
        self.energies["plate_hourglass"] += total(self.works[1]) - hourglass
        self.energies["plate_eroded"] += internal + hourglass

    def von_mises(self) -> Array:
        """Largest von Mises stress through the thickness of each element, (e,) [Pa]."""
        s = self.stress
        squared = s[..., 0] ** 2 - s[..., 0] * s[..., 1] + s[..., 1] ** 2 + 3.0 * s[..., 2] ** 2
        return np.sqrt(squared.max(axis=1))

    def elastic(self) -> ShellBlock:
        """The same elements at rest, without yielding."""
        sections = [one.elastic() for one in self.sections]
        return type(self)(self.rest, self.quads, sections, self.section, self.scaled_inertia)


class RigidShells:
    """Shells that neither move nor strain; they carry no momentum, so their nodes must be held."""

    def __init__(self, quads: NDArray[np.int64], thickness: float) -> None:
        self.facets, self.thickness = quads, np.full(len(quads), thickness)
        self.skin: Array = 0.5 * self.thickness
        self.alive = np.ones(len(quads), np.bool_)
        self.eps_p, self.eroded = np.zeros((len(quads), 1)), 0
        self.energies: dict[str, float] = dict.fromkeys(ENERGIES[:2], 0.0)

    def add_mass(self, nodes: Nodes) -> None:
        """None."""

    def add_forces(self, nodes: Nodes, dt: float) -> None:
        """None."""

    def update_energies(self) -> None:
        """Nothing is stored."""

    def clear_stress(self) -> None:
        """There is none."""

    def elastic(self) -> None:
        """It does not strain."""

    def von_mises(self) -> Array:
        """Not known to a rigid plate, given as 0."""
        return np.zeros(len(self.facets))
