"""The elastic bird: an isotropic solid that stays in one piece."""

from __future__ import annotations

from typing import ClassVar, Literal

from birdstrike.solver.bird.eos.logarithmic import logarithmic
from birdstrike.solver.bird.materials.interface import BirdMaterial, Poisson, Stiffness
from birdstrike.solver.bird.materials.solid import Solid


class ElasticMaterial(BirdMaterial):
    """Isotropic elastic solid: Young's modulus [Pa], Poisson's ratio."""

    model: Literal["elastic"]
    young: Stiffness
    poisson: Poisson
    body: ClassVar[str] = "total_lagrangian"
    hourglass: ClassVar[str] = "stiffness"

    def build(self, rho0: float) -> Solid:
        return elastic(rho0, self.young, self.poisson)


def elastic(rho0: float, young: float, poisson: float) -> Solid:
    """Isotropic elastic solid: G = E/2(1 + nu), K = E/3(1 - 2 nu)."""
    return Solid(logarithmic(rho0, young / (3.0 * (1.0 - 2.0 * poisson))), young / (2.0 * (1.0 + poisson)))
