"""A single layer of a shell's law without the shell: strain in, stress out; for closed forms and for users' checks."""

from __future__ import annotations

from copy import deepcopy

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.solver.kernels.target.metal import EPS_P, FLOW, HEAT, MEMORY, POISSON, YOUNG, first_flow
from birdstrike.solver.kernels.target.plasticity import return_to_yield


class Layer:
    """A point under plane stress; row: of its law; size [m]: of the element that it would stand in.

    stress (3,): xx yy xy [Pa]; failed: whether it has reached the law's end.
    """

    def __init__(self, row: Array, size: float = 1e-3) -> None:
        self.row, self.size, self.failed = row, size, False
        self.stress, self.back, self.memory = np.zeros(3), np.zeros(3), np.zeros(MEMORY)
        self.memory[FLOW] = first_flow(row)
        young, nu = row[YOUNG], row[POISSON]
        plane = young / (1.0 - nu * nu)
        self.stiffness = plane * np.array([[1.0, nu, 0.0], [nu, 1.0, 0.0], [0.0, 0.0, 0.5 * (1.0 - nu)]])

    @property
    def eps_p(self) -> float:
        """Equivalent plastic strain."""
        return float(self.memory[EPS_P])

    @property
    def heat(self) -> float:
        """Rise of temperature [K]."""
        return float(self.memory[HEAT])

    def strain(self, increment: Array, dt: float = 1.0) -> None:
        """Add increments of strain xx, yy and engineering xy (3,) over dt [s]."""
        self.stress += self.stiffness @ increment
        self.failed = bool(return_to_yield(self.stress, self.back, self.memory, self.row, self.size, dt))

    def pull(self, increment: float, dt: float = 1.0) -> None:
        """Add an increment of strain xx with the lateral stress held at zero, by bisection of the lateral strain."""
        start = deepcopy(vars(self))
        low, high = -2.0 * abs(increment), 2.0 * abs(increment)
        for _ in range(80):
            self.__dict__.update(deepcopy(start))
            lateral = 0.5 * (low + high)
            self.strain(np.array([increment, lateral, 0.0]), dt)
            low, high = (lateral, high) if self.stress[1] < 0.0 else (low, lateral)
