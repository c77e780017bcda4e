"""Equations of state of the bird: pressure [Pa] and sound speed [m/s] from density and energy, p = A(mu) + B(mu) E."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, NamedTuple

from birdstrike.data.histories import Array
from birdstrike.solver.fields import Between, Section
from birdstrike.solver.kernels.bird.eos import eos_close

Modulus = Annotated[float, Between("-1000000 MPa", "1000000 MPa")]
Speed = Annotated[float, Between("10 m/s", "10000 m/s")]
Number = Annotated[float, Between(-10.0, 10.0)]
PerVolume = Annotated[float, Between("0 MPa", "1000 MPa")]  # J/m^3 is Pa

Terms = Callable[[float, Array], tuple[float, float, float, float]]
"""Compiled (numba.njit): (mu, constants) -> A [Pa], dA/dmu [Pa], B, dB/dmu; see `kernels.bird.eos`."""


class Sought(NamedTuple):
    """Range in which a calibration seeks a constant, as a case writes it; scale: "linear" or "logarithmic"."""

    low: Any
    high: Any
    scale: str = "linear"


@dataclass(frozen=True)
class EquationOfState:
    """A law about its reference density.

    terms: its formula; constants: what the formula reads, the first being the reference density [kg/m^3];
    initial_energy: E at rest, per reference volume [J/m^3].
    """

    terms: Terms
    constants: Array
    initial_energy: float = 0.0

    @property
    def rho0(self) -> float:
        """Reference density [kg/m^3]."""
        return float(self.constants[0])

    @property
    def pressure_at_rest(self) -> float:
        """[Pa] at the reference density; 0 for a law in gauge pressure."""
        return self.pressure(0.0, self.initial_energy)

    @property
    def sound_speed(self) -> float:
        """[m/s] at rest."""
        return self.update(self.rho0, self.rho0, self.pressure_at_rest, self.initial_energy)[2]

    @property
    def bulk_modulus(self) -> float:
        """rho0 c^2 [Pa] at rest."""
        return self.rho0 * self.sound_speed**2

    def pressure(self, mu: float, energy: float = 0.0) -> float:
        """p = A + B E [Pa] at the compression mu = rho/rho0 - 1."""
        cold, _, factor, _ = self.terms(mu, self.constants)
        return float(cold + factor * energy)

    def update(self, rho: float, rho_before: float, p_before: float, energy: float) -> tuple[float, float, float]:
        """Pressure [Pa], energy [J/m^3], sound speed [m/s] after a change of density (`kernels.bird.eos.eos_close`)."""
        terms = self.terms(rho / self.rho0 - 1.0, self.constants)
        p, energy_after, c = eos_close(rho, rho_before, p_before, energy, self.rho0, *terms)
        return float(p), float(energy_after), float(c)

    def hugoniot(self, u: float) -> tuple[float, float, float]:
        """Pressure rise [Pa], shock velocity [m/s] and compression mu of the shock of particle velocity u [m/s].

        Rankine-Hugoniot: p - p0 = rho0 us u, us = u (1 + mu)/mu, E - E0 = (p + p0)/2 mu/(1 + mu), with this law's own
        p(mu, E). Raises ValueError where the law holds no such shock.
        """
        from scipy.optimize import brentq  # late: a case that is only read needs no shock

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
        return self.update(rho, rho, p0 + rise, energy)[2]


class Law(Section):
    """Table of an equation of state in a case; `kind` names it. After validation every value is SI.

    literature, source, sought: as of a `BirdMaterial`, where the law is named with a model (MODEL+LAW); modulus: the
    bulk modulus at rest in the law's symbols.
    """

    kind: str
    literature: ClassVar[Mapping[str, Any]] = {}
    source: ClassVar[str] = ""
    sought: ClassVar[Mapping[str, Sought]] = {}
    modulus: ClassVar[str] = ""
    gives_density: ClassVar[bool] = False
    """Whether the law fixes the bird's density where the case gives none."""
    air_key: ClassVar[str] = ""
    """Key of the law's share of air; empty for a law that has none."""

    @property
    def own_density(self) -> float | None:
        """Reference density [kg/m^3] where the law itself fixes one."""
        return None

    @classmethod
    def broken_rules(cls, _raw: Mapping[str, Any], _prefix: str) -> Iterator[str]:
        """One line for every rule between keys that the table as read breaks; prefix: its dotted key."""
        yield from ()

    def build(self, rho0: float) -> EquationOfState:
        """The law about the reference density [kg/m^3]."""
        raise NotImplementedError(self.kind)
