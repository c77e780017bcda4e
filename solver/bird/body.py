"""What the coupling asks of a bird, whatever it is made of: n points with masses, stepped by kick and drift."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.histories import Array


class BirdBody(Protocol):
    """A bird of n particles or nodes; x: (n, 3) [m] at the whole step, v: (n, 3) [m/s] at the half step before.

    acceleration: (n, 3) [m/s^2]; active: (n,) points that may touch, eroded_now: (n,) those that no longer do since
    this step; energies: [J] by name; unit_dissipation: energy per unit of viscosity [J/(Pa s)]; subcycled:
    whether contact may act several times in a step of the bird; lag, push: (n, 3) [m/s], by how much v exceeds the
    mean of the step that ended, and half the kick of outer forces to come.
    """

    n: int
    energies: dict[str, float]
    unit_dissipation: float
    subcycled: bool

    @property
    def x(self) -> Array:
        """(n, 3) [m]."""
        ...

    @property
    def v(self) -> Array:
        """(n, 3) [m/s]."""
        ...

    @property
    def lag(self) -> Array:
        """(n, 3) [m/s]."""
        ...

    @property
    def push(self) -> Array:
        """(n, 3) [m/s]."""
        ...

    @property
    def masses(self) -> Array:
        """(n,) [kg]."""
        ...

    @property
    def acceleration(self) -> Array:
        """(n, 3) [m/s^2]."""
        ...

    @property
    def active(self) -> NDArray[np.bool_]:
        """(n,)."""
        ...

    @property
    def eroded_now(self) -> NDArray[np.bool_]:
        """(n,)."""
        ...

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

    def update_density(self, dt: float, /) -> None:
        """Density and stress after the step that ended, erosion."""
        ...

    def update_forces(self, dt: float, /) -> None:
        """Accelerations at the whole step."""
        ...

    def update_energies(self, dt: float, /) -> None:
        """Works of the step that ended."""
        ...

    def kick(self, dt: float) -> None:
        """Half-step velocities under the bird's own forces."""
        ...

    def drift(self, dt: float) -> None:
        """New positions."""
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

    def warnings(self, normal_energy: float, /) -> list[str]:
        """What the user should know of a run with this normal kinetic energy [J]."""
        ...

    def facts(self) -> dict[str, float]:
        """Counts for the summary: particles, eroded_particles, eroded_mass_fraction, and the method's own."""
        ...
