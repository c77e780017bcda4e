"""Stagnation pressure of a steady compressible stream, by Bernoulli's equation along its middle."""

from __future__ import annotations

import numpy as np
from scipy.integrate import cumulative_trapezoid

from birdstrike.solver.bird.eos.interface import EquationOfState


def compressible_stagnation_pressure(eos: EquationOfState, speed: float) -> float:
    """Pressure p_s [Pa] at which the integral of dp/rho from rest to p_s is u0^2/2, for a stream of u0 = `speed` [m/s].

    Found on the line from the density at rest to Hugoniot's, which bounds it from above.
    """
    rho = eos.rho0 * (1.0 + np.linspace(0.0, eos.hugoniot(speed)[2], 2001))
    p = np.array([eos.pressure(value / eos.rho0 - 1.0) for value in rho]) - eos.pressure_at_rest
    return float(np.interp(0.5 * speed**2, cumulative_trapezoid(1.0 / rho, p, initial=0.0), p))
