"""Polynomial equation of state in the compression mu, linear in the energy, as LS-DYNA's *EOS_LINEAR_POLYNOMIAL."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from numba import njit
from numpy.typing import ArrayLike

from birdstrike.data.histories import Array
from birdstrike.solver.bird.eos.interface import EquationOfState, Law, Modulus, Number, PerVolume, Sought
from birdstrike.solver.fields import Between


class LinearPolynomial(Law):
    """p = C0 + C1 mu + C2 mu^2 + C3 mu^3 + (C4 + C5 mu + C6 mu^2) E; C2 and C6 act in compression alone."""

    kind: Literal["linear_polynomial"]
    C0: Modulus = 0.0
    C1: Annotated[float, Between("0.1 MPa", "1000000 MPa")]
    C2: Modulus = 0.0
    C3: Modulus = 0.0
    C4: Number = 0.0
    C5: Number = 0.0
    C6: Number = 0.0
    E0: PerVolume = 0.0
    literature: ClassVar[Mapping[str, Any]] = {
        "kind": "linear_polynomial",
        "C1": "2072 MPa",
        "C2": "6217 MPa",
        "C3": "10362 MPa",
    }
    source: ClassVar[str] = "Table 13 of the reference strike's paper"
    sought: ClassVar[Mapping[str, Sought]] = {"C1": Sought("50 MPa", "5000 MPa", "logarithmic")}
    modulus: ClassVar[str] = "C1"

    def build(self, rho0: float) -> EquationOfState:
        return linear_polynomial(rho0, [self.C0, self.C1, self.C2, self.C3, self.C4, self.C5, self.C6], self.E0)


def linear_polynomial(rho0: float, coefficients: ArrayLike, E0: float = 0.0) -> EquationOfState:
    """The law about rho0 [kg/m^3] from C0 .. C6 (7,); E0 per reference volume [J/m^3]."""
    return EquationOfState(polynomial_terms, np.array([rho0, *np.asarray(coefficients, float)]), E0)


def polynomial_coefficients(eos: EquationOfState) -> Array | None:
    """C0 .. C6 (7,) of a law that is such a polynomial; None of any other."""
    return eos.constants[1:8] if eos.terms is polynomial_terms else None


@njit(cache=True)
def polynomial_terms(mu, eos):
    """A = C0 + C1 mu + C2 mu^2 + C3 mu^3, B = C4 + C5 mu + C6 mu^2 and their slopes.

    eos: rho0 [kg/m^3], C0 .. C3 [Pa], C4 .. C6. In expansion the C2 and C6 terms drop and C3 stays (OpenRadioss
    eospolyno.F; LS-DYNA's *EOS_LINEAR_POLYNOMIAL).
    """
    c2, c6 = (eos[3], eos[7]) if mu > 0.0 else (0.0, 0.0)
    cold = eos[1] + mu * (eos[2] + mu * (c2 + mu * eos[4]))
    slope = eos[2] + mu * (2.0 * c2 + 3.0 * mu * eos[4])
    return cold, slope, eos[5] + mu * (eos[6] + mu * c6), eos[6] + 2.0 * mu * c6
