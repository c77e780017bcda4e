"""Gelatine: a viscous liquid whose bulk modulus rises linearly with compression, p = K mu (1 + s mu)."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

import numpy as np
from numba import njit

from birdstrike.solver.bird.eos.interface import EquationOfState
from birdstrike.solver.bird.materials.fluid import Fluid
from birdstrike.solver.bird.materials.interface import BirdMaterial
from birdstrike.solver.fields import Between


class Gelatine(BirdMaterial):
    """bulk: K [Pa]; stiffening: s; viscosity [Pa s]."""

    model: Literal["gelatine"]
    bulk: Annotated[float, Between("100 MPa", "10000 MPa")]
    stiffening: Annotated[float, Between(0.0, 20.0)] = 3.0
    viscosity: Annotated[float, Between("0 Pa s", "10000 Pa s")] = 0.0
    body: ClassVar[str] = "fluid"

    def build(self, rho0: float) -> Fluid:
        law = EquationOfState(stiffening_pressure, np.array([rho0, self.bulk, self.stiffening]))
        return Fluid(law, pressure_cutoff=-3e5, viscosity=self.viscosity)


@njit
def stiffening_pressure(mu, constants):
    """A [Pa], dA/dmu [Pa], B and dB/dmu; no energy enters the pressure."""
    bulk, stiffening = constants[1], constants[2]
    return bulk * mu * (1.0 + stiffening * mu), bulk * (1.0 + 2.0 * stiffening * mu), 0.0, 0.0
