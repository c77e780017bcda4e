"""Johnson and Cook's metal: power hardening, logarithmic rate factor, softening by its own heat, and damage."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Literal

from birdstrike.data.histories import Array
from birdstrike.solver.fields import Between, does_nothing_alone, si_in
from birdstrike.solver.kernels.target import metal
from birdstrike.solver.target.laws.interface import Exponent, Metal, Stress

Temperature = Annotated[float, Between("1 K", "5000 K")]
CONSTANT = Between(-100.0, 100.0)
Constant = Annotated[float, CONSTANT]
SOFTENING = ("melt", "specific_heat")
"""What softening by heat takes."""
STATES = {"pure shear": 0.0, "uniaxial tension": 1.0 / 3.0}
"""Mean over von Mises stress of states in which a metal breaks at some strain."""


class JohnsonCook(Metal):
    """sigma_y = (a + b eps_p^n) (1 + c ln(rate/rate0)) (1 - T*^m), T* = (T - reference)/(melt - reference), adiabatic.

    Damage: eps_f = (D1 + D2 exp(D3 mean/mises)) (1 + D4 ln(rate/rate0)) (1 + D5 T*), in tension a positive mean; both
    factors of rate are 1 below rate0. A layer fails where the sum of plastic strain over eps_f is 1. In this original
    form D3 is negative for metals that break sooner in tension; programs that write exp(-D3 ...) want the other sign.
    """

    law: Literal["johnson_cook"]
    a: Stress
    b: Annotated[float, Between("0 MPa", "10000 MPa")]
    n: Exponent
    c: Annotated[float, Between(0.0, 1.0)] = 0.0
    rate0: Annotated[float, Between("1e-6 1/s", "1e6 1/s")] = 1.0
    m: Annotated[float, Between(0.1, 10.0)] = 1.0
    start: Temperature = 298.15
    reference: Temperature = 298.15
    melt: Temperature | None = None
    specific_heat: Annotated[float, Between("10 J/kg/K", "10000 J/kg/K")] | None = None
    heat_share: Annotated[float, Between(0.0, 1.0)] = 0.9
    D: tuple[Constant, Constant, Constant, Constant, Constant] | None = None

    @classmethod
    def broken_rules(cls, raw: Mapping[str, Any], prefix: str) -> Iterator[str]:
        yield from super().broken_rules(raw, prefix)
        if "failure_strain" in raw and "D" in raw:
            yield f"{prefix}: failure_strain and D are both given; keep one"
        given = [key for key in SOFTENING if key in raw]
        if len(given) == 1:
            other = "specific_heat" if given[0] == "melt" else "melt"
            yield f"{prefix}.{given[0]} needs {prefix}.{other}: softening by heat takes both; leave both out for none"
        for key in ("start", "reference", "m", "heat_share"):
            yield from does_nothing_alone(raw, prefix, key, SOFTENING, " and ")
        yield from does_nothing_alone(raw, prefix, "rate0", ("c", "D"))
        yield from _damage_rules(raw, prefix)
        melt, start = si_in(cls, raw, "melt"), si_in(cls, raw, "start") or 298.15
        reference = si_in(cls, raw, "reference") or 298.15
        if melt is not None and melt <= max(start, reference):
            yield f"{prefix}.melt = {raw['melt']} is not above the start and reference temperatures"

    def harden(self, row: Array) -> None:
        row[metal.HARDENING] = metal.POWER
        row[metal.CONSTANTS : metal.CONSTANTS + 3] = self.a, self.b, self.n
        row[metal.RATE], row[metal.RATE_C], row[metal.RATE_P] = metal.LOGARITHMIC, self.c, self.rate0
        if self.melt is not None and self.specific_heat is not None:
            row[metal.HEATING] = self.heat_share / (self.density * self.specific_heat)
            row[metal.START_HEAT], row[metal.MELT_SPAN] = self.start - self.reference, self.melt - self.reference
            row[metal.MELT_POWER] = self.m
        if self.D is not None:
            row[metal.DAMAGE], row[metal.DAMAGE_RATE] = metal.JOHNSON_COOK, self.rate0
            row[metal.D1 : metal.D1 + 5] = self.D


def _constants(raw: Mapping[str, Any]) -> list[float]:
    """D1 .. D5 of a table as read; none where they are absent, or are themselves an error."""
    given = raw.get("D")
    valid = [CONSTANT.valid(one) for one in given] if isinstance(given, list | tuple) else []
    known = [one for one in valid if one is not None]
    return known if len(known) == len(valid) == 5 else []


def _damage_rules(raw: Mapping[str, Any], prefix: str) -> Iterator[str]:
    """The constants of damage give strains at fracture above 0, and none of them is idle."""
    constants = _constants(raw)
    if not constants:
        return
    d1, d2, d3, _, d5 = constants
    for state, triaxiality in STATES.items():
        strain = d1 + d2 * math.exp(d3 * triaxiality)
        if strain <= 0.0:
            yield (
                f"{prefix}.D = {raw['D']} gives a strain at fracture of {strain:.3g} in {state}, where D1 + D2 "
                "exp(D3 mean/mises) must be above 0; correct D1, D2 or D3, or leave D out for a metal that never breaks"
            )
    if d5 and not any(key in raw for key in SOFTENING):
        yield (
            f"{prefix}.D: its fifth constant, {d5:g}, does nothing alone; give {prefix}.{' and '.join(SOFTENING)} too, "
            "or write 0"
        )
