"""Equations of state by name: their constants as the kernels read them, and what follows from them; SI."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import PchipInterpolator
from scipy.optimize import brentq

from birdstrike.data.histories import Array
from birdstrike.solver.kernels.eos import (
    GRUNEISEN,
    LINEAR_POLYNOMIAL,
    LOGARITHMIC,
    MURNAGHAN,
    TABLE,
    eos_terms,
    eos_update,
)

AIR_DENSITY, ATMOSPHERE, AIR_EXPONENT, AIR_SOUND_SPEED = 1.225, 101325.0, 1.4, 342.0


@dataclass(frozen=True)
class EquationOfState:
    """constants: the flat array of `kernels.eos`; initial_energy: E at rest, per reference volume [J/m^3]."""

    constants: Array
    initial_energy: float = 0.0

    @property
    def rho0(self) -> float:
        """Reference density [kg/m^3]."""
        return float(self.constants[1])

    @property
    def pressure_at_rest(self) -> float:
        """[Pa] at the reference density; 0 for a law in gauge pressure."""
        return self.pressure(0.0, self.initial_energy)

    @property
    def sound_speed(self) -> float:
        """[m/s] at rest."""
        return float(eos_update(self.rho0, self.rho0, self.pressure_at_rest, self.initial_energy, self.constants)[2])

    @property
    def bulk_modulus(self) -> float:
        """rho0 c^2 [Pa] at rest."""
        return self.rho0 * self.sound_speed**2

    def pressure(self, mu: float, energy: float = 0.0) -> float:
        """p = A + B E [Pa] at the compression mu = rho/rho0 - 1."""
        cold, _, factor, _ = eos_terms(mu, self.constants)
        return float(cold + factor * energy)

    def hugoniot(self, u: float) -> tuple[float, float, float]:
        """Pressure rise [Pa], shock velocity [m/s] and compression mu of the shock of particle velocity u [m/s].

        Rankine-Hugoniot: p - p0 = rho0 us u, us = u (1 + mu)/mu, E - E0 = (p + p0)/2 mu/(1 + mu), with this law's own
        p(mu, E). Raises ValueError where the law holds no such shock.
        """
        p0, e0 = self.pressure_at_rest, self.initial_energy

        def surplus(mu: float) -> float:
            p = p0 + self.rho0 * u * u * (1.0 + mu) / mu
            return self.pressure(mu, e0 + 0.5 * (p + p0) * mu / (1.0 + mu)) - p

        high = 1e-12
        while surplus(high) < 0.0:
            high *= 1.1
            if high > 100.0:
                raise ValueError(f"no shock of particle velocity {u} m/s on this equation of state")
        mu = float(brentq(surplus, high / 1.2, high, xtol=1e-15, rtol=1e-14))  # pyright: ignore[reportArgumentType]
        shock = u * (1.0 + mu) / mu
        return self.rho0 * shock * u, shock, mu

    def shocked_sound_speed(self, u: float) -> float:
        """Sound speed [m/s] behind the shock of particle velocity u [m/s]: the fastest that an impact at u makes."""
        rise, _, mu = self.hugoniot(u)
        p0 = self.pressure_at_rest
        energy = self.initial_energy + 0.5 * (rise + 2.0 * p0) * mu / (1.0 + mu)
        rho = self.rho0 * (1.0 + mu)
        return float(eos_update(rho, rho, p0 + rise, energy, self.constants)[2])


def grueneisen(
    rho0: float, C: float, S1: float, S2: float = 0.0, S3: float = 0.0, g0: float = 0.0, a: float = 0.0, E0: float = 0.0
) -> EquationOfState:
    """Shock velocity u_s = C + S1 u + ..., see `kernels.eos.grueneisen_terms`."""
    return EquationOfState(np.array([GRUNEISEN, rho0, C, S1, S2, S3, g0, a]), E0)


def linear_polynomial(rho0: float, coefficients: ArrayLike, E0: float = 0.0) -> EquationOfState:
    """p from C0 .. C6 (7,), see `kernels.eos.polynomial_terms`; E0 per reference volume [J/m^3]."""
    return EquationOfState(np.array([LINEAR_POLYNOMIAL, rho0, *np.asarray(coefficients, float)]), E0)


def murnaghan(rho0: float, B: float, g: float, p0: float = 0.0) -> EquationOfState:
    """p = p0 + B[(rho/rho0)^g - 1]."""
    return EquationOfState(np.array([MURNAGHAN, rho0, p0, B, g]))


def logarithmic(rho0: float, bulk_modulus: float) -> EquationOfState:
    """p = K ln(rho/rho0), the hypoelastic pressure."""
    return EquationOfState(np.array([LOGARITHMIC, rho0, bulk_modulus]))


def polynomial_k(rho0: float, c0: float, k: float) -> EquationOfState:
    """The cubic of a Hugoniot us = c0 + k u: C1 = rho0 c0^2, C2 = (2k - 1) C1, C3 = (k - 1)(3k - 1) C1."""
    c1 = rho0 * c0**2
    return linear_polynomial(rho0, [0.0, c1, (2.0 * k - 1.0) * c1, (k - 1.0) * (3.0 * k - 1.0) * c1, 0.0, 0.0, 0.0])


def table(rho0: float, mu: ArrayLike, p: ArrayLike, slope: ArrayLike | None = None) -> EquationOfState:
    """Pressure [Pa] over rising mu; cubic between, monotone where the points are (PCHIP); end slopes beyond.

    F. N. Fritsch & J. Butland, SIAM J. Sci. Stat. Comput. 5 (1984) 300; the slopes at the two ends are those of the
    end chords, because PCHIP's own may be zero and would be the sound speed beyond. slope: dp/dmu where known.
    """
    x, y = np.asarray(mu, float), np.asarray(p, float)
    if slope is None:
        chord = np.diff(y) / np.diff(x)
        inner = np.asarray(PchipInterpolator(x, y).derivative()(x))[1:-1]
        slope = np.concatenate([chord[:1], inner, chord[-1:]])
    return EquationOfState(np.concatenate([[TABLE, rho0, len(x)], np.column_stack([x, y, slope]).ravel()]))


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
    lowest = -0.999 * ATMOSPHERE  # the air expands without bound towards -1 atmosphere
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
