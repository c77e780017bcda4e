"""The bird with strength as SPH particles: deviator by an objective rate, its divergence beside the pair forces."""

from __future__ import annotations

from typing import Any

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.solver.bird.eos.compiled import with_law
from birdstrike.solver.bird.materials.solid import Solid
from birdstrike.solver.bird.sph import Bird
from birdstrike.solver.kernels.bird.columns import ROW
from birdstrike.solver.kernels.bird.solid_material import update_solid_material
from birdstrike.solver.kernels.bird.sph import pack_state, pair_forces
from birdstrike.solver.kernels.bird.sph_strength import add_stress_forces, pack_stress
from birdstrike.solver.kernels.bird.velocity_gradient import pack_midpoint, velocity_gradient
from birdstrike.solver.kernels.sums import total

REPULSION = (0.3, 0.7)  # stiffness over bulk modulus times spacing, and the distance below which it acts over spacing


class SolidBird(Bird):
    """A `Bird` whose stress is -p I + s; s and its back stress (N, 6) [Pa], eps_p (N,) equivalent plastic strain.

    energies: bird_stress, the work of s; bird_repulsion, that of the springs between particles that clump.
    """

    material: Solid
    subcycled = False

    def __init__(self, *state: Any, **more: Any) -> None:
        super().__init__(*state, **more)
        rows = len(self.x)
        self.stress, self.back, self.eps_p = np.zeros((rows, 6)), np.zeros((rows, 6)), np.zeros(rows)
        self.rates, self.correction = np.zeros((rows, 9)), np.zeros((rows, 6))
        self.stress_row, self.repelled = np.zeros((rows, ROW)), np.zeros(rows)
        self.works, self.stored_stress = np.zeros((rows, 2)), np.zeros(rows)
        self.repulsion = np.array(REPULSION) * [self.bulk_modulus * self.spacing, self.spacing]
        self.update_material = with_law(update_solid_material, self.material.eos.terms)
        self.strength, self.wave = self.material.strength, 4.0 / 3.0 * self.material.shear_modulus
        self.energies |= {"bird_stress": 0.0, "bird_repulsion": 0.0}

    def update_density(self, dt: float) -> None:
        """Density, deviator and pressure over the step that ended, erosion. Raises RunFailed on a lost density."""
        self.list.refresh(self.x, self.active)
        rows = self.list.rows
        pack_midpoint(len(self.x), self.x, self.v, self.lag, self.rho, dt, self.row)
        kernel = (self.row, self.mass, self.h, self.slope, *rows)
        velocity_gradient(self.n, *kernel, self.drho_dt, self.rates, self.correction)
        self.deformation[: self.n] = self.rates[: self.n, :6]
        material = (self.material.eos.constants, self.limits, self.strength)
        state = (self.rho, self.p, self.energy, self.c, self.stress, self.back, self.eps_p)
        erosion = (self.active, self.eroded_now, self.works)
        self.update_material(self.n, dt, *material, self.rates, self.drho_dt, self.heating, *state, *erosion)
        self.c[: self.n] = np.sqrt(self.c[: self.n] ** 2 + self.wave / self.rho[: self.n])
        self.work[:] = self.works[:, 0]
        self.stored += self.work
        self.stored_stress += self.works[:, 1]
        self.after_material()

    def refresh_images(self) -> None:
        """Images follow their parents, stress included."""
        super().refresh_images()
        if self.images is not None and hasattr(self, "stress"):
            self.stress[self.n :] = self.stress[self.images.parent]
            self.correction[self.n :] = self.correction[self.images.parent]

    def update_forces(self, dt: float) -> None:
        """Accelerations and dissipated powers at the whole step."""
        rows = self.list.rows
        state = (self.rho, self.stress, self.correction)
        pack_stress(
            len(self.x),
            self.x,
            self.v,
            self.push,
            self.acceleration,
            self.acceleration_before,
            dt,
            self.mass,
            *state,
            self.stress_row,
        )
        fluid = (self.rho, self.p, self.c)
        motion = (self.x, self.v, self.push, self.acceleration, self.acceleration_before)
        pack_state(len(self.x), *motion, *fluid, dt, self.row)
        self.acceleration, self.acceleration_before = self.acceleration_before, self.acceleration
        shock = (self.row, self.mass, self.h, self.slope, 0.0, self.shock)
        pair_forces(self.n, *shock, *rows, self.acceleration, self.dissipation)
        solid = (self.stress_row, self.mass, self.h, self.slope, self.repulsion)
        add_stress_forces(self.n, *solid, *rows[:3], self.acceleration, self.repelled)
        self.heating[: self.n] = self.dissipation[: self.n, 1] / self.volume

    def update_energies(self, dt: float) -> None:
        """As every bird's, and the works of the deviator and of the repulsion."""
        super().update_energies(dt)
        self.energies["bird_stress"] += self.volume * total(self.works[:, 1])
        self.energies["bird_repulsion"] += self.over_step(dt, "repulsion", self.repelled)
        if self.eroded_now.any():
            frozen = self.volume * float(self.stored_stress[self.eroded_now].sum())
            self.energies["bird_stress"] -= frozen
            self.energies["eroded"] += frozen

    def may_erode(self, _stiffening: float, /) -> bool:
        """Whether there is a failure strain."""
        return bool(np.isfinite(self.material.failure_strain))

    def von_mises(self) -> Array:
        """Von Mises stress of each particle, (n,) [Pa]; nothing in what is eroded."""
        s = self.stress[: self.n]
        return np.sqrt(1.5 * ((s[:, :3] ** 2).sum(axis=1) + 2.0 * (s[:, 3:] ** 2).sum(axis=1)))
