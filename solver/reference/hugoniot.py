"""Rankine-Hugoniot solution of an equation of state: the shock that a planar impact at particle velocity u makes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

from scipy.optimize import root_scalar

from birdstrike.data.errors import UserError
from birdstrike.solver.bird.eos.interface import EquationOfState

Pressure = Callable[[float, float], float]
"""p [Pa] of density [kg/m^3] and internal energy per unit reference volume [J/m^3]."""


@dataclass(frozen=True)
class Jump:
    """Behind the shock: pressure [Pa], density [kg/m^3]; shock [m/s]: its speed through the material at rest."""

    pressure: float
    density: float
    shock: float


def jump(pressure: Pressure, rho0: float, u: float, most: float = 10.0) -> Jump:
    """State behind a shock into material at rest, p = 0, of density rho0, with particle velocity u [m/s].

    Mass, momentum and energy: u_s = u/(1 - rho0/rho), p = rho0 u_s u, E = p (1 - rho0/rho)/2; the density at which the
    equation of state agrees is the least root of p(rho, E) - p. Raises UserError where there is none below most rho0.
    """

    def misfit(compression: float) -> float:
        """Of the equation of state against momentum, in units of rho0 u^2; compression = 1 - rho0/rho."""
        given = rho0 * u * u / compression
        return (pressure(rho0 / (1.0 - compression), 0.5 * given * compression) - given) / (rho0 * u * u)

    low, high = 1e-9, 1.0 - 1.0 / most
    steps = [low + (high - low) * (i / 400.0) ** 2 for i in range(401)]
    for a, b in pairwise(steps):
        if misfit(a) < 0.0 <= misfit(b):
            compression = root_scalar(misfit, bracket=(a, b), xtol=1e-15).root
            return Jump(rho0 * u * u / compression, rho0 / (1.0 - compression), u / compression)
    raise UserError(f"the equation of state has no shock of particle velocity {u} m/s below {most} times its density")


def pressure_of(eos: EquationOfState) -> Pressure:
    """Of a law of the solver."""
    return lambda rho, energy: eos.pressure(rho / eos.rho0 - 1.0, energy)
