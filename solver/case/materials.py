"""What a case says of the bird's material: one table a model; after validation every value is SI."""

from __future__ import annotations

from typing import Annotated

from birdstrike.solver.case.eos import LAWS, Law
from birdstrike.solver.fields import Between, Section
from birdstrike.solver.registry import Kinds

EquationOfState = Annotated[Law, LAWS]
Stress = Annotated[float, Between("0 MPa", "10000 MPa")]
Stiffness = Annotated[float, Between("0.001 MPa", "1000000 MPa")]
Cutoff = Annotated[float, Between("-1000 MPa", "0 MPa")]
FailureStrain = Annotated[float, Between(0.001, 100.0)]
Poisson = Annotated[float, Between(0.0, 0.4999)]
NEVER = 100.0  # a plastic strain that no run reaches


class BirdMaterial(Section):
    """A model of the bird; `model` names it."""

    model: str

    @property
    def inactive(self) -> tuple[str, ...]:
        """Erosion limits that can erode nothing at their present value."""
        return ()

    @property
    def law(self) -> Law | None:
        """The equation of state; None for a model that follows from its elastic constants."""
        return getattr(self, "eos", None)


class NullMaterial(BirdMaterial):
    """NULL material: pressure floor [Pa] <= 0, dynamic viscosity [Pa s], erosion limits in V/V0.

    tension_erosion acts above 1, compression_erosion between 0 and 1; outside they are inactive (0 is off).
    """

    pressure_cutoff: Cutoff
    viscosity: Annotated[float, Between("0 Pa s", "10000 Pa s")]
    tension_erosion: Annotated[float, Between(0.0, 10.0)] = 0.0
    compression_erosion: Annotated[float, Between(0.0, 2.0)] = 0.0
    eos: EquationOfState

    @property
    def inactive(self) -> tuple[str, ...]:
        active = {
            "tension_erosion": self.tension_erosion > 1.0,
            "compression_erosion": 0.0 < self.compression_erosion < 1.0,
        }
        return tuple(name for name, acts in active.items() if not acts)


class ElasticMaterial(BirdMaterial):
    """Isotropic elastic solid: Young's modulus [Pa], Poisson's ratio."""

    young: Stiffness
    poisson: Poisson


class PlasticKinematicMaterial(BirdMaterial):
    """Elastic-plastic solid of *MAT_PLASTIC_KINEMATIC.

    beta: 0 kinematic .. 1 isotropic; rate_c [1/s], rate_p: Cowper-Symonds, rate_c = 0 is off; a particle erodes at the
    equivalent plastic strain failure_strain.
    """

    young: Stiffness
    poisson: Poisson
    yield_stress: Stress
    tangent_modulus: Stress = 0.0
    beta: Annotated[float, Between(0.0, 1.0)] = 1.0
    rate_c: Annotated[float, Between("0 1/s", "1e9 1/s")] = 0.0
    rate_p: Annotated[float, Between(0.1, 100.0)] = 1.0
    failure_strain: FailureStrain = NEVER


class HydrodynamicMaterial(BirdMaterial):
    """*MAT_ELASTIC_PLASTIC_HYDRO: J2 deviator with the plastic hardening modulus EH, pressure from an EOS."""

    shear_modulus: Stiffness
    yield_stress: Stress
    hardening_modulus: Stress = 0.0
    pressure_cutoff: Cutoff
    failure_strain: FailureStrain = NEVER
    eos: EquationOfState


MATERIALS = Kinds(
    "bird material",
    "model",
    "birdstrike.bird_materials",
    {
        "null": NullMaterial,
        "elastic": ElasticMaterial,
        "plastic_kinematic": PlasticKinematicMaterial,
        "hydrodynamic": HydrodynamicMaterial,
    },
    BirdMaterial,
)
