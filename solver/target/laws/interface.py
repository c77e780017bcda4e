"""What every law of a target's material offers: its table in a case with its rules, and its row of constants."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, ClassVar, Literal

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.solver.fields import Between, Section, does_nothing_alone, si_in
from birdstrike.solver.kernels.target import metal

Stress = Annotated[float, Between("1 MPa", "10000 MPa")]
Modulus = Annotated[float, Between("0 MPa", "100000 MPa")]
Exponent = Annotated[float, Between(0.01, 2.0)]
FailureStrain = Annotated[float, Between(0.001, 10.0)]


class TargetMaterial(Section):
    """Table of a material in a case; `law` names it. After validation every value is SI.

    moves: whether a part of it moves and strains.
    """

    law: str
    moves: ClassVar[bool] = True

    density: Annotated[float, Between("100 kg/m^3", "25000 kg/m^3")]

    @classmethod
    def broken_rules(cls, _raw: Mapping[str, Any], _prefix: str) -> Iterator[str]:
        """One line for every rule between keys that the table as read breaks; prefix: its dotted key."""
        yield from ()

    def row(self) -> Array:
        """Constants as the kernels read them, (ROW,)."""
        raise NotImplementedError(self.law)


class Metal(TargetMaterial):
    """What all metals share: elasticity, and the plastic strain at which a layer fails.

    failure_strain: absent, it never fails; fracture_energy [J/m^2]: absent, a layer that reaches it carries nothing
    from then on; else it softens until this energy per area of crack is spent, whatever the size of the shells;
    return_mapping: of a stress beyond yield, to the closest point of the yield surface under plane stress, or, for
    comparison with codes that do so (OpenRadioss's shells by default), by scaling all its components alike: a tension
    in two directions then hardens by 0.6 of its plastic strain, and a strip that cannot contract is 2.6 % softer.
    """

    young: Annotated[float, Between("0.1 GPa", "1000 GPa")]
    poisson: Annotated[float, Between(0.0, 0.49)]
    failure_strain: FailureStrain | None = None
    fracture_energy: Annotated[float, Between("0 kN/m", "10000 kN/m")] = 0.0
    return_mapping: Literal["closest_point", "radial"] = "closest_point"

    @classmethod
    def broken_rules(cls, raw: Mapping[str, Any], prefix: str) -> Iterator[str]:
        ends = [key for key in ("failure_strain", "D") if key in cls.model_fields]
        if si_in(cls, raw, "fracture_energy"):
            yield from does_nothing_alone(raw, prefix, "fracture_energy", ends)

    def row(self) -> Array:
        row = elastic_row(self.young, self.poisson)
        row[metal.RETURN] = metal.RADIAL if self.return_mapping == "radial" else metal.CLOSEST_POINT
        row[metal.FAILURE] = np.inf if self.failure_strain is None else self.failure_strain
        row[metal.FRACTURE_ENERGY] = self.fracture_energy
        self.harden(row)
        row[metal.YIELD] = metal.hardened(row, 0.0)[0]
        return row

    @property
    def first_yield(self) -> float:
        """Flow stress at rest [Pa], at the reference temperature."""
        return float(self.row()[metal.YIELD])

    def harden(self, row: Array) -> None:
        """Write kind and constants of the hardening and its factors into the row."""
        raise NotImplementedError(self.law)


class RatedMetal(Metal):
    """A metal with Cowper and Symonds' factor 1 + (plastic strain rate/C)^(1/P); rate_c = 0 is off."""

    rate_c: Annotated[float, Between("0 1/s", "1e30 1/s")] = 0.0
    rate_p: Annotated[float, Between(0.1, 100.0)] = 1.0

    @classmethod
    def broken_rules(cls, raw: Mapping[str, Any], prefix: str) -> Iterator[str]:
        yield from super().broken_rules(raw, prefix)
        yield from does_nothing_alone(raw, prefix, "rate_p", ["rate_c"])

    def row(self) -> Array:
        row = super().row()
        row[metal.RATE], row[metal.RATE_C], row[metal.RATE_P] = metal.COWPER_SYMONDS, self.rate_c, 1.0 / self.rate_p
        return row


def elastic_row(young: float, poisson: float) -> Array:
    """A law that never yields and never fails, into which another writes its own constants."""
    row = np.zeros(metal.ROW)
    row[metal.YOUNG], row[metal.POISSON] = young, poisson
    row[metal.YIELD] = row[metal.CONSTANTS] = row[metal.FAILURE] = np.inf
    return row
