"""The record as a diagnosis reads it: points in the model's window, and the noise before and beside the strike."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from birdstrike.data.curves import Measured
from birdstrike.data.histories import Array
from birdstrike.inversion.observations import reader as observed
from birdstrike.inversion.observations.noise import Noise
from birdstrike.inversion.observations.reader import ChannelRecord, Expected

MOST_POINTS = 400  # of all channels together: beyond it, neighbours are averaged
FEWEST_POINTS = 3


@dataclass(frozen=True)
class Trace:
    """One channel: instants (raw,) [s] on the record's clock, of which each `block` neighbours make one point.

    values: (n,) SI, the means of the blocks; noise: of one instant; peak: largest magnitude, SI.
    """

    name: str
    unit: str
    times: Array
    block: int
    values: Array
    noise: Noise
    peak: float

    @property
    def middle(self) -> Array:
        """(n,) mean instant of every point [s]."""
        return averaged(self.times, self.block)

    @property
    def level(self) -> float:
        """Typical standard deviation of a point's noise, SI."""
        return float(np.sqrt(np.diag(self.covariance()).mean()))

    def covariance(self) -> Array:
        """(n, n) of the measurement noise of the points."""
        return self.noise.covariance(self.times, self.block)


@dataclass(frozen=True)
class Record:
    """All channels, one after the other, and what the user should know about how they were read."""

    traces: tuple[Trace, ...]
    warnings: tuple[str, ...]

    @property
    def values(self) -> Array:
        """(n,) stacked."""
        return np.concatenate([trace.values for trace in self.traces])

    @property
    def middle(self) -> Array:
        """(n,) stacked instants [s]."""
        return np.concatenate([trace.middle for trace in self.traces])

    @property
    def channel(self) -> np.ndarray:
        """(n,) number of the channel of every point."""
        return np.repeat(np.arange(len(self.traces)), [len(trace.values) for trace in self.traces])

    @property
    def noise_freedom(self) -> float:
        """Degrees of freedom behind the noise level: those of the channel that knows it least."""
        return min(trace.noise.freedom for trace in self.traces)

    @property
    def noise_known(self) -> bool:
        """Whether every channel's noise level is known independently of the fit."""
        return all(trace.noise.known for trace in self.traces)

    @property
    def noise_inferred(self) -> bool:
        """Whether the noise level of a channel must come from the fit, so that no miss can be called unexplained."""
        return any(trace.noise.inferred for trace in self.traces)

    def covariance(self) -> Array:
        """(n, n) of the measurement noise; channels are independent."""
        return np.asarray(block_diag(*(trace.covariance() for trace in self.traces)))


def averaged(values: Array, block: int) -> Array:
    """Means (..., n) of `block` neighbours of values (..., raw)."""
    if block == 1:
        return values
    return values.reshape(*values.shape[:-1], -1, block).mean(axis=-1)


def read_record(measured: Measured, expected: Expected, tolerance: float | None = None) -> Record:
    """The record's channels as the common reader gives them, neighbours averaged where there are many.

    tolerance: noise as a share of the peak where none is known. Raises MeasuredError for an unknown channel, another
    unit, or a channel with fewer than three points in the window.
    """
    channels = observed.read_record(measured, expected, tolerance, FEWEST_POINTS)
    most = max(MOST_POINTS // len(channels), FEWEST_POINTS)
    warnings = tuple(text for channel in channels for text in channel.warnings)
    return Record(tuple(_trace(channel, most) for channel in channels), warnings)


def _trace(channel: ChannelRecord, most: int) -> Trace:
    """At most `most` points, each the mean of as many neighbours."""
    count = len(channel.times)
    block = -(-count // most)
    kept = np.arange(count - count % block)
    values = averaged(channel.values[kept], block)
    return Trace(channel.name, channel.unit, channel.times[kept], block, values, channel.noise.at(kept), channel.peak)
