"""The elastic-plastic bird of *MAT_PLASTIC_KINEMATIC."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, ClassVar, Literal

from birdstrike.solver.bird.eos.interface import Sought
from birdstrike.solver.bird.materials.elastic import elastic
from birdstrike.solver.bird.materials.interface import (
    NEVER,
    BirdMaterial,
    FailureStrain,
    Poisson,
    Stiffness,
    Stress,
)
from birdstrike.solver.bird.materials.solid import Solid
from birdstrike.solver.fields import Between, si_in
from birdstrike.solver.hardening import hardening_moduli


class PlasticKinematicMaterial(BirdMaterial):
    """Elastic-plastic solid of *MAT_PLASTIC_KINEMATIC.

    beta: 0 kinematic .. 1 isotropic; rate_c [1/s], rate_p: Cowper-Symonds, rate_c = 0 is off; a particle erodes at the
    equivalent plastic strain failure_strain.
    """

    model: Literal["plastic_kinematic"]
    young: Stiffness
    poisson: Poisson
    yield_stress: Stress
    tangent_modulus: Stress = 0.0
    beta: Annotated[float, Between(0.0, 1.0)] = 1.0
    rate_c: Annotated[float, Between("0 1/s", "1e9 1/s")] = 0.0
    rate_p: Annotated[float, Between(0.1, 100.0)] = 1.0
    failure_strain: FailureStrain = NEVER
    body: ClassVar[str] = "strength"
    literature: ClassVar[Mapping[str, Any]] = {
        "young": "68.9 MPa",
        "poisson": 0.49,
        "yield_stress": "6894 Pa",
        "failure_strain": 1.25,
    }
    source: ClassVar[str] = "Table 11 of the reference strike's paper"
    sought: ClassVar[Mapping[str, Sought]] = {
        "young": Sought("6 MPa", "500 MPa", "logarithmic"),
        "yield_stress": Sought("1000 Pa", "1 MPa", "logarithmic"),
        "tangent_modulus": Sought("0 MPa", "5 MPa"),
        "failure_strain": Sought(0.3, 5.0, "logarithmic"),
    }
    modulus: ClassVar[str] = "young / (3 (1 - 2 poisson))"
    smooth_loss: ClassVar[float] = 1.0

    @classmethod
    def broken_rules(cls, raw: Mapping[str, Any], prefix: str) -> Iterator[str]:
        young, tangent = (si_in(cls, raw, key) for key in ("young", "tangent_modulus"))
        if young is not None and tangent is not None and tangent >= young:
            yield f"{prefix}.tangent_modulus = {raw['tangent_modulus']} is not below young; megapascals?"

    def build(self, rho0: float) -> Solid:
        base = elastic(rho0, self.young, self.poisson)
        moduli = (base.shear_modulus, self.yield_stress, *hardening_moduli(self.young, self.tangent_modulus, self.beta))
        return Solid(base.eos, *moduli, self.rate_c, self.rate_p, self.failure_strain)
