"""What a case says of the bird's equation of state: the symbols of each law; after validation every value is SI."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated

from pydantic import field_validator

from birdstrike.data.errors import UserError
from birdstrike.solver.bird.eos import (
    EquationOfState,
    grueneisen,
    linear_polynomial,
    murnaghan,
    polynomial_k,
    porous_density,
    porous_linear,
    porous_wood,
    table,
)
from birdstrike.solver.fields import Between, OneOf, Section, complaint
from birdstrike.solver.registry import Kinds

Modulus = Annotated[float, Between("-1000000 MPa", "1000000 MPa")]
Speed = Annotated[float, Between("10 m/s", "10000 m/s")]
Number = Annotated[float, Between(-10.0, 10.0)]
PerVolume = Annotated[float, Between("0 MPa", "1000 MPa")]  # J/m^3 is Pa


class Law(Section):
    """An equation of state; `kind` names it."""

    kind: str

    @property
    def own_density(self) -> float | None:
        """Reference density [kg/m^3] where the law itself fixes one."""
        return None

    def build(self, rho0: float) -> EquationOfState:
        """The law about the reference density [kg/m^3]."""
        raise NotImplementedError(self.kind)


class Grueneisen(Law):
    """Shock velocity u_s = C + S1 u + ...; g0 the Grueneisen gamma, a its first-order volume correction."""

    C: Speed
    S1: Annotated[float, Between(0.0, 10.0)]
    S2: Number = 0.0
    S3: Number = 0.0
    g0: Annotated[float, Between(0.0, 10.0)] = 0.0
    a: Number = 0.0
    E0: PerVolume = 0.0

    def build(self, rho0: float) -> EquationOfState:
        return grueneisen(rho0, self.C, self.S1, self.S2, self.S3, self.g0, self.a, self.E0)


class LinearPolynomial(Law):
    """p = C0 + C1 mu + C2 mu^2 + C3 mu^3 + (C4 + C5 mu + C6 mu^2) E; C2 and C6 act in compression alone."""

    C0: Modulus = 0.0
    C1: Annotated[float, Between("0.1 MPa", "1000000 MPa")]
    C2: Modulus = 0.0
    C3: Modulus = 0.0
    C4: Number = 0.0
    C5: Number = 0.0
    C6: Number = 0.0
    E0: PerVolume = 0.0

    def build(self, rho0: float) -> EquationOfState:
        return linear_polynomial(rho0, [self.C0, self.C1, self.C2, self.C3, self.C4, self.C5, self.C6], self.E0)


class Murnaghan(Law):
    """p = p0 + B[(rho/rho0)^g - 1]."""

    p0: Annotated[float, Between("-10 MPa", "10 MPa")] = 0.0
    B: Annotated[float, Between("0.1 MPa", "100000 MPa")]
    g: Annotated[float, Between(1.0, 20.0)]

    def build(self, rho0: float) -> EquationOfState:
        return murnaghan(rho0, self.B, self.g, self.p0)


class PolynomialK(Law):
    """The cubic of the shock line u_s = c0 + k u."""

    c0: Speed
    k: Annotated[float, Between(1.0, 5.0)]

    def build(self, rho0: float) -> EquationOfState:
        return polynomial_k(rho0, self.c0, self.k)


class Porous(Law):
    """Water (c0, k, water_density) with a share z of air; "wood": one pressure in both; "linear": c_por, unphysical."""

    z: Annotated[float, Between(0.0, 0.9)]
    mixing: Annotated[str, OneOf(("wood", "linear"))]
    c0: Speed = 1482.9
    k: Annotated[float, Between(1.0, 5.0)] = 2.0
    water_density: Annotated[float, Between("500 kg/m^3", "2000 kg/m^3")] = 1000.0

    @property
    def own_density(self) -> float:
        """rho_z = (1 - z) rho_water + z rho_air."""
        return porous_density(self.z, self.water_density)

    def build(self, rho0: float) -> EquationOfState:
        if self.mixing == "linear":
            return porous_linear(rho0, self.z, self.c0, self.k)
        return porous_wood(rho0, self.z, self.c0, self.k, self.water_density)


class Table(Law):
    """Pressure p over the density rho or over mu, point by point; in a case file, `file` may name a CSV of them."""

    rho: tuple[Annotated[float, Between("1 kg/m^3", "20000 kg/m^3")], ...] = ()
    mu: tuple[Annotated[float, Between(-0.99, 20.0)], ...] = ()
    p: tuple[Modulus, ...]

    @field_validator("rho", "mu", "p")
    @classmethod
    def _rises(cls, value: tuple[float, ...]) -> tuple[float, ...]:
        falls = next((row for row, (one, after) in enumerate(pairwise(value), start=2) if after <= one), None)
        if falls is not None:
            text = f"does not rise at point {falls} of {len(value)}"
            raise complaint(f"{text}: a pressure that falls in compression is unstable; correct it or leave it out")
        return value

    def build(self, rho0: float) -> EquationOfState:
        mu = self.mu or tuple(rho / rho0 - 1.0 for rho in self.rho)
        if not mu[0] <= 0.0 <= mu[-1]:
            low, high = (1.0 + end for end in (mu[0], mu[-1]))
            raise UserError(
                f"bird.material.eos: the table of densities {low * rho0:g} .. {high * rho0:g} kg/m^3 does not hold "
                f"the bird's own, {rho0:g} kg/m^3 (mu = 0); change bird.density or the table"
            )
        return table(rho0, mu, self.p)


LAWS = Kinds(
    "equation of state",
    "kind",
    None,
    {
        "grueneisen": Grueneisen,
        "linear_polynomial": LinearPolynomial,
        "murnaghan": Murnaghan,
        "polynomial_k": PolynomialK,
        "porous": Porous,
        "table": Table,
    },
    Law,
)
