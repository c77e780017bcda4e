"""Water with a share of air: the substance of a gelatine bird with bubbles."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

import numpy as np

from birdstrike.solver.bird.eos.interface import EquationOfState, Law, Sought, Speed
from birdstrike.solver.bird.eos.polynomial_k import polynomial_k
from birdstrike.solver.bird.eos.table import table
from birdstrike.solver.fields import Between, OneOf

AIR_DENSITY, ATMOSPHERE, AIR_EXPONENT, AIR_SOUND_SPEED = 1.225, 101325.0, 1.4, 342.0


class Porous(Law):
    """Water (c0, k, water_density) with a share z of air; "wood": one pressure in both; "linear": c_por, unphysical."""

    kind: Literal["porous"]
    z: Annotated[float, Between(0.0, 0.9)]
    mixing: Annotated[str, OneOf(("wood", "linear"))]
    c0: Speed = 1482.9
    k: Annotated[float, Between(1.0, 5.0)] = 2.0
    water_density: Annotated[float, Between("500 kg/m^3", "2000 kg/m^3")] = 1000.0
    gives_density: ClassVar[bool] = True
    air_key: ClassVar[str] = "z"
    literature: ClassVar[Mapping[str, Any]] = {"kind": "porous", "z": 0.1, "mixing": "linear"}
    source: ClassVar[str] = "water with 10 % of air"
    sought: ClassVar[Mapping[str, Sought]] = {"z": Sought(0.0, 0.3)}
    modulus: ClassVar[str] = "rho_z c_por^2"

    @property
    def own_density(self) -> float:
        """rho_z = (1 - z) rho_water + z rho_air."""
        return porous_density(self.z, self.water_density)

    def build(self, rho0: float) -> EquationOfState:
        if self.mixing == "linear":
            return porous_linear(rho0, self.z, self.c0, self.k)
        return porous_wood(rho0, self.z, self.c0, self.k, self.water_density)


def porous_density(porosity: float, water_density: float) -> float:
    """rho_z = (1 - z) rho_water + z rho_air [kg/m^3]."""
    return (1.0 - porosity) * water_density + porosity * AIR_DENSITY


def porous_wood(rho0: float, porosity: float, c0: float, k: float, water_density: float) -> EquationOfState:
    """Tait water and isentropic air at one pressure, tabulated; gauge pressure, p(rho0) = 0.

    V/V0 = (1 - z)(1 + p/T)^(-1/n) + z (1 + p/p_atm)^(-1/1.4), n = 4k - 1, T = rho_water c0^2/n; the slope at rest is
    Wood's (A Textbook of Sound, 1930). rho0 = rho_z unless the user's bird has another mass: then its mu is rho_z's.
    """
    n = 4.0 * k - 1.0
    tait = water_density * c0**2 / n
    # the air expands without bound towards -1 atmosphere, Tait's water towards -T
    lowest = -0.999 * min(ATMOSPHERE, tait)
    reach = np.geomspace(1.0, 30.0 * tait, 1200)
    p = np.unique(np.concatenate([np.linspace(lowest, 0.0, 400), [0.0], reach]))
    water, air = 1.0 + p / tait, 1.0 + p / ATMOSPHERE
    volume = (1.0 - porosity) * water ** (-1.0 / n) + porosity * air ** (-1.0 / AIR_EXPONENT)
    softness = (1.0 - porosity) / (n * tait) * water ** (-1.0 / n - 1.0)
    softness += porosity / (AIR_EXPONENT * ATMOSPHERE) * air ** (-1.0 / AIR_EXPONENT - 1.0)
    return table(rho0, 1.0 / volume - 1.0, p, volume**2 / softness)


def porous_linear(rho0: float, porosity: float, c0: float, k: float) -> EquationOfState:
    """Polynomial from k with the sound speed (1 - z) c0 + z c_air of a mixture; not physical, see `porous_wood`."""
    return polynomial_k(rho0, (1.0 - porosity) * c0 + porosity * AIR_SOUND_SPEED, k)
