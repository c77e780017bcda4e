"""The elastic bird in total-Lagrangian SPH: it stays in one piece, and its stored energy is a function of its shape."""

from __future__ import annotations

from typing import Any

import numpy as np

from birdstrike.data.errors import RunFailed
from birdstrike.data.histories import Array
from birdstrike.solver.bird.materials.solid import Solid
from birdstrike.solver.bird.neighbour_list import VerletList
from birdstrike.solver.bird.sph import Bird
from birdstrike.solver.kernels.bird.neo_hookean import neo_hookean_stress, unit_shear_power
from birdstrike.solver.kernels.bird.total_lagrangian import (
    ROW,
    deformation_gradient,
    elastic_forces,
    reference_correction,
)
from birdstrike.solver.kernels.sums import total, work_of_forces

HOURGLASS = 5.0  # hourglass modulus over Young's
BULK_SHARE = (0.3, 0.5)  # what the pair viscosity's coefficients amount to in plane compression


class ElasticBird(Bird):
    """A `Bird` that keeps its first neighbours; energies: bird_stress (stored), bird_hourglass, bird_shock.

    Nothing erodes, and `rho`, `p` follow from the deformation gradient. Raises RunFailed when a particle is turned
    inside out.
    """

    material: Solid
    subcycled = False

    def __init__(self, *state: Any, **more: Any) -> None:
        super().__init__(*state, **more)
        n, m = self.n, self.material
        self.list = VerletList(n, 2.0 * self.h, skin=0.0)
        self.list.build(self.x, self.active)
        self.kernel = (self.volume, self.h, self.slope, self.list.start, self.list.neighbour)
        self.correction, self.lattice_row = np.zeros((n, 6)), np.zeros((n, ROW))
        self.lattice_row[:, 3:6] = self.x
        reference_correction(n, self.x, *self.kernel, self.correction)
        self.jacobian, self.bulk_stress, self.stresses = np.ones(n), np.zeros(n), np.zeros((n, 2))
        self.gradient_before, self.shear_power = np.tile(np.eye(3).ravel(), (n, 1)), np.zeros(n)
        self.penalty, self.penalty_before = np.zeros((n, 3)), np.zeros((n, 3))
        self.moduli = np.array([m.shear_modulus, m.bulk_modulus])
        speed = m.fastest_wave(1e-3)
        self.bulk = np.array(BULK_SHARE) * self.shock * np.array([speed * self.h, self.h**2])
        self.hourglass = HOURGLASS * m.young
        self.energies = dict.fromkeys(("bird_stress", "bird_hourglass", "bird_shock", "eroded"), 0.0)

    def update_density(self, dt: float) -> None:
        """Deformation gradient, stress, density and pressure at the present positions."""
        n = self.n
        deformation_gradient(n, self.x, *self.kernel, self.correction, self.lattice_row)
        law = (self.material.rho0, self.moduli, self.bulk, self.correction)
        memory = (self.lattice_row, self.jacobian, self.bulk_stress)
        neo_hookean_stress(n, dt, *law, *memory, self.stresses, self.energy, self.work)
        if not self.jacobian.min() > 0.0:
            raise RunFailed("an elastic bird particle was turned inside out", "lower solver.courant")
        unit_shear_power(n, dt, self.lattice_row, self.gradient_before, self.shear_power)
        self.rho[:n], self.p[:n] = self.material.rho0 / self.jacobian, self.stresses[:, 1]

    def update_forces(self, _dt: float) -> None:
        """Accelerations at the whole step."""
        self.penalty, self.penalty_before = self.penalty_before, self.penalty
        stiff = (self.hourglass, self.list.start, self.list.neighbour)
        body = (self.lattice_row, self.mass, self.volume, self.h, self.slope)
        elastic_forces(self.n, *body, *stiff, self.acceleration, self.penalty)

    def update_energies(self, dt: float) -> None:
        """The energy that is stored, and the works of hourglass control and bulk viscosity over the step that ended."""
        self.energies["bird_stress"] = self.volume * total(self.energy)
        work = work_of_forces(self.penalty_before, self.penalty, self.v, self.n)
        self.energies["bird_hourglass"] -= dt * self.mass * work
        self.unit_dissipation += dt * self.volume * total(self.shear_power)
        self.energies["bird_shock"] += self.volume * total(self.work)

    def may_erode(self, _stiffening: float, /) -> bool:
        """Never."""
        return False

    def von_mises(self) -> Array:
        """Von Mises stress of each particle, (n,) [Pa]."""
        return self.stresses[:, 0].copy()

    def stable_step(self, speed_of_sound: float) -> float:
        """As every bird's, with the hourglass modulus beside the longitudinal one."""
        stiff = np.sqrt(speed_of_sound**2 + self.hourglass / self.material.rho0)
        return super().stable_step(float(stiff))

    def step_at_impact(self, normal_speed: float) -> float:
        """Largest stable step [s]; squeezed by u over the bar speed, the lattice's waves are as much faster."""
        slow = np.sqrt(self.material.young / self.material.rho0)
        squeeze = max(1.0 - normal_speed / slow, 0.25)
        return squeeze * self.stable_step(self.material.fastest_wave(normal_speed))
