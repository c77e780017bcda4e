"""The elastic-plastic hydrodynamic bird, as LS-DYNA's *MAT_ELASTIC_PLASTIC_HYDRO."""

from __future__ import annotations

from typing import ClassVar, Literal

from birdstrike.solver.bird.eos.registry import AnyLaw
from birdstrike.solver.bird.materials.interface import NEVER, BirdMaterial, Cutoff, FailureStrain, Stiffness, Stress
from birdstrike.solver.bird.materials.solid import Solid


class HydrodynamicMaterial(BirdMaterial):
    """*MAT_ELASTIC_PLASTIC_HYDRO: J2 deviator with the plastic hardening modulus EH, pressure from an EOS."""

    model: Literal["hydrodynamic"]
    shear_modulus: Stiffness
    yield_stress: Stress
    hardening_modulus: Stress = 0.0
    pressure_cutoff: Cutoff
    failure_strain: FailureStrain = NEVER
    eos: AnyLaw
    body: ClassVar[str] = "strength"

    def build(self, rho0: float) -> Solid:
        moduli = (self.shear_modulus, self.yield_stress, self.hardening_modulus)
        limits = {"failure_strain": self.failure_strain, "pressure_cutoff": self.pressure_cutoff}
        return Solid(self.eos.build(rho0), *moduli, **limits)
