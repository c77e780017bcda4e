"""A rigid plate: a target that does not move, for the pressures and impulses of Wilbeck's problem."""

from __future__ import annotations

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.solver.plate.mesh import PlateMesh
from birdstrike.solver.plate.shell import Plate


class RigidPlate:
    """A target (see `shell.Plate`), without motion, strain or energy.

    The whole plate is its own frame: what contact gives it, the frame feels. mass is 0: it carries no momentum.
    """

    def __init__(self, mesh: PlateMesh, thickness: float) -> None:
        m, e = len(mesh.nodes), len(mesh.quads)
        self.mesh, self.thickness, self.quads = mesh, thickness, mesh.quads
        self.alive = np.ones(e, np.bool_)
        self.x, self.v, self.omega = mesh.nodes.copy(), np.zeros((m, 3)), np.zeros((m, 3))
        self.mass, self.inertia, self.nodal = np.zeros(m), np.zeros(m), np.zeros((m, 6))
        self.fixed, self.fixed_rotation = np.ones(m, np.bool_), np.ones(m, np.bool_)
        self.eroded, self.air_impulse = 0, np.zeros(3)
        self.eps_p = np.zeros((e, 1))
        self.energies: dict[str, float] = dict.fromkeys(("plate_internal", "plate_hourglass"), 0.0)

    def update_forces(self, dt: float) -> None:
        """Nothing strains."""

    def update_energies(self) -> None:
        """Nothing is stored."""

    def kick_and_drift(self, kick: float, drift: float, applied: Array) -> None:
        """Nothing moves."""

    def reaction(self, applied: Array, result: Array) -> None:
        """Force on the frame into result (3,) [N]: the contact's own."""
        result[:] = applied.sum(axis=0)

    def kinetic_energy(self) -> float:
        """[J]."""
        return 0.0

    def von_mises(self) -> Array:
        """Of each element, (e,) [Pa]: not known to a rigid plate, given as 0."""
        return np.zeros(len(self.quads))

    def stable_step(self) -> float:
        """No limit [s]."""
        return np.inf


Target = Plate | RigidPlate
"""What a bird can hit."""
