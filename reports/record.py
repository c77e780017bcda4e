"""The record against the strikes: what to call it, where it lies in the cloud, and where a simulation misses it."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.curves import Measured
from birdstrike.data.histories import Array
from birdstrike.inversion.observations.prior_predictive import ENVELOPE_SIGMAS
from birdstrike.reports.results import Results

_MADE_BY = re.compile(r"SIMULATED\s*(?:\(\s*(?:by\s+)?|(?:by|with)\s+)([^(),;:]+)")


def origin(record: Measured) -> str:
    """`measured`, or `simulated by LS-DYNA` where the provenance says so: never `measured` for a simulated record."""
    if not record.simulated:
        return "measured"
    made_by = next((found[1].strip() for line in record.provenance if (found := _MADE_BY.search(line))), "")
    return f"simulated by {made_by}" if made_by else "simulated, see its provenance"


def short_name(record: Measured) -> str:
    """The record's file without folder and suffix."""
    return Path(record.path).stem


@dataclass(frozen=True)
class Cloud:
    """One channel at the record's `time` (r,) s: its `values`, the smooth strikes' `low` and `high`, all (r,) SI.

    NaN: `values` in a gap, `low` and `high` where the strikes do not reach.
    margin: SI, what noise may add; a point counts as outside only beyond it. Strikes that lost over 5 % of the bird are
    another regime and widen the cloud without filling it: they don't count.
    """

    time: Array
    values: Array
    low: Array
    high: Array
    margin: float

    @property
    def outside(self) -> NDArray[np.bool_]:
        """(r,) True where the record lies beyond all strikes by more than the margin; False where one is missing."""
        return np.abs(self.excess) > self.margin

    @property
    def points(self) -> int:
        """How many points of the record the strikes reach."""
        return int(np.isfinite(self.excess).sum())

    @property
    def excess(self) -> Array:
        """(r,) SI: how far the record lies above (+) or below (-) the cloud; 0 inside, NaN where one is missing."""
        return np.maximum(self.values - self.high, 0.0) - np.maximum(self.low - self.values, 0.0)


def cloud(results: Results, channel: str) -> Cloud:
    """The smooth strikes at the record's times, on the estimated time origin."""
    time, values = results.record.time, results.record.channels[channel]
    on_their_clock = np.maximum(time - results.offset, results.dataset.time[0])  # at rest before the trigger
    strikes = results.dataset.sampled(channel, on_their_clock)
    strikes = strikes[results.dataset.smooth]
    margin = ENVELOPE_SIGMAS * results.inversion.measured.noise[channel]
    return Cloud(time, values, strikes.min(axis=0), strikes.max(axis=0), margin)


@dataclass(frozen=True)
class Residual:
    """Simulated minus record, (r,) SI, at those of the record's times (r,) s where both exist."""

    time: Array
    values: Array

    @property
    def worst(self) -> tuple[float, float]:
        """Time [s] and value of the largest miss."""
        return peak(self.time, self.values)


def residual(results: Results, channel: str, method: str) -> Residual:
    """What a method's verification leaves unexplained in one channel."""
    difference = results.simulated[method][channel] - results.record.channels[channel]
    both = np.isfinite(difference)
    return Residual(results.record.time[both], difference[both])


def peak(time: Array, values: Array) -> tuple[float, float]:
    """Time [s] and value of the largest magnitude, SI."""
    top = int(np.nanargmax(np.abs(values)))
    return float(time[top]), float(values[top])
