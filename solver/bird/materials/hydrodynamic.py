"""The elastic-plastic hydrodynamic bird, as LS-DYNA's *MAT_ELASTIC_PLASTIC_HYDRO."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Literal

from birdstrike.solver.bird.eos.interface import Sought
from birdstrike.solver.bird.eos.registry import AnyLaw
from birdstrike.solver.bird.materials.interface import NEVER, BirdMaterial, Cutoff, FailureStrain, Stiffness, Stress
from birdstrike.solver.bird.materials.solid import Solid


class HydrodynamicMaterial(BirdMaterial):
    """*MAT_ELASTIC_PLASTIC_HYDRO: J2 deviator with the plastic hardening modulus EH, pressure from an EOS.

    The constants of `literature` are those of Tables 12 and 13: C1 = rho c0^2 = 2072 MPa, C2 = 3 C1, C3 = 5 C1 are the
    polynomial of c0 = 1486 m/s and k = 2 at 938 kg/m^3, in the form whose c0 can be sought.
    """

    model: Literal["hydrodynamic"]
    shear_modulus: Stiffness
    yield_stress: Stress
    hardening_modulus: Stress = 0.0
    pressure_cutoff: Cutoff
    failure_strain: FailureStrain = NEVER
    eos: AnyLaw
    body: ClassVar[str] = "strength"
    literature: ClassVar[Mapping[str, Any]] = {
        "shear_modulus": "10.2 MPa",
        "yield_stress": "0.03 MPa",
        "hardening_modulus": "0.13 MPa",
        "pressure_cutoff": "-0.9 MPa",
        "failure_strain": 0.95,
        "eos": {"kind": "polynomial_k", "c0": "1486 m/s", "k": 2.0},
    }
    source: ClassVar[str] = "Tables 12 and 13 of the reference strike's paper"
    sought: ClassVar[Mapping[str, Sought]] = {
        "shear_modulus": Sought("0.1 MPa", "200 MPa", "logarithmic"),
        "yield_stress": Sought("1000 Pa", "1 MPa", "logarithmic"),
        "hardening_modulus": Sought("0 MPa", "10 MPa"),
        "pressure_cutoff": Sought("-5 MPa", "-0.01 MPa", "logarithmic"),
        "failure_strain": Sought(0.3, 5.0, "logarithmic"),
        "eos.c0": Sought("500 m/s", "1700 m/s"),
    }
    smooth_loss: ClassVar[float] = 1.0

    def build(self, rho0: float) -> Solid:
        moduli = (self.shear_modulus, self.yield_stress, self.hardening_modulus)
        limits = {"failure_strain": self.failure_strain, "pressure_cutoff": self.pressure_cutoff}
        return Solid(self.eos.build(rho0), *moduli, **limits)
