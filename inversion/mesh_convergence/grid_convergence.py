"""Grid convergence index: observed order, extrapolated value and numerical uncertainty from three meshes.

I. B. Celik et al., J. Fluids Eng. 130 (2008) 078001, after P. J. Roache; also ASME V&V 20, section 2; equations are
numbered as in Celik's paper. Order and factor of safety follow W. Oberkampf and C. Roy, Verification and Validation in
Scientific Computing (2010), section 8.7. Meshes are given finest first: spacings h1 < h2 < h3, values phi1, phi2, phi3.

That the band holds the exact value in 95 % of cases is an empirical claim, from flow solutions with smooth meshes, no
theorem: with the factor 1.25 throughout it held in 86 % of 304 (T. Xing and F. Stern, report ADA498086 (2009)).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, cast

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from birdstrike.data.histories import Array

Behaviour = Literal["convergent", "oscillating", "diverging", "unchanged"]

FORMAL, LOWEST = 2.0, 0.5  # order of the scheme, and the least that is used: below it there is no basis
NEAR = 0.1  # of the formal order: so near it the meshes count as being in the asymptotic range
SAFETY, SAFETY_AFAR = 1.25, 3.0  # factor of safety in the asymptotic range, and outside
ROUNDING = 1e-9  # of the largest value: changes below it are the arithmetic's, not the mesh's


@dataclass(frozen=True)
class GridConvergence:
    """Convergence of one quantity over three meshes, in its own unit; meshes finest first.

    order: observed, None where the values do not converge monotonically; order_used, safety: of `order_and_safety`;
    extrapolated: to zero spacing with the order used; uncertainties: of each mesh's value. Without convergence the
    uncertainty is the spread of the three values, and nothing is extrapolated. Where the order observed is above the
    formal one, as where two values agree by chance, it is at least the spread.
    """

    behaviour: Behaviour
    values: tuple[float, float, float]
    order: float | None
    order_used: float | None
    safety: float | None
    extrapolated: float | None
    uncertainties: tuple[float, float, float]

    @property
    def spread_taken(self) -> bool:
        """Whether the order is so far above the formal one that the spread is more than the finest mesh's index."""
        return self.order is not None and is_above(self.order) and self.uncertainties[0] <= float(np.ptp(self.values))

    def index(self, mesh: int) -> float | None:
        """Uncertainty of a mesh's value relative to it: the GCI; None for a value of zero."""
        return self.uncertainties[mesh] / abs(self.values[mesh]) if self.values[mesh] else None


def grid_convergence(spacings: Sequence[float], values: Sequence[float]) -> GridConvergence:
    """Convergence of one quantity over three meshes, finest first; raises ValueError for spacings that do not rise.

    Uncertainty of mesh k: Fs |phi_k - extrapolated|, for the finest Fs |phi2 - phi1|/(r21^p - 1), eq. 7; at least the
    spread of the three values where the order is above the formal one.
    """
    one, two, three = map(float, values)
    behaviour = behaviour_of(spacings, np.array([[one], [two], [three]]))[0]
    spread = max(one, two, three) - min(one, two, three)
    if behaviour != "convergent":
        return GridConvergence(
            behaviour=behaviour,
            values=(one, two, three),
            order=None,
            order_used=None,
            safety=None,
            extrapolated=None,
            uncertainties=(spread, spread, spread),
        )
    order = observed_order(spacings, (one, two, three))
    used, safety = order_and_safety(np.array([order]))
    exact = float(extrapolated(spacings, np.array([one]), np.array([two]), used)[0])
    least = spread if is_above(order) else 0.0
    finest, middle, coarsest = (max(safety * abs(value - exact), least) for value in (one, two, three))
    return GridConvergence(
        behaviour="convergent",
        values=(one, two, three),
        order=order,
        order_used=used,
        safety=safety,
        extrapolated=exact,
        uncertainties=(finest, middle, coarsest),
    )


