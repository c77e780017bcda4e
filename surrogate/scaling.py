"""Columns scaled to 0..1, as a network's inputs and outputs want them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit, logit

from birdstrike.data.histories import Array


@dataclass(frozen=True)
class Scaling:
    """Linear map of each column from low..high to 0..1; low, high: (k,) in the columns' own units.

    A constant column (low == high) carries no information: it maps to 0, and back to its one value.
    bounded: whether `from_unit` stays inside the range.
    """

    bounded: ClassVar[bool] = False
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

    def from_unit(self, unit: Array) -> Array:
        """The inverse of `to_unit`."""
        return np.where(self.constant, self.low, self.low + self.share(unit) * self._span)

    def share(self, unit: Array) -> Array:
        """Scaled values as shares of the range, 0 at `low` and 1 at `high`."""
        return unit


EDGE = 0.02
"""Of a range: how far inside its ends the logistic curve of a bounded output puts them, where it is still steep."""


@dataclass(frozen=True)
class BoundedScaling(Scaling):
    """Outputs that never leave low..high: a linear output y passes through a logistic curve, 0..1 for 0 <= y <= 1."""

    bounded: ClassVar[bool] = True

    def to_unit(self, values: Array) -> Array:
        """Targets of the linear output; values beyond the range count as its end."""
        unit = np.clip(super().to_unit(values), 0.0, 1.0)
        return 0.5 + logit(EDGE + (1.0 - 2.0 * EDGE) * unit) / (2.0 * logit(1.0 - EDGE))

    def share(self, unit: Array) -> Array:
        """Inside 0..1, whatever the linear output is."""
        curve = expit((2.0 * unit - 1.0) * logit(1.0 - EDGE))
        return np.clip((curve - EDGE) / (1.0 - 2.0 * EDGE), 0.0, 1.0)
