"""What a strike asks of a bird, whatever it is made of: n points of contact with masses, stepped by kick and drift."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from data.histories import Array


class BirdBody(Protocol):
    """A bird of n particles or nodes; x: (n, 3) [m] at the whole step, v: (n, 3) [m/s] at the half step before.

    acceleration: (n, 3) [m/s^2]; active: (n,) points that may touch, eroded_now: (n,) those that no longer do since
    this step; accounts: energies [J] by name; unit_dissipation: energy per unit of viscosity [J/(Pa s)].
    """

    n: int
    x: Array
    v: Array
    masses: Array
    acceleration: Array
    active: NDArray[np.bool_]
    eroded_now: NDArray[np.bool_]
    accounts: dict[str, float]
    unit_dissipation: float

    @property
    def spacing(self) -> float:
        """Edge of the cube that a particle or an element stands for [m]."""
        ...

    @property
    def skin(self) -> float:
        """From a point of contact to the bird's surface [m]."""
        ...

    @property
    def bulk_modulus(self) -> float:
        """[Pa], at rest."""
        ...

    @property
    def p(self) -> Array:
        """Pressure at the points [Pa]."""
        ...

    @property
    def cells(self) -> NDArray[np.int64]:
        """(k, 8) nodes of the live hexahedra; none of particles."""
        ...

    def update_density(self, dt: float) -> None:
        """Density and stress after the step that ended, erosion."""
        ...

    def update_forces(self, dt: float) -> None:
        """Accelerations at the whole step."""
        ...

    def keep_books(self, dt: float) -> None:
        """Works of the step that ended."""
        ...

    def kick_and_drift(self, kick: float, drift: float) -> None:
        """New half-step velocities, then new positions."""
        ...

    def kinetic_energy(self) -> float:
        """Of the half-step velocities [J]."""
        ...

    def step_at_impact(self, normal_speed: float) -> float:
        """Largest stable step [s] at an impact of this speed [m/s]."""
        ...

    def equivalent_viscosity(self) -> float:
        """Shear viscosity [Pa s] that the shock viscosity stood in for."""
        ...

    def von_mises(self) -> Array:
        """Von Mises stress at the points, (n,) [Pa]."""
        ...

    def warnings(self, _normal_energy: float) -> list[str]:
        """What the user should know of a run with this normal kinetic energy [J]."""
        ...

    def facts(self) -> dict[str, float]:
        """Counts for the summary: particles, eroded_particles, eroded_mass_fraction, and the method's own."""
        ...