def observed_order(spacings: Sequence[float], values: Sequence[float] | Array) -> float:
    """Order p of convergent values: the root of eq. 3 with its q(p) for unequal ratios, s = +1.

    (phi3 - phi2)/(phi2 - phi1) = r21^p (r32^p - 1)/(r21^p - 1), whose right side rises with p. The paper's fixed-point
    iteration seeks the same root; bracketing always finds it.
    """
    (a, b), (one, two, three) = log_ratios(spacings), values
    goal = math.log((three - two) / (two - one))
    highest = math.log(1.0 + (three - two) / (two - one)) / b
    order = brentq(lambda p: p * a + math.log(math.expm1(p * b) / math.expm1(p * a)) - goal, 1e-9, highest)
    return cast(float, order)


def log_ratios(spacings: Sequence[float]) -> tuple[float, float]:
    """Logarithms of the refinement ratios r21 and r32; raises ValueError unless the spacings rise."""
    fine, middle, coarse = spacings
    if not 0.0 < fine < middle < coarse:
        raise ValueError(f"spacings must rise from the finest mesh to the coarsest, not {tuple(spacings)}")
    return math.log(middle / fine), math.log(coarse / middle)


def order_and_safety(observed: Array) -> tuple[float, float]:
    """Order p and factor of safety Fs that extrapolation and index use, from the orders observed at n points, (n,).

    Within 10 % of the formal order p_f, in the mean of |p - p_f|: p_f and 1.25; else the mean of min(max(0.5, p), p_f)
    and 3 (Oberkampf and Roy, section 8.7, who state it for one order).
    """
    if float(np.mean(np.abs(observed - FORMAL))) <= NEAR * FORMAL:
        return FORMAL, SAFETY
    return float(np.mean(np.clip(observed, LOWEST, FORMAL))), SAFETY_AFAR


def is_above(order: float) -> bool:
    """Whether an observed order is above the formal one by more than the asymptotic range allows."""
    return order > (1.0 + NEAR) * FORMAL


def extrapolated(spacings: Sequence[float], fine: Array, middle: Array, order: float) -> Array:
    """Values at zero spacing from those of the two finest meshes, eq. 6."""
    return fine + (fine - middle) / math.expm1(order * log_ratios(spacings)[0])


def behaviour_of(spacings: Sequence[float], values: Array) -> NDArray[np.str_]:
    """How values (3, n), finest first, behave as the mesh is refined, (n,).

    Convergent: the changes agree in sign and shrink faster than with order 0, (phi3 - phi2)/(phi2 - phi1) > ln r32/ln
    r21; unchanged: both changes are rounding.
    """
    a, b = log_ratios(spacings)
    first, second = values[1] - values[0], values[2] - values[1]
    small = ROUNDING * np.abs(values).max()
    behaviour = np.where(first * second > 0.0, "diverging", "oscillating")
    shrinking = np.abs(second) * a > (1.0 + 1e-6) * np.abs(first) * b
    behaviour[(first * second > 0.0) & shrinking] = "convergent"
    behaviour[(np.abs(first) <= small) & (np.abs(second) <= small)] = "unchanged"
    return behaviour


@dataclass(frozen=True)
class CurveConvergence:
    """Convergence of a whole curve over three meshes.

    order, safety: used where it converges, None where it nowhere does; bands: (3, n) uncertainty of each mesh's curve,
    finest first; shares: of the instants, by behaviour.
    """

    order: float | None
    safety: float | None
    bands: Array
    shares: dict[str, float]


def curve_convergence(spacings: Sequence[float], curves: Array) -> CurveConvergence:
    """Point-wise band of curves (3, n), finest first: the index with one order for all, as Celik's figure 1.

    A point that does not converge has the spread of the three curves there as its band, one whose own order is above
    the formal one at least that.
    """
    behaviour = behaviour_of(spacings, curves)
    bands = np.tile(np.ptp(curves, axis=0), (3, 1))
    convergent = np.flatnonzero(behaviour == "convergent")
    order, safety = None, None
    if len(convergent):
        observed = np.array([observed_order(spacings, curves[:, i]) for i in convergent])
        order, safety = order_and_safety(observed)
        three = curves[:, convergent]
        least = np.where([is_above(one) for one in observed], bands[:, convergent], 0.0)
        bands[:, convergent] = np.maximum(
            safety * np.abs(three - extrapolated(spacings, three[0], three[1], order)), least
        )
    kinds = ("convergent", "oscillating", "diverging", "unchanged")
    return CurveConvergence(order, safety, bands, {kind: float(np.mean(behaviour == kind)) for kind in kinds})
