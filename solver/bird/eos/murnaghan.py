"""Murnaghan's equation of state (Proc. Natl. Acad. Sci. 30 (1944) 244)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from numba import njit

from birdstrike.solver.bird.eos.interface import EquationOfState, Law, Sought
from birdstrike.solver.fields import Between


class Murnaghan(Law):
    """p = p0 + B[(rho/rho0)^g - 1]."""

    kind: Literal["murnaghan"]
    p0: Annotated[float, Between("-10 MPa", "10 MPa")] = 0.0
    B: Annotated[float, Between("0.1 MPa", "100000 MPa")]
    g: Annotated[float, Between(1.0, 20.0)]
    literature: ClassVar[Mapping[str, Any]] = {"kind": "murnaghan", "B": "128 MPa", "g": 7.98}
    source: ClassVar[str] = "B 128 MPa and gamma 7.98, usual for gelatine birds"
    sought: ClassVar[Mapping[str, Sought]] = {
        "B": Sought("5 MPa", "1000 MPa", "logarithmic"),
        "g": Sought(4.0, 12.0),
    }
    modulus: ClassVar[str] = "B g"

    def build(self, rho0: float) -> EquationOfState:
        return murnaghan(rho0, self.B, self.g, self.p0)


def murnaghan(rho0: float, B: float, g: float, p0: float = 0.0) -> EquationOfState:
    """p = p0 + B[(rho/rho0)^g - 1]."""
    return EquationOfState(murnaghan_terms, np.array([rho0, p0, B, g]))


@njit(cache=True)
def murnaghan_terms(mu, eos):
    """A = p0 + B[(1 + mu)^g - 1] and its slope; eos: rho0 [kg/m^3], p0, B [Pa], g."""
    power = eos[2] * (1.0 + mu) ** eos[3]
    return eos[1] + power - eos[2], eos[3] * power / (1.0 + mu), 0.0, 0.0
