"""The measured points an inversion uses: inside the simulated record, without gaps, each with its noise."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.curves import Measured
from birdstrike.data.dataset import Dataset
from birdstrike.data.errors import MeasuredError
from birdstrike.data.histories import Array
from birdstrike.inversion.formatting import quantity
from birdstrike.inversion.observations.outliers import clipped, outliers

DEFAULT_NOISE = 0.01  # of the channel's measured peak, when nobody states any
FEWEST_BEFORE_CONTACT = 8


@dataclass(frozen=True)
class Channel:
    """One sensor's points, (n,) each: times [s] on the record's clock, values SI, noise (standard deviation) SI."""

    name: str
    unit: str
    times: Array
    values: Array
    noise: Array
    noise_source: str

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
    def last(self) -> float:
        """Latest instant used [s]."""
        return max(float(c.times[-1]) for c in self.channels)

    def split(self, stacked: Array) -> dict[str, Array]:
        """Stacked values (..., n) back to channels."""
        ends = np.cumsum([len(c.times) for c in self.channels])[:-1]
        return {c.name: part for c, part in zip(self.channels, np.split(stacked, ends, axis=-1), strict=True)}


def observe(measured: Measured, dataset: Dataset, noise: Mapping[str, float]) -> Observations:
    """Points of every measured channel inside the campaign's record; `noise`: sensor noise of the case, SI.

    Noise: the `_sigma` column, else the case's, else the scatter of the record before t = 0, else 1 % of the peak.
    Raises MeasuredError for a channel no run has, another unit, or no point inside the record.
    """
    measured.refuse_dead_sensors()
    errors = [error for name in measured.channels for error in _mismatch(measured, dataset, name)]
    if errors:
        raise MeasuredError(errors)
    channels: list[Channel] = []
    warnings: list[str] = []
    for name in measured.channels:
        channel, left_out = _points(measured, dataset, name)
        channel, cut = _without(channel, clipped(channel.values), "clipped (the same reading in a row)")
        channel, assumed = _with_noise(channel, measured, noise.get(name))
        channel, odd = _without(channel, outliers(channel.values, channel.noise), "far off their neighbours")
        channels.append(channel)
        warnings += [text for text in (left_out, cut, assumed, odd) if text]
    return Observations(tuple(channels), tuple(warnings))


def _mismatch(measured: Measured, dataset: Dataset, name: str) -> list[str]:
    if name not in dataset.curves:
        known = ", ".join(dataset.curves)
        return [f'measured channel "{name}" in {measured.path} is no sensor of the campaign\'s case; sensors: {known}']
    if measured.units[name] != dataset.channel_units[name]:
        want, have = dataset.channel_units[name] or "no unit", measured.units[name] or "no unit"
        return [f'measured channel "{name}" in {measured.path} has unit {have}, the sensor {want}']
    return []


def _points(measured: Measured, dataset: Dataset, name: str) -> tuple[Channel, str]:
    """The channel without gaps and instants outside the record, its noise still to come, and a warning or nothing."""
    values = measured.channels[name]
    given = np.isfinite(values)
    inside = given & (measured.time >= dataset.time[0]) & (measured.time <= dataset.time[-1] * (1.0 + 1e-9))
    span = f"{dataset.time[0] * 1e3:g} .. {dataset.time[-1] * 1e3:g} ms"
    if not inside.any():
        where = f'"{name}" in {measured.path}'
        raise MeasuredError(f"no point of {where} lies in the simulated record {span}; another clock or unit?")
    sigma = measured.sigma[name][inside] if name in measured.sigma else np.full(int(inside.sum()), np.nan)
    channel = Channel(name, measured.units[name], measured.time[inside], values[inside], sigma, "")
    after = int((given & (measured.time > dataset.time[-1] * (1.0 + 1e-9))).sum())
    before = int((given & (measured.time < dataset.time[0])).sum())
    if not after + before:
        return channel, ""
    return (
        channel,
        f"{name}: {before} points before and {after} after the simulated record {span} are left out of the fit",
    )


def _without(channel: Channel, marked: NDArray[np.bool_], why: str) -> tuple[Channel, str]:
    """The channel without the marked points, and a warning that names their instants; or as it is, and nothing."""
    if not marked.any():
        return channel, ""
    times = channel.times[marked]
    where = f"{times[0] * 1e3:.4g} ms" if len(times) == 1 else f"{times[0] * 1e3:.4g} .. {times[-1] * 1e3:.4g} ms"
    text = f"{channel.name}: {len(times)} points at {where} are {why} and are left out of the fit"
    kept = ~marked
    parts = {"times": channel.times[kept], "values": channel.values[kept], "noise": channel.noise[kept]}
    return replace(channel, **parts), text


def _with_noise(channel: Channel, measured: Measured, stated: float | None) -> tuple[Channel, str]:
    """The channel with its noise, and a warning where that had to be assumed."""
    if channel.name in measured.sigma:
        return replace(channel, noise_source="sigma column"), ""
    if stated is not None and stated > 0.0:
        return _uniform(channel, stated, "case"), ""
    quiet = measured.channels[channel.name][measured.time < 0.0]
    quiet = quiet[np.isfinite(quiet)]
    if len(quiet) >= FEWEST_BEFORE_CONTACT and np.std(quiet) > 0.0:
        return _uniform(channel, float(np.std(quiet, ddof=1)), "record before contact"), ""
    assumed = DEFAULT_NOISE * channel.peak
    size = quantity(assumed, channel.unit)
    text = f"{channel.name}: no noise is stated; {size} (1 % of the peak) is assumed, and the intervals rest on it"
    return _uniform(channel, assumed, "assumed"), text


def _uniform(channel: Channel, sigma: float, source: str) -> Channel:
    return replace(channel, noise=np.full(len(channel.times), sigma), noise_source=source)
