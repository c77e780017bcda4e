"""Power hardening, a + b eps_p^n, with Cowper and Symonds' rate factor."""

from __future__ import annotations

from typing import Annotated, Literal

from birdstrike.data.histories import Array
from birdstrike.solver.fields import Between
from birdstrike.solver.kernels.target import metal
from birdstrike.solver.target.laws.interface import Exponent, RatedMetal, Stress


class Power(RatedMetal):
    """sigma_y = a + b eps_p^n."""

    law: Literal["power"]
    a: Stress
    b: Annotated[float, Between("0 MPa", "10000 MPa")]
    n: Exponent

    def harden(self, row: Array) -> None:
        row[metal.HARDENING] = metal.POWER
        row[metal.CONSTANTS : metal.CONSTANTS + 3] = self.a, self.b, self.n
