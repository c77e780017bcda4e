"""The nodes of a target, which its blocks of elements share: their motion, mass, and what holds them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.histories import Array
from birdstrike.solver.kernels.sums import weighted_square
from birdstrike.solver.kernels.target.node_motion import damped_energy, kick_and_drift_nodes


class Nodes:
    """Nodes with six freedoms; x [m], v [m/s], omega [rad/s]: (m, 3); mass [kg], inertia [kg m^2]: (m,).

    nodal (m, 6): forces of blocks and supports [N, N m]; held (m,): bits of held freedoms in each node's own axes
    (m, 3, 3), see `kernels.target.node_motion`; damping [1/s]: rate at which a free vibration's amplitude decays.
    """

    def __init__(self, rest: Array, damping: float = 0.0) -> None:
        m = len(rest)
        self.x, self.v, self.omega = rest.copy(), np.zeros((m, 3)), np.zeros((m, 3))
        self.v_before, self.omega_before = np.zeros((m, 3)), np.zeros((m, 3))
        self.mass, self.inertia, self.nodal = np.zeros(m), np.zeros(m), np.zeros((m, 6))
        self.held: NDArray[np.int64] = np.zeros(m, np.int64)
        self.axes = np.tile(np.eye(3), (m, 1, 1))
        self.damping, self.damped, self.air_impulse = damping, 0.0, np.zeros(3)

    def __len__(self) -> int:
        return len(self.x)

    def kick_and_drift(self, kick: float, drift: float, applied: Array) -> float:
        """New half-step velocities under internal and applied forces (m, 3) [N], then new positions.

        Returns what mass damping took [J], counted half before and half after the whole step, as the kinetic energy is.
        """
        if self.damping > 0.0:
            self.v_before[:], self.omega_before[:] = self.v, self.omega
        forces = (self.nodal, applied, self.mass, self.inertia)
        kick_and_drift_nodes(kick, drift, self.damping, *forces, self.held, self.axes, self.v, self.omega, self.x)
        if self.damping <= 0.0:
            return 0.0
        motion = (self.v_before, self.v, self.omega_before, self.omega, self.air_impulse)
        before, self.damped = self.damped, damped_energy(kick, self.damping, self.mass, self.inertia, *motion)
        return 0.5 * (before + self.damped)

    def kinetic_energy(self) -> float:
        """Of the half-step velocities [J]."""
        m = len(self)
        return weighted_square(self.mass, self.v, m) + weighted_square(self.inertia, self.omega, m)
