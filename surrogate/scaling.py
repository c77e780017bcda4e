"""Columns scaled to 0..1, as a network's inputs and outputs want them: inputs linearly, outputs as the ranges are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit, logit

from birdstrike.data.dataset import Ranges
from birdstrike.data.histories import Array


@dataclass(frozen=True)
class Scaling:
    """Linear map of each column from low..high to 0..1; low, high: (k,) in the columns' own units.

    A constant column (low == high) carries no information: it maps to 0.
    """

    low: Array
    high: Array

    @classmethod
    def over(cls, values: Array, least: Array | float = 0.0) -> Scaling:
        """The map that puts the rows of `values` (n, k) in 0..1; a span up to `least` (k,) counts as constant."""
        low, high = values.min(axis=0), values.max(axis=0)
        return cls(low, np.where(high - low <= least, low, high))

    @property
    def constant(self) -> NDArray[np.bool_]:
        """(k,) True where a column never changes, up to rounding."""
        return self.high - self.low <= 1e-12 * np.maximum(np.abs(self.low), np.abs(self.high))

    @property
    def _span(self) -> Array:
        return np.where(self.constant, 1.0, self.high - self.low)

    def to_unit(self, values: Array) -> Array:
        """(n, k) or (k,) -> the same shape, 0..1 inside the range, beyond it outside."""
        return np.where(self.constant, 0.0, (values - self.low) / self._span)


EDGE = 0.02
"""Of a range: how far inside its ends the logistic curve of a bounded output puts them, where it is still steep."""


@dataclass(frozen=True)
class OutputScaling(Ranges):
    """A network's outputs y (n, k) for parameters over their ranges: y = 0 at `lows`, 1 at `highs`, in their scales.

    A network learns logarithms of a parameter that spans decades, as its design spreads the runs: linearly nine of ten
    runs over three decades would be one target. bounded: y passes through a logistic curve, so that no parameter leaves
    its range; else y is the fraction of the range, which is the bird-strike network where the range is linear.
    """

    lows: Array
    highs: Array
    scales: tuple[str, ...] = ()
    bounded: bool = True

    def targets(self, values: Array) -> Array:
        """y for parameters (n, k) SI; where bounded, values beyond the range count as its end."""
        unit = self.to_unit(values)
        if not self.bounded:
            return unit
        inside = np.clip(unit, 0.0, 1.0)
        return 0.5 + logit(EDGE + (1.0 - 2.0 * EDGE) * inside) / (2.0 * logit(1.0 - EDGE))

    def fractions(self, y: Array) -> Array:
        """Fractions of the ranges for y; inside 0..1 where bounded."""
        if not self.bounded:
            return y
        curve = expit((2.0 * y - 1.0) * logit(1.0 - EDGE))
        return np.clip((curve - EDGE) / (1.0 - 2.0 * EDGE), 0.0, 1.0)
