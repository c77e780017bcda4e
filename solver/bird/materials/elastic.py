"""The elastic bird: an isotropic solid that stays in one piece."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Literal

from birdstrike.solver.bird.eos.interface import Sought
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
    literature: ClassVar[Mapping[str, Any]] = {"young": "68.9 MPa", "poisson": 0.49}
    source: ClassVar[str] = "Table 10 of the reference strike's paper"
    sought: ClassVar[Mapping[str, Sought]] = {
        "young": Sought("1 MPa", "500 MPa", "logarithmic"),
        "poisson": Sought(0.4, 0.49),
    }
    modulus: ClassVar[str] = "young / (3 (1 - 2 poisson))"

    def build(self, rho0: float) -> Solid:
        return elastic(rho0, self.young, self.poisson)


def elastic(rho0: float, young: float, poisson: float) -> Solid:
    """Isotropic elastic solid: G = E/2(1 + nu), K = E/3(1 - 2 nu)."""
    return Solid(logarithmic(rho0, young / (3.0 * (1.0 - 2.0 * poisson))), young / (2.0 * (1.0 + poisson)))
