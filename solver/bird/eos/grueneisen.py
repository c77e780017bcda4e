"""Grueneisen's equation of state on the shock line u_s = C + S1 u + ..., as LS-DYNA's *EOS_GRUNEISEN."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from numba import njit

from birdstrike.solver.bird.eos.interface import EquationOfState, Law, Number, PerVolume, Sought, Speed
from birdstrike.solver.fields import Between


class Grueneisen(Law):
    """Shock velocity u_s = C + S1 u + ...; g0 the Grueneisen gamma, a its first-order volume correction."""

    kind: Literal["grueneisen"]
    C: Speed
    S1: Annotated[float, Between(0.0, 10.0)]
    S2: Number = 0.0
    S3: Number = 0.0
    g0: Annotated[float, Between(0.0, 10.0)] = 0.0
    a: Number = 0.0
    E0: PerVolume = 0.0
    literature: ClassVar[Mapping[str, Any]] = {"kind": "grueneisen", "C": "1670 m/s", "S1": 2.48}
    source: ClassVar[str] = "the reference strike"
    sought: ClassVar[Mapping[str, Sought]] = {"C": Sought("250 m/s", "2500 m/s", "logarithmic")}
    modulus: ClassVar[str] = "rho0 C^2"

    def build(self, rho0: float) -> EquationOfState:
        return grueneisen(rho0, self.C, self.S1, self.S2, self.S3, self.g0, self.a, self.E0)


def grueneisen(
    rho0: float, C: float, S1: float, S2: float = 0.0, S3: float = 0.0, g0: float = 0.0, a: float = 0.0, E0: float = 0.0
) -> EquationOfState:
    """The law about rho0 [kg/m^3]; E0 per reference volume [J/m^3]."""
    return EquationOfState(grueneisen_terms, np.array([rho0, C, S1, S2, S3, g0, a]), E0)


@njit(cache=True, inline="always")
def grueneisen_terms(mu, eos):
    """A, dA/dmu [Pa], B and dB/dmu; eos: rho0 [kg/m^3], C [m/s], S1, S2, S3, gamma0, a.

    The form is that of LS-DYNA's *EOS_GRUNEISEN as coded in OpenRadioss (gruneisen.F). With gamma0 = a = S2 = S3 = 0
    the compression branch is the Hugoniot p = rho0 (C + S1 u) u exactly.
    """
    stiffness = eos[0] * eos[1] * eos[1]
    s1, s2, s3, gamma0, a = eos[2], eos[3], eos[4], eos[5], eos[6]
    factor = gamma0 + a * mu
    if mu <= 0.0:
        return stiffness * mu, stiffness, factor, a
    v = mu / (1.0 + mu)
    top = mu * (1.0 + (1.0 - 0.5 * gamma0) * mu - 0.5 * a * mu * mu)
    top_slope = 1.0 + 2.0 * (1.0 - 0.5 * gamma0) * mu - 1.5 * a * mu * mu
    bottom = 1.0 - (s1 - 1.0) * mu - s2 * mu * v - s3 * mu * v * v
    bottom_slope = -(s1 - 1.0) - s2 * v * (2.0 - v) - s3 * v * v * (3.0 - 2.0 * v)
    slope = top_slope / bottom**2 - 2.0 * top * bottom_slope / bottom**3
    return stiffness * top / bottom**2, stiffness * slope, factor, a
