"""The NULL material (*MAT_NULL): a viscous fluid with a pressure floor that erodes at limits of its volume."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

from birdstrike.solver.bird.eos.interface import Sought
from birdstrike.solver.bird.eos.registry import AnyLaw
from birdstrike.solver.bird.materials.fluid import Fluid, acting
from birdstrike.solver.bird.materials.interface import BirdMaterial, Cutoff
from birdstrike.solver.fields import Between

SHOCK_VISCOSITY_LIMIT = 75.0  # Pa s: 5 % of the range of MU


class NullMaterial(BirdMaterial):
    """NULL material: pressure floor [Pa] <= 0, dynamic viscosity [Pa s], erosion limits in V/V0.

    tension_erosion acts above 1, compression_erosion between 0 and 1; outside they are inactive (0 is off).
    """

    model: Literal["null"]
    pressure_cutoff: Cutoff
    viscosity: Annotated[float, Between("0 Pa s", "10000 Pa s")]
    tension_erosion: Annotated[float, Between(0.0, 10.0)] = 0.0
    compression_erosion: Annotated[float, Between(0.0, 2.0)] = 0.0
    eos: AnyLaw
    body: ClassVar[str] = "fluid"
    title: ClassVar[str] = "NULL"
    literature: ClassVar[Mapping[str, Any]] = {
        "pressure_cutoff": "-0.3705 MPa",
        "viscosity": "641 Pa s",
        "eos": {"kind": "grueneisen", "C": "1670 m/s", "S1": 2.48},
    }
    source: ClassVar[str] = "Table 9 of the reference strike's paper"
    sought: ClassVar[Mapping[str, Sought]] = {
        "pressure_cutoff": Sought("-1.25 MPa", "-0.05 MPa"),
        "viscosity": Sought("0 Pa s", "1500 Pa s"),
    }

    @property
    def inactive(self) -> tuple[str, ...]:
        limits = acting(self.tension_erosion, self.compression_erosion)
        return tuple(name for name, acts in limits.items() if not acts)

    def warnings(self, shock_viscosity: float) -> list[str]:
        if shock_viscosity <= SHOCK_VISCOSITY_LIMIT:
            return []
        text = f"the shock viscosity dissipated as much as a shear viscosity of {shock_viscosity:.0f} Pa s would"
        return [f"{text}, more than 5 % of the range of a NULL bird's MU: refine bird.particles"]

    def build(self, rho0: float) -> Fluid:
        limits = (self.tension_erosion, self.compression_erosion)
        return Fluid(self.eos.build(rho0), self.pressure_cutoff, self.viscosity, *limits)
