"""Johnson and Cook's metal: power hardening, logarithmic rate factor, softening by its own heat, and damage."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Literal

from birdstrike.data.histories import Array
from birdstrike.solver.fields import Between
from birdstrike.solver.kernels.target import metal
from birdstrike.solver.target.laws.interface import Exponent, Metal, Stress, si_in

Temperature = Annotated[float, Between("1 K", "5000 K")]
Constant = Annotated[float, Between(-100.0, 100.0)]


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
        given = [key for key in ("melt", "specific_heat") if key in raw]
        if len(given) == 1:
            other = "specific_heat" if given[0] == "melt" else "melt"
            yield f"{prefix}.{given[0]} needs {prefix}.{other}: softening by heat takes both; leave both out for none"
        for key in ("start", "reference", "m", "heat_share"):
            if key in raw and not given:
                yield f"{prefix}.{key} = {raw[key]} does nothing alone; give {prefix}'s melt and specific_heat too"
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
