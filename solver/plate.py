"""The plate as four-node shells: state, one step of its internal forces, and its largest stable step."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from data.histories import Array
from solver.geometry import PlateMesh
from solver.kernels.motion import force_on_frame, kick_and_drift_nodes
from solver.kernels.shell import (
    gather_nodal_forces,
    shell_forces,
    shell_geometry,
    shell_hourglass,
    shell_strain,
)
from solver.kernels.shell_stress import update_shell_stress
from solver.kernels.sums import total, weighted_square

LAYERS = 5
HOURGLASS_COEFFICIENT = 0.05


@dataclass(frozen=True)
class ShellMaterial:
    """Elastic-plastic shell; SI. beta: 0 kinematic .. 1 isotropic hardening with Ep = E Et/(E - Et)."""

    young: float
    poisson: float
    density: float
    yield_stress: float = np.inf
    tangent_modulus: float = 0.0
    beta: float = 1.0

    @property
    def elastic(self) -> tuple[float, float]:
        return self.young, self.poisson

    @property
    def hardening(self) -> tuple[float, float, float]:
        """Yield stress, isotropic and kinematic hardening modulus [Pa]."""
        modulus = self.young * self.tangent_modulus / (self.young - self.tangent_modulus)
        return self.yield_stress, self.beta * modulus, (1.0 - self.beta) * modulus


def through_thickness(thickness: float, layers: int = LAYERS) -> Array:
    """Gauss heights and weights [m] of the layers, the thickness in a last row."""
    points, weights = np.polynomial.legendre.leggauss(layers)
    return np.vstack([0.5 * thickness * np.column_stack([points, weights]), [thickness, 0.0]])


def node_rows(quads: NDArray[np.int64], nodes: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """For every node its (4 element + corner) numbers, in compressed rows."""
    flat = quads.ravel()
    start = np.concatenate([[0], np.cumsum(np.bincount(flat, minlength=nodes))])
    return start.astype(np.int64), np.argsort(flat, kind="stable").astype(np.int64)


class Plate:
    """Shell nodes with six freedoms; x, v, omega: (m, 3); fixed, fixed_rotation: (m,) nodes held by the frame."""

    def __init__(self, mesh: PlateMesh, thickness: float, material: ShellMaterial, edges: str) -> None:
        m, e = len(mesh.nodes), len(mesh.quads)
        self.mesh, self.thickness, self.material = mesh, thickness, material
        self.quads, self.alive = mesh.quads, np.ones(e, np.bool_)
        self.x, self.v, self.omega = mesh.nodes.copy(), np.zeros((m, 3)), np.zeros((m, 3))
        self.frame, self.shape = np.zeros((e, 9)), np.zeros((e, 7))
        self.section = through_thickness(thickness)
        self.start, self.member = node_rows(mesh.quads, m)
        self.clear_stress()
        self.watch(np.empty(0, np.int64))
        self.strain, self.hourglass_strain = np.zeros((e, 8)), np.zeros((e, 5))
        self.force, self.nodal = np.zeros((e, 4, 6)), np.zeros((m, 6))
        self.work, self.hourglass_work = np.zeros(e), np.zeros(e)
        held = np.zeros(m, np.bool_)
        held[mesh.rim] = edges != "free"
        self.fixed, self.fixed_rotation = held, held & (edges == "clamped")
        shell_geometry(self.x, self.quads, self.alive, self.frame, self.shape)
        share = 0.25 * material.density * thickness * self.shape[:, 4]
        self.mass = np.bincount(mesh.quads.ravel(), np.repeat(share, 4), minlength=m)
        self.inertia = self.mass * thickness**2 / 12.0
        self.accounts: dict[str, float] = dict.fromkeys(("plate_internal", "plate_hourglass"), 0.0)

    def clear_stress(self) -> None:
        """Stress-free, and no memory of plastic strain."""
        e = len(self.quads)
        self.stress, self.back = np.zeros((e, LAYERS, 3)), np.zeros((e, LAYERS, 3))
        self.eps_p, self.resultant, self.hourglass = np.zeros((e, LAYERS)), np.zeros((e, 8)), np.zeros((e, 5))

    def watch(self, elements: NDArray[np.int64]) -> None:
        """From now on, `felt` (k, 8) sums the strain increments of these elements (k,), for strain gauges."""
        self.watched, self.felt = elements, np.zeros((len(elements), 8))

    def update_forces(self, dt: float) -> None:
        """Stress over the step that ended and the nodal forces of the present shape, `nodal` (m, 6) [N, N m]."""
        shell_geometry(self.x, self.quads, self.alive, self.frame, self.shape)
        self.stress_increment(dt)
        shell_forces(self.frame, self.shape, self.alive, self.resultant, self.hourglass, self.force)
        gather_nodal_forces(self.start, self.member, self.force, self.nodal)

    def stress_increment(self, dt: float) -> None:
        """Strains from the half-step velocities, then layers, resultants and hourglass forces."""
        rates = (self.v, self.omega, self.quads, self.alive, self.frame, self.shape, dt)
        shell_strain(*rates, self.strain, self.hourglass_strain)
        self.felt += self.strain[self.watched]
        material = (self.section, self.material.elastic, self.material.hardening)
        state = (self.stress, self.back, self.eps_p, self.resultant, self.work)
        update_shell_stress(self.strain, self.shape[:, 4], self.alive, *material, *state)
        hourglass = (self.thickness, self.material.elastic, HOURGLASS_COEFFICIENT, self.hourglass, self.hourglass_work)
        shell_hourglass(self.hourglass_strain, self.shape, self.alive, *hourglass)

    def keep_books(self) -> None:
        """Works of the step that ended [J]."""
        self.accounts["plate_internal"] += total(self.work)
        self.accounts["plate_hourglass"] += total(self.hourglass_work)

    def kick_and_drift(self, kick: float, drift: float, applied: Array) -> None:
        """New half-step velocities under internal and applied forces (m, 3) [N], then new positions."""
        held = (self.fixed, self.fixed_rotation)
        forces = (self.nodal, applied, self.mass, self.inertia)
        kick_and_drift_nodes(kick, drift, *forces, *held, self.v, self.omega, self.x)

    def reaction(self, applied: Array, result: Array) -> None:
        """Force of the plate on its frame into result (3,) [N]: what the held nodes would otherwise feel."""
        force_on_frame(self.nodal, applied, self.fixed, result)

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
        """Largest circular frequency [rad/s] of the free unloaded plate, by power iteration on M^-1 K.

        The iteration approaches from below; the caller's safety factor covers the remainder (below 1 % after 60).
        """
        trial = Plate(self.mesh, self.thickness, self.material, "free")
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
