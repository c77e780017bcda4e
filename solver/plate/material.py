"""The metal of a shell, and the layers through its thickness."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from birdstrike.data.histories import Array

LAYERS = 5


@dataclass(frozen=True)
class ShellMaterial:
    """Elastic-plastic shell; SI. beta: 0 kinematic .. 1 isotropic hardening with Ep = E Et/(E - Et).

    rate_c [1/s], rate_p: Cowper-Symonds factor 1 + (plastic strain rate/C)^(1/P) on the yield stress, rate_c = 0 off;
    failure_strain: plastic strain at which a layer fails; an element goes with its last layer.
    """

    young: float
    poisson: float
    density: float
    yield_stress: float = np.inf
    tangent_modulus: float = 0.0
    beta: float = 1.0
    rate_c: float = 0.0
    rate_p: float = 1.0
    failure_strain: float = np.inf

    @property
    def elastic(self) -> tuple[float, float]:
        return self.young, self.poisson

    @property
    def hardening(self) -> tuple[float, float, float]:
        """Yield stress, isotropic and kinematic hardening modulus [Pa]."""
        modulus = self.young * self.tangent_modulus / (self.young - self.tangent_modulus)
        return self.yield_stress, self.beta * modulus, (1.0 - self.beta) * modulus

    def rate(self, dt: float) -> tuple[float, float]:
        """C dt and 1/P: what the return map needs of the rate in a step dt [s]."""
        return self.rate_c * dt, 1.0 / self.rate_p


def through_thickness(thickness: float, layers: int = LAYERS) -> Array:
    """Gauss heights and weights [m] of the layers, the thickness in a last row."""
    points, weights = np.polynomial.legendre.leggauss(layers)
    return np.vstack([0.5 * thickness * np.column_stack([points, weights]), [thickness, 0.0]])
