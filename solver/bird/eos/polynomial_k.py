"""The cubic of a liquid's shock line u_s = c0 + k u."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

from birdstrike.solver.bird.eos.interface import EquationOfState, Law, Sought, Speed
from birdstrike.solver.bird.eos.linear_polynomial import linear_polynomial
from birdstrike.solver.fields import Between


class PolynomialK(Law):
    """The cubic of the shock line u_s = c0 + k u."""

    kind: Literal["polynomial_k"]
    c0: Speed
    k: Annotated[float, Between(1.0, 5.0)]
    literature: ClassVar[Mapping[str, Any]] = {"kind": "polynomial_k", "c0": "1483 m/s", "k": 2.0}
    source: ClassVar[str] = "water"
    sought: ClassVar[Mapping[str, Sought]] = {"c0": Sought("500 m/s", "1700 m/s")}
    modulus: ClassVar[str] = "rho0 c0^2"

    def build(self, rho0: float) -> EquationOfState:
        return polynomial_k(rho0, self.c0, self.k)


def polynomial_k(rho0: float, c0: float, k: float) -> EquationOfState:
    """C1 = rho0 c0^2, C2 = (2k - 1) C1, C3 = (k - 1)(3k - 1) C1."""
    c1 = rho0 * c0**2
    return linear_polynomial(rho0, [0.0, c1, (2.0 * k - 1.0) * c1, (k - 1.0) * (3.0 * k - 1.0) * c1, 0.0, 0.0, 0.0])
