"""The measured points an inversion uses: inside the simulated record, without gaps, each with its noise."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from birdstrike.data.curves import Measured
from birdstrike.data.dataset import Dataset
from birdstrike.data.formatting import plain, reading
from birdstrike.data.histories import Array
from birdstrike.inversion.observations.autocorrelation import density_freedom, hidden_tau, neighbour_correlation
from birdstrike.inversion.observations.expected import Expected
from birdstrike.inversion.observations.noise import DIGITISER
from birdstrike.inversion.observations.reader import OUTSIDE, ChannelRecord, read_record


@dataclass(frozen=True)
class Channel:
    """One sensor's points, (n,) each: times [s] on the record's clock, values SI, noise (standard deviation) SI.

    values: the reading at rest subtracted where the record before contact shows it; record: what they were read from;
    correlation_time: of the noise, exp(-dt/time) between points [s], 0 where it is not known to be correlated, and of a
    digitiser's rounding, which no first-order process describes.
    """

    name: str
    unit: str
    times: Array
    values: Array
    noise: Array
    noise_source: str
    record: ChannelRecord | None = None
    correlation_time: float = 0.0

    @property
    def correlation(self) -> Array:
        """(n,) of each point's noise with that of the point before; 0 at the first, and of white noise."""
        return neighbour_correlation(self.times, self.correlation_time)

    @property
    def filtered(self) -> bool:
        """Whether the noise is that before a filter, behind which it is smaller and correlated."""
        return self.record is not None and self.record.read_before is not None

    @property
    def tau(self) -> float:
        """n points are worth n / tau with independent noise: (1 + rho) / (1 - rho) at their median distance."""
        rho = self.correlation
        typical = float(np.median(rho[1:])) if rho.any() else 0.0
        return (1.0 + typical) / (1.0 - typical)

    @property
    def freedom(self) -> float:
        """Degrees of freedom behind the noise's variance times its `tau`; inf where it is stated and white."""
        if self.record is None:
            return np.inf
        if not self.correlation_time:
            return self.record.noise.freedom
        return min(self.record.noise.freedom, density_freedom(self.points_of_noise, self.tau))

    @property
    def points_of_noise(self) -> float:
        """Readings that show the noise and its correlation: at rest, of a filtered record before the filter.

        Of a rest that was read at another rate than the response as many as that rate has in the same time: `tau` is
        counted in the response's points.
        """
        passed = None if self.record is None else self.record.read_before
        if passed is not None:
            return passed.points
        before = None if self.record is None else self.record.noise.before
        if before is None or len(self.times) < 2:
            return 0.0
        _, points, distance = before
        return points * distance / float(np.median(np.diff(self.times)))

    @property
    def hidden_tau(self) -> float:
        """The largest `tau` that the record before contact may not have shown; 1 where there is none."""
        return hidden_tau(self._points_at_rest) if self._points_at_rest else 1.0

    @property
    def _points_at_rest(self) -> int:
        """Readings before contact that show the noise, 0 where they are too few."""
        before = None if self.record is None else self.record.noise.before
        return 0 if before is None else before[1]

    @property
    def peak(self) -> float:
        """Largest measured magnitude, SI."""
        return float(np.abs(self.values).max())


@dataclass(frozen=True)
class Observations:
    """All channels one after the other, and what the user should know about how they were read."""

    channels: tuple[Channel, ...]
    warnings: tuple[str, ...] = ()

    @property
    def values(self) -> Array:
        """(n,) stacked values, SI."""
        return np.concatenate([c.values for c in self.channels])

    @property
    def noise(self) -> Array:
        """(n,) stacked standard deviations, SI."""
        return np.concatenate([c.noise for c in self.channels])

    @property
    def correlation(self) -> Array:
        """(n,) correlation of each point's noise with that of the point before, in its channel."""
        return np.concatenate([c.correlation for c in self.channels])

    @property
    def baseline_columns(self) -> Array:
        """(n, s) SI: what is uncertain in the readings at rest, a column for one standard deviation of each."""
        blocks = [
            c.record.baseline.columns(c.times)
            if c.record is not None and c.record.zeroed and c.record.baseline is not None
            else np.zeros((len(c.times), 0))
            for c in self.channels
        ]
        return np.asarray(block_diag(*blocks), dtype=np.float64)

    @property
    def last(self) -> float:
        """Latest instant used [s]."""
        return max(float(c.times[-1]) for c in self.channels)

    def split(self, stacked: Array) -> dict[str, Array]:
        """Stacked values (..., n) back to channels."""
        ends = np.cumsum([len(c.times) for c in self.channels])[:-1]
        return {c.name: part for c, part in zip(self.channels, np.split(stacked, ends, axis=-1), strict=True)}


def observe(measured: Measured, dataset: Dataset, noise: Mapping[str, float], time_offset: float = 0.0) -> Observations:
    """The points of a record that lie inside the runs of a campaign.

    Parameters
    ----------
    measured : Measured
        The record, SI.
    dataset : Dataset
        The campaign, whose runs give sensors, units and the simulated record.
    noise : mapping
        Sensor -> standard deviation that the case states, SI.
    time_offset : float
        Standard deviation of the time origin [s].

    Returns
    -------
    Observations
        All channels, with a warning for all that was left out or assumed.

    Raises
    ------
    MeasuredError
        For a channel no run has, another unit, or no point inside the record.
    """
    return observed(measured, Expected.of_campaign(dataset, noise, time_offset))


def observed(measured: Measured, expected: Expected) -> Observations:
    """The same by what is known of the record beforehand."""
    read = read_record(measured, expected, test_stated=False, zero=True)
    channels = tuple(
        Channel(
            name=c.name,
            unit=c.unit,
            times=c.times,
            values=c.values,
            noise=c.noise.sigma,
            noise_source=c.noise.source if c.noise.known else "assumed",
            record=c,
            correlation_time=0.0 if c.noise.source == DIGITISER else c.noise.correlation_time,
        )
        for c in read
    )
    return Observations(channels, tuple(text for c in read for text in _warnings(c, expected)))


def _warnings(channel: ChannelRecord, expected: Expected) -> list[str]:
    """All that was left out of a channel, and what had to be assumed."""
    outside = next((cut.times for cut in channel.cuts if cut.reason == OUTSIDE), np.zeros(0))
    before, name = int((outside < expected.start).sum()), plain(channel.name)
    span = f"{expected.start * 1e3:g} .. {expected.end * 1e3:g} ms"
    if expected.spared:
        span += f" (less its last {expected.spared * 1e3:g} ms, which an early clock needs)"
    found = [
        f"{name}: {before} points before and {len(outside) - before} after the simulated record {span} are "
        "left out of the fit"
    ] * bool(len(outside))
    found += channel.warnings
    if not channel.noise.known:
        size = reading(channel.noise.level, channel.unit)
        found.append(f"{name}: no noise is stated; {size} (1 % of the peak) is assumed, and the intervals rest on it")
    return found
