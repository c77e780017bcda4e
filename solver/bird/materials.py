"""Materials of the bird as the bodies use them: an equation of state with what is added to it; SI."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.solver.bird.eos import EquationOfState, logarithmic


@dataclass(frozen=True)
class NullMaterial:
    """NULL material on any equation of state.

    tension_erosion acts above 1 and compression_erosion between 0 and 1 (relative volumes V/V0); beyond, they are off.
    """

    eos: EquationOfState
    pressure_cutoff: float = 0.0
    viscosity: float = 0.0
    tension_erosion: float = 0.0
    compression_erosion: float = 0.0

    @property
    def rho0(self) -> float:
        """Reference density [kg/m^3]."""
        return self.eos.rho0

    @property
    def limits(self) -> Array:
        """Pressure floor [Pa], largest and smallest V/V0 before erosion."""
        largest = self.tension_erosion if self.tension_erosion > 1.0 else np.inf
        smallest = self.compression_erosion if 0.0 < self.compression_erosion < 1.0 else 0.0
        return np.array([self.pressure_cutoff, largest, smallest])

    @property
    def bulk_modulus(self) -> float:
        """rho0 c^2 [Pa] at rest."""
        return self.eos.bulk_modulus

    def fastest_wave(self, u: float) -> float:
        """Sound speed [m/s] behind the shock of particle velocity u [m/s]."""
        return self.eos.shocked_sound_speed(u)


@dataclass(frozen=True)
class SolidMaterial:
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
    def rho0(self) -> float:
        """Reference density [kg/m^3]."""
        return self.eos.rho0

    @property
    def limits(self) -> Array:
        """Pressure floor [Pa] and equivalent plastic strain at erosion."""
        return np.array([self.pressure_cutoff, self.failure_strain])

    @property
    def strength(self) -> Array:
        """(6,) as `kernels.strength.update_deviator` reads it."""
        hardening = (self.isotropic, self.kinematic)
        return np.array([self.shear_modulus, self.yield_stress, *hardening, self.rate_c, self.rate_p])

    @property
    def bulk_modulus(self) -> float:
        """rho0 c^2 [Pa] at rest, of the equation of state."""
        return self.eos.bulk_modulus

    @property
    def young(self) -> float:
        """9 K G/(3 K + G) [Pa]."""
        return 9.0 * self.bulk_modulus * self.shear_modulus / (3.0 * self.bulk_modulus + self.shear_modulus)

    def fastest_wave(self, u: float) -> float:
        """Longitudinal wave [m/s] behind the shock of particle velocity u [m/s]: c^2 + 4/3 G/rho0."""
        return math.sqrt(self.eos.shocked_sound_speed(u) ** 2 + 4.0 / 3.0 * self.shear_modulus / self.rho0)


def elastic(rho0: float, young: float, poisson: float) -> SolidMaterial:
    """Isotropic elastic solid: G = E/2(1 + nu), K = E/3(1 - 2 nu)."""
    return SolidMaterial(logarithmic(rho0, young / (3.0 * (1.0 - 2.0 * poisson))), young / (2.0 * (1.0 + poisson)))


def hardening(young: float, tangent: float, beta: float) -> tuple[float, float]:
    """Isotropic and kinematic moduli [Pa]: BETA Ep and (1 - BETA) Ep with Ep = E Et/(E - Et)."""
    modulus = young * tangent / (young - tangent)
    return beta * modulus, (1.0 - beta) * modulus
