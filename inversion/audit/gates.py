"""The gates of the audit: rates with bootstrap intervals over curves, and whether each gate is met."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from data.histories import Array

RESAMPLES = 4000


@dataclass(frozen=True)
class Rate:
    """A rate over curves: value, 95 % interval of a bootstrap over curves, and over how many curves and draws."""

    value: float | None
    interval_95: tuple[float, float] | None
    curves: int
    draws: int

    def within(self, low: float, high: float) -> bool:
        """Whether the interval reaches into low .. high."""
        return self.interval_95 is not None and self.interval_95[0] <= high and self.interval_95[1] >= low


def rate(per_curve: Sequence[Array], seed: int = 0, middle: Callable[..., Any] = np.mean) -> Rate:
    """Of yes and no (or figures) drawn on each curve (draws,); curves are resampled whole: their draws share a truth.

    Every curve weighs alike.
    """
    kept = [np.asarray(values, float) for values in per_curve if len(values)]
    if not kept:
        return Rate(None, None, 0, 0)
    means = np.array([middle(values) for values in kept])
    picks = np.random.default_rng(seed).integers(len(means), size=(RESAMPLES, len(means)))
    resampled = middle(means[picks], axis=1)
    low, high = np.quantile(resampled, [0.025, 0.975])
    return Rate(float(middle(means)), (float(low), float(high)), len(kept), sum(map(len, kept)))


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
    """The interval contains a value."""
    return Gate(
        figure, found, f"the interval contains {100 * value:g} %", found.within(value, value) if found.curves else None
    )


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
