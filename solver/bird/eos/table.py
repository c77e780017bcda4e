"""Equation of state given point by point: pressure over density, a monotone cubic between."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import pairwise
from typing import Annotated, Any, Literal

import numpy as np
from numba import njit
from numpy.typing import ArrayLike
from pydantic import field_validator

from birdstrike.data.errors import UserError
from birdstrike.solver.bird.eos.interface import EquationOfState, Law, Modulus
from birdstrike.solver.fields import Between, complaint


class Table(Law):
    """Pressure p over the density rho or over mu, point by point; in a case file, `file` may name a CSV of them."""

    kind: Literal["table"]
    rho: tuple[Annotated[float, Between("1 kg/m^3", "20000 kg/m^3")], ...] = ()
    mu: tuple[Annotated[float, Between(-0.99, 20.0)], ...] = ()
    p: tuple[Modulus, ...]

    @field_validator("rho", "mu", "p")
    @classmethod
    def _rises(cls, value: tuple[float, ...]) -> tuple[float, ...]:
        falls = next((row for row, (one, after) in enumerate(pairwise(value), start=2) if after <= one), None)
        if falls is not None:
            text = f"does not rise at point {falls} of {len(value)}"
            if value[falls - 1] == value[falls - 2]:
                raise complaint(f"{text}: it has the value of the point before; leave one of the two out")
            raise complaint(f"{text}: a pressure that falls in compression is unstable; correct it or leave it out")
        return value

    @classmethod
    def broken_rules(cls, raw: Mapping[str, Any], prefix: str) -> Iterator[str]:
        given = [name for name in ("rho", "mu") if name in raw]
        if len(given) != 1:
            yield f"{prefix}: a table is over rho or over mu; give one of them (or `file`)"
            return
        first, p = raw[given[0]], raw.get("p")
        if isinstance(first, list) and isinstance(p, list) and (len(first) != len(p) or len(p) < 3):
            yield f"{prefix}: {len(first)} values of {given[0]} and {len(p)} of p; as many, and at least three"

    def build(self, rho0: float) -> EquationOfState:
        mu = self.mu or tuple(rho / rho0 - 1.0 for rho in self.rho)
        if not mu[0] <= 0.0 <= mu[-1]:
            low, high = (1.0 + end for end in (mu[0], mu[-1]))
            raise UserError(
                f"bird.material.eos: the table of densities {low * rho0:g} .. {high * rho0:g} kg/m^3 does not hold "
                f"the bird's own, {rho0:g} kg/m^3 (mu = 0); change bird.density or the table"
            )
        return table(rho0, mu, self.p)


def table(rho0: float, mu: ArrayLike, p: ArrayLike, slope: ArrayLike | None = None) -> EquationOfState:
    """Pressure [Pa] over rising mu; cubic between, monotone where the points are (PCHIP); end slopes beyond.

    F. N. Fritsch & J. Butland, SIAM J. Sci. Stat. Comput. 5 (1984) 300; the slopes at the two ends are those of the
    end chords, because PCHIP's own may be zero and would be the sound speed beyond. slope: dp/dmu where known.
    """
    x, y = np.asarray(mu, float), np.asarray(p, float)
    if slope is None:
        from scipy.interpolate import PchipInterpolator  # late: few cases have a table without slopes

        chord = np.diff(y) / np.diff(x)
        inner = np.asarray(PchipInterpolator(x, y).derivative()(x))[1:-1]
        slope = np.concatenate([chord[:1], inner, chord[-1:]])
    knots = np.column_stack([x, y, slope]).ravel()
    return EquationOfState(table_terms, np.concatenate([[rho0, len(x)], knots]))


KNOTS = 2  # where a table's knots begin


@njit(cache=True)
def table_terms(mu, eos):
    """Cubic Hermite interpolation between the knots, the end slopes beyond them; no energy term.

    eos: rho0 [kg/m^3], number of knots, then mu, p [Pa] and dp/dmu [Pa] of each.
    """
    low, high = 0, int(eos[1]) - 1
    if mu <= eos[KNOTS]:
        return eos[KNOTS + 1] + (mu - eos[KNOTS]) * eos[KNOTS + 2], eos[KNOTS + 2], 0.0, 0.0
    last = KNOTS + 3 * high
    if mu >= eos[last]:
        return eos[last + 1] + (mu - eos[last]) * eos[last + 2], eos[last + 2], 0.0, 0.0
    while high - low > 1:
        middle = (low + high) // 2
        if eos[KNOTS + 3 * middle] <= mu:
            low = middle
        else:
            high = middle
    i = KNOTS + 3 * low
    width = eos[i + 3] - eos[i]
    t = (mu - eos[i]) / width
    rise = eos[i + 4] - eos[i + 1]
    bend, twist = 3.0 * rise - width * (2.0 * eos[i + 2] + eos[i + 5]), width * (eos[i + 2] + eos[i + 5]) - 2.0 * rise
    p = eos[i + 1] + t * (width * eos[i + 2] + t * (bend + t * twist))
    return p, eos[i + 2] + t * (2.0 * bend + 3.0 * t * twist) / width, 0.0, 0.0
