"""The pressure of a hypoelastic solid, K ln(rho/rho0): what an elastic bird's constants amount to."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from birdstrike.solver.bird.eos.interface import EquationOfState


def logarithmic(rho0: float, bulk_modulus: float) -> EquationOfState:
    """p = K ln(rho/rho0)."""
    return EquationOfState(logarithmic_terms, np.array([rho0, bulk_modulus]))


@njit(cache=True)
def logarithmic_terms(mu, eos):
    """A = K ln(1 + mu) and its slope; eos: rho0 [kg/m^3], K [Pa].

    The integral of the rate p' = -K tr D, so that it does not depend on the path.
    """
    return eos[1] * math.log(1.0 + mu), eos[1] / (1.0 + mu), 0.0, 0.0
