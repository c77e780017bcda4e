"""A solid: an equation of state with elastic-plastic strength."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.solver.bird.eos.interface import EquationOfState
from birdstrike.solver.bird.materials.interface import Material


@dataclass(frozen=True)
class Solid(Material):
    """An equation of state with strength: J2 plasticity, or none of it with an infinite yield stress.

    isotropic, kinematic: hardening moduli [Pa] over the plastic strain; rate_c [1/s], rate_p: Cowper-Symonds, 0 is off;
    failure_strain: equivalent plastic strain at which it erodes; pressure_cutoff [Pa], -inf for a material without one.
    """

    eos: EquationOfState
    shear_modulus: float
    yield_stress: float = math.inf
    isotropic: float = 0.0
    kinematic: float = 0.0
    rate_c: float = 0.0
    rate_p: float = 1.0
    failure_strain: float = math.inf
    pressure_cutoff: float = -math.inf
    viscosity: float = 0.0

    @property
    def limits(self) -> Array:
        """Pressure floor [Pa] and equivalent plastic strain at erosion."""
        return np.array([self.pressure_cutoff, self.failure_strain])

    @property
    def strength(self) -> Array:
        hardening = (self.isotropic, self.kinematic)
        return np.array([self.shear_modulus, self.yield_stress, *hardening, self.rate_c, self.rate_p])

    @property
    def young(self) -> float:
        """9 K G/(3 K + G) [Pa]."""
        return 9.0 * self.bulk_modulus * self.shear_modulus / (3.0 * self.bulk_modulus + self.shear_modulus)

    def fastest_wave(self, u: float) -> float:
        """Longitudinal wave [m/s] behind the shock of particle velocity u [m/s]: c^2 + 4/3 G/rho0."""
        return math.sqrt(self.eos.shocked_sound_speed(u) ** 2 + 4.0 / 3.0 * self.shear_modulus / self.rho0)
