"""The gates of the audit: rates with two intervals over curves, and whether each gate is met.

Draws of the noise on one curve share its truth, so that curves are what is counted. A bootstrap over a handful of
curves is too narrow, and has no width at all where they agree; Clopper and Pearson's interval (Biometrika 26 (1934)
404) of round(rate x curves) successes in as many curves is exact for yes and no, and wide. A gate on an interval takes
the wider of the two.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.stats import binomtest

from birdstrike.data.histories import Array

RESAMPLES = 4000


@dataclass(frozen=True)
class Rate:
    """A rate over curves: value, 95 % intervals, and over how many curves and draws.

    interval_95: of a bootstrap over curves; exact_95: Clopper and Pearson's, None for a figure that is no rate.
    """

    value: float | None
    interval_95: tuple[float, float] | None
    exact_95: tuple[float, float] | None
    curves: int
    draws: int

    @property
    def wider(self) -> tuple[float, float]:
        """The wider interval; everything where there is none."""
        known = [one for one in (self.interval_95, self.exact_95) if one is not None]
        return max(known, key=lambda ends: ends[1] - ends[0], default=(-np.inf, np.inf))


def rate(per_curve: Sequence[Array], seed: int = 0) -> Rate:
    """Of yes and no drawn on each curve (draws,); every curve weighs alike."""
    found = figures_of(per_curve, seed)
    if found.value is None:
        return found
    return replace(found, exact_95=clopper_pearson(found.value, found.curves))


def clopper_pearson(value: float, curves: int) -> tuple[float, float]:
    """95 % interval of a rate over so many curves, its nearest whole number of successes taken."""
    ends = binomtest(round(value * curves), curves).proportion_ci(0.95, method="exact")
    return float(ends.low), float(ends.high)


def figures_of(per_curve: Sequence[Array], seed: int = 0, middle: Callable[..., Any] = np.mean) -> Rate:
    """Of figures drawn on each curve (draws,); curves are resampled whole."""
    kept = [np.asarray(values, float) for values in per_curve if len(values)]
    if not kept:
        return Rate(None, None, None, 0, 0)
    means = np.array([middle(values) for values in kept])
    picks = np.random.default_rng(seed).integers(len(means), size=(RESAMPLES, len(means)))
    resampled = middle(means[picks], axis=1)
    low, high = np.quantile(resampled, [0.025, 0.975])
    return Rate(float(middle(means)), (float(low), float(high)), None, len(kept), sum(map(len, kept)))


@dataclass(frozen=True)
class Gate:
    """One line of the table: figure, rate, the gate's words, met (None: shown without a gate)."""

    figure: str
    rate: Rate
    gate: str
    met: bool | None

    def figures(self) -> dict[str, Any]:
        """For JSON."""
        return {"figure": self.figure, **vars(self.rate), "gate": self.gate, "met": self.met}


def contains(figure: str, found: Rate, value: float) -> Gate:
    """The wider interval contains a value."""
    low, high = found.wider
    met = low <= value <= high if found.curves else None
    return Gate(figure, found, f"the interval contains {100 * value:g} %", met)


def at_least(figure: str, found: Rate, value: float) -> Gate:
    """At least a value."""
    return Gate(figure, found, f"at least {100 * value:g} %", None if found.value is None else found.value >= value)


def at_most(figure: str, found: Rate, value: float) -> Gate:
    """At most a value."""
    return Gate(figure, found, f"at most {100 * value:g} %", None if found.value is None else found.value <= value)


def between(figure: str, found: Rate, low: float, high: float) -> Gate:
    """Between two values."""
    met = None if found.value is None else low <= found.value <= high
    return Gate(figure, found, f"{100 * low:g} to {100 * high:g} %", met)


def below(figure: str, found: Rate, value: float) -> Gate:
    """A figure that is no percentage, below a value."""
    return Gate(figure, found, f"median below {value:g}", None if found.value is None else found.value < value)


def shown(figure: str, found: Rate) -> Gate:
    """Without a gate."""
    return Gate(figure, found, "shown", None)
