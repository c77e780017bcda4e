"""A plate or shell of four-node elements: its state, one step of its forces, its motion and its energies."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.histories import Array
from birdstrike.solver.arrays import node_rows
from birdstrike.solver.kernels.plate_motion import damped_energy, force_on_frame, kick_and_drift_nodes
from birdstrike.solver.kernels.shell import gather_nodal_forces, shell_forces, shell_hourglass, shell_strain
from birdstrike.solver.kernels.shell_erosion import erode_shells
from birdstrike.solver.kernels.shell_geometry import shell_geometry
from birdstrike.solver.kernels.shell_stress import update_shell_stress
from birdstrike.solver.kernels.sums import total, weighted_square
from birdstrike.solver.plate.boundary import DISPLACEMENTS, NAMED, ROTATIONS, Edges, EdgeStiffness
from birdstrike.solver.plate.material import LAYERS, ShellMaterial, through_thickness
from birdstrike.solver.plate.mesh import PlateMesh

__all__ = ["Plate", "ShellMaterial"]

HOURGLASS_COEFFICIENT = 0.05
ENERGIES = ("plate_internal", "plate_hourglass", "plate_edges", "plate_damping", "plate_eroded")


class Plate:
    """Shell nodes with six freedoms; x, v, omega: (m, 3); alive (e,): elements that have not been eroded.

    edges: "clamped", "pinned", "free" or springs; damping [1/s]: rate at which a free vibration's amplitude decays.
    """

    def __init__(
        self,
        mesh: PlateMesh,
        thickness: float,
        material: ShellMaterial,
        edges: str | EdgeStiffness = "clamped",
        damping: float = 0.0,
    ) -> None:
        m, e = len(mesh.nodes), len(mesh.quads)
        self.mesh, self.thickness, self.material, self.damping = mesh, thickness, material, damping
        self.quads, self.alive = mesh.quads, np.ones(e, np.bool_)
        self.x, self.v, self.omega = mesh.nodes.copy(), np.zeros((m, 3)), np.zeros((m, 3))
        self.v_before, self.omega_before = np.zeros((m, 3)), np.zeros((m, 3))
        self.frame, self.shape = np.zeros((e, 9)), np.zeros((e, 9))
        self.section = through_thickness(thickness)
        self.start, self.member = node_rows(mesh.quads, m)
        self.edges = Edges(mesh, NAMED[edges] if isinstance(edges, str) else edges)
        self.clear_stress()
        self.watch(np.empty(0, np.int64))
        self.strain, self.hourglass_strain = np.zeros((e, 8)), np.zeros((e, 9))
        self.force, self.nodal = np.zeros((e, 4, 6)), np.zeros((m, 6))
        self.works, self.taken = np.zeros((2, e)), np.zeros((2, e))
        shell_geometry(self.x, self.quads, self.alive, self.frame, self.shape)
        share = 0.25 * material.density * thickness * self.shape[:, 4]
        self.mass = np.bincount(mesh.quads.ravel(), np.repeat(share, 4), minlength=m)
        self.inertia = self.mass * thickness**2 / 12.0
        self.energies: dict[str, float] = dict.fromkeys(ENERGIES, 0.0)
        self.edge_work, self.damped, self.lost = 0.0, 0.0, (0, 0.0, 0.0)
        self.on_frame, self.air_impulse = np.zeros(6), np.zeros(3)

    @property
    def work(self) -> Array:
        """Work of the stresses over the step that ended, (e,) [J]."""
        return self.works[0]

    @property
    def hourglass_work(self) -> Array:
        """Work of the hourglass forces over the step that ended, (e,) [J]."""
        return self.works[1]

    @property
    def fixed(self) -> NDArray[np.bool_]:
        """Nodes that the frame holds in all displacements, (m,)."""
        return self.edges.held & DISPLACEMENTS == DISPLACEMENTS

    @property
    def fixed_rotation(self) -> NDArray[np.bool_]:
        """Nodes whose rotations the frame holds, (m,)."""
        return self.edges.held & ROTATIONS == ROTATIONS

    @property
    def eroded(self) -> int:
        """Elements that are gone."""
        return int(np.count_nonzero(~self.alive))

    def clear_stress(self) -> None:
        """Stress-free, edge springs at rest, and no memory of plastic strain."""
        e = len(self.quads)
        self.stress, self.back = np.zeros((e, LAYERS, 3)), np.zeros((e, LAYERS, 3))
        self.eps_p, self.resultant, self.hourglass = np.zeros((e, LAYERS)), np.zeros((e, 8)), np.zeros((e, 9))
        self.edges.relax()

    def preload(self, along_length: float, along_width: float) -> None:
        """Initial membrane stresses [Pa] along x and y, held by the frame; raises UserError for free edges."""
        first, second = self.frame[:, 0:3], self.frame[:, 3:6]
        for axis, value in ((0, along_length), (1, along_width)):
            a, b = first[:, axis], second[:, axis]
            self.stress += value * np.stack([a * a, b * b, a * b], axis=1)[:, None, :]
        self.update_forces(0.0)
        self.edges.balance(self.nodal)

    def watch(self, elements: NDArray[np.int64]) -> None:
        """From now on, `felt` (k, 8) sums the strain increments of these elements (k,), for strain gauges."""
        self.watched, self.felt = elements, np.zeros((len(elements), 8))

    def update_forces(self, dt: float) -> None:
        """Stress over the step that ended and the nodal forces of the present shape, `nodal` (m, 6) [N, N m]."""
        shell_geometry(self.x, self.quads, self.alive, self.frame, self.shape)
        self.stress_increment(dt)
        shell_forces(self.frame, self.shape, self.alive, self.resultant, self.hourglass, self.force)
        gather_nodal_forces(self.start, self.member, self.force, self.nodal)
        self.edge_work = self.edges.update_forces(self.v, self.omega, dt, self.nodal)

    def stress_increment(self, dt: float) -> None:
        """Strains from the half-step velocities, then layers, resultants, hourglass forces, and who failed."""
        rates = (self.v, self.omega, self.quads, self.alive, self.frame, self.shape, dt)
        shell_strain(*rates, self.strain, self.hourglass_strain)
        self.felt += self.strain[self.watched]
        m, area = self.material, self.shape[:, 4]
        metal = (m.elastic, m.hardening, m.rate(dt), m.failure_strain)
        state = (self.stress, self.back, self.eps_p, self.resultant)
        update_shell_stress(self.strain, area, self.alive, self.section, metal, *state, self.works[0])
        hourglass = (self.thickness, m.elastic, HOURGLASS_COEFFICIENT, self.hourglass, self.works[1])
        shell_hourglass(self.hourglass_strain, self.shape, self.alive, *hourglass)
        if np.isfinite(m.failure_strain):
            step = (area, self.strain, self.hourglass_strain, self.alive, self.resultant, self.hourglass)
            self.lost = erode_shells(self.eps_p, m.failure_strain, *step, self.works, self.taken)

    def update_energies(self) -> None:
        """Works of the step that ended [J]; what an eroded element had taken in is frozen as `plate_eroded`."""
        _, internal, hourglass = self.lost
        self.energies["plate_internal"] += total(self.works[0]) - internal
        self.energies["plate_hourglass"] += total(self.works[1]) - hourglass
        self.energies["plate_eroded"] += internal + hourglass
        self.energies["plate_edges"] += self.edge_work

    def kick_and_drift(self, kick: float, drift: float, applied: Array) -> None:
        """New half-step velocities under internal and applied forces (m, 3) [N], then new positions.

        What mass damping takes is counted half before and half after the whole step, as the kinetic energy is.
        """
        if self.damping > 0.0:
            self.v_before[:], self.omega_before[:] = self.v, self.omega
        forces = (self.nodal, applied, self.mass, self.inertia)
        held = (self.edges.held, self.edges.axes)
        kick_and_drift_nodes(kick, drift, self.damping, *forces, *held, self.v, self.omega, self.x)
        if self.damping > 0.0:
            motion = (self.v_before, self.v, self.omega_before, self.omega, self.air_impulse)
            taken = damped_energy(kick, self.damping, self.mass, self.inertia, *motion)
            self.energies["plate_damping"] += 0.5 * (self.damped + taken)
            self.damped = taken

    def reaction(self, applied: Array, result: Array) -> None:
        """Force of the plate on its frame into result (3,) [N]; with its moment about the origin in `on_frame` (6,)."""
        force_on_frame(self.nodal, applied, self.edges.held, self.edges.axes, self.x, self.on_frame)
        self.edges.add_to_frame(self.x, self.on_frame)
        result[:] = self.on_frame[:3]

    def kinetic_energy(self) -> float:
        """Of the half-step velocities [J]."""
        m = len(self.mass)
        return weighted_square(self.mass, self.v, m) + weighted_square(self.inertia, self.omega, m)

    def von_mises(self) -> Array:
        """Largest von Mises stress through the thickness of each element, (e,) [Pa]."""
        s = self.stress
        squared = s[..., 0] ** 2 - s[..., 0] * s[..., 1] + s[..., 1] ** 2 + 3.0 * s[..., 2] ** 2
        return np.sqrt(squared.max(axis=1))

    def highest_frequency(self, iterations: int = 60) -> float:
        """Largest circular frequency [rad/s] of the unloaded plate, its rigid holds released, by power iteration.

        The iteration on M^-1 K approaches from below; the caller's safety factor covers the remainder (below 1 % after
        60). Released holds can only raise the answer; springs are in it.
        """
        elastic = ShellMaterial(*self.material.elastic, self.material.density)
        trial = Plate(self.mesh, self.thickness, elastic, self.edges.stiffness.released())
        rng = np.random.default_rng(0)
        trial.v, trial.omega = rng.standard_normal(self.x.shape), rng.standard_normal(self.x.shape) / self.thickness
        squared = 0.0
        for _ in range(iterations):
            norm = np.sqrt(2.0 * trial.kinetic_energy())
            trial.v, trial.omega = 1e-9 * trial.v / norm, 1e-9 * trial.omega / norm
            trial.clear_stress()
            trial.update_forces(1.0)
            trial.v, trial.omega = (
                -trial.nodal[:, :3] / trial.mass[:, None],
                -trial.nodal[:, 3:] / trial.inertia[:, None],
            )
            squared = np.sqrt(2.0 * trial.kinetic_energy()) / 1e-9
        return float(np.sqrt(squared))

    def stable_step(self) -> float:
        """Largest stable step of central differences, 2/omega_max [s]."""
        return 2.0 / self.highest_frequency()
