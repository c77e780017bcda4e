"""The record as a diagnosis reads it: points in the model's window, and the noise before and beside the strike."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from birdstrike.data.curves import Measured
from birdstrike.data.errors import MeasuredError
from birdstrike.data.histories import Array
from birdstrike.inversion.diagnosis_v2.noise import Noise, noise_of
from birdstrike.inversion.formatting import quantity

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


@dataclass(frozen=True)
class Window:
    """What of a record is used: instants in start..end [s]; quiet: until when the plate is surely at rest [s]."""

    start: float
    end: float
    quiet: float


def read_record(
    measured: Measured,
    units: dict[str, str],
    window: Window,
    stated: dict[str, float],
    tolerance: float | None = None,
    say: Callable[[str], None] = lambda _: None,
) -> Record:
    """The record's channels that the model has; stated: noise by the case, SI.

    tolerance: noise as a share of the peak where none is known. Raises MeasuredError for an unknown channel, another
    unit, or a channel with fewer than three points in the window.
    """
    measured.refuse_dead_sensors()
    errors = [error for name in measured.channels for error in _mismatch(measured, units, name)]
    if errors:
        raise MeasuredError(errors)
    most = max(MOST_POINTS // len(measured.channels), FEWEST_POINTS)
    warnings: list[str] = []
    traces = tuple(
        _trace(measured, name, window, stated.get(name), tolerance, most, warnings) for name in units_of(measured)
    )
    for warning in warnings:
        say(warning)
    return Record(traces, tuple(warnings))


def units_of(measured: Measured) -> Sequence[str]:
    """Channels in the file's order."""
    return tuple(measured.channels)


def _mismatch(measured: Measured, units: dict[str, str], name: str) -> list[str]:
    if name not in units:
        return [f'measured channel "{name}" in {measured.path} is no sensor of the case; sensors: {", ".join(units)}']
    if measured.units[name] != units[name]:
        have, want = measured.units[name] or "no unit", units[name] or "no unit"
        return [f'measured channel "{name}" in {measured.path} has unit {have}, the sensor {want}']
    return []


def _trace(
    measured: Measured,
    name: str,
    window: Window,
    stated: float | None,
    tolerance: float | None,
    most: int,
    warnings: list[str],
) -> Trace:
    times, values = measured.points(name)
    sigma = measured.sigma[name][np.isfinite(measured.channels[name])] if name in measured.sigma else None
    noise, said = noise_of(name, measured.units[name], times, values, sigma, stated, window.quiet, tolerance)
    inside = (times >= window.start) & (times <= window.end * (1.0 + 1e-12))
    inside &= ~_outliers(times, values, noise.level, inside, name, measured.units[name], warnings)
    count = int(inside.sum())
    if count < FEWEST_POINTS:
        span = f"{window.start * 1e3:g} .. {window.end * 1e3:g} ms"
        raise MeasuredError(f'"{name}" in {measured.path} has {count} points in the simulated record {span}')
    warnings += said
    block = -(-count // most)
    kept = np.flatnonzero(inside)[: count - count % block]
    peak = float(np.abs(values[inside]).max())
    return Trace(name, measured.units[name], times[kept], block, averaged(values[kept], block), noise.at(kept), peak)


def _outliers(
    times: Array, values: Array, sigma: float, inside: np.ndarray, name: str, unit: str, warnings: list[str]
) -> np.ndarray:
    """Single points that leave the line between their neighbours by 6 standard deviations, where neighbours agree."""
    found = np.zeros(len(values), dtype=bool)
    if len(values) < 20 or np.ptp(np.diff(times)) > 0.5 * np.median(np.diff(times)):
        return found
    near = np.stack([np.roll(values, k) for k in (-2, -1, 1, 2)])
    middle, spread = np.median(near, axis=0), np.ptp(near, axis=0)
    found[2:-2] = (np.abs(values - middle) > np.maximum(6.0 * sigma, 2.0 * spread))[2:-2]
    if (found & inside).any():
        off = quantity(float(np.abs(values - middle)[found].max()), unit, 2)
        warnings.append(
            f"{name}: {int((found & inside).sum())} single points up to {off} off their neighbours left out"
        )
    return found
