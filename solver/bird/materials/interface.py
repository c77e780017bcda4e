"""What every material of the bird offers: its table in a case with its rules, and what particles and elements step."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Annotated, Any, ClassVar

from birdstrike.data.histories import Array
from birdstrike.solver.bird.eos.interface import EquationOfState, Law, Sought
from birdstrike.solver.fields import Between, Section

Stress = Annotated[float, Between("0 MPa", "10000 MPa")]
Stiffness = Annotated[float, Between("0.001 MPa", "1000000 MPa")]
Cutoff = Annotated[float, Between("-1000 MPa", "0 MPa")]
FailureStrain = Annotated[float, Between(0.001, 100.0)]
Poisson = Annotated[float, Between(0.0, 0.4999)]
NEVER = 100.0  # a plastic strain that no run reaches


class Material:
    """A substance about its reference density: an equation of state and what is added to it.

    pressure_cutoff: floor of the pressure [Pa], -inf of none; viscosity: dynamic [Pa s]; shear_modulus [Pa], 0 of a
    fluid; failure_strain: equivalent plastic strain at which it erodes, inf of none.
    """

    eos: EquationOfState
    pressure_cutoff: float
    viscosity: float
    shear_modulus: float
    failure_strain: float

    @property
    def rho0(self) -> float:
        """Reference density [kg/m^3]."""
        return self.eos.rho0

    @property
    def bulk_modulus(self) -> float:
        """rho0 c^2 [Pa] at rest, of the equation of state."""
        return self.eos.bulk_modulus

    @property
    def volume_limits(self) -> tuple[float, float]:
        """Largest and smallest V/V0 before erosion; inf and 0 are off."""
        return math.inf, 0.0

    @property
    def limits(self) -> Array:
        """Pressure floor [Pa] and what erodes a particle, as the kernel of its body reads them."""
        raise NotImplementedError

    @property
    def strength(self) -> Array | None:
        """(6,) as `kernels.bird.strength.update_deviator` reads it; None of a fluid."""
        return None

    def fastest_wave(self, u: float) -> float:
        """Fastest wave [m/s] behind the shock of particle velocity u [m/s]."""
        return self.eos.shocked_sound_speed(u)


class BirdMaterial(Section):
    """Table of a material in a case; `model` names it. After validation every value is SI.

    body: the particles that carry it, "fluid", "strength" or "total_lagrangian"; hourglass: the usual control of its
    hexahedra, "viscous" or "stiffness"; title: its name in reports, where that is not its model in words.
    literature: a published bird of this model, as a case writes it; source: where that stands; sought: key -> range in
    which `birdstrike calibrate-models` seeks it where a case names none ("eos.c0": of the law in `literature`);
    modulus: the bulk modulus at rest in the table's keys, where no law gives it;
    smooth_loss: largest eroded share of the bird for which a run is used by an emulator. Where a limit of the volume
    erodes, the bird is lost at once beyond some value and a run that lost 5 % is of another regime. Where a failure
    strain erodes, the loss grows gradually and belongs to the model: 1, every run is used.
    """

    model: str
    body: ClassVar[str]
    hourglass: ClassVar[str] = "viscous"
    title: ClassVar[str] = ""
    literature: ClassVar[Mapping[str, Any]] = {}
    source: ClassVar[str] = ""
    sought: ClassVar[Mapping[str, Sought]] = {}
    modulus: ClassVar[str] = ""
    smooth_loss: ClassVar[float] = 0.05

    @property
    def inactive(self) -> tuple[str, ...]:
        """Erosion limits that can erode nothing at their present value."""
        return ()

    @property
    def law(self) -> Law | None:
        """The table of its equation of state; None for a model that follows from its elastic constants."""
        return getattr(self, "eos", None)

    @classmethod
    def broken_rules(cls, _raw: Mapping[str, Any], _prefix: str) -> Iterator[str]:
        """One line for every rule between keys that the table as read breaks; prefix: its dotted key."""
        yield from ()

    def warnings(self, _shock_viscosity: float) -> list[str]:
        """What to know of a run whose shock viscosity dissipated as much as a shear viscosity [Pa s] would."""
        return []

    def build(self, rho0: float) -> Material:
        """The substance about the reference density [kg/m^3], for particles and finite elements alike."""
        raise NotImplementedError(self.model)
