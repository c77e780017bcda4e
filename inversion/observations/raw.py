"""A record by itself, before any case: how long it is at rest, what its sensors read there, what is odd in it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from birdstrike.data.curves import Measured
from birdstrike.data.errors import MeasuredError
from birdstrike.data.formatting import reading
from birdstrike.data.histories import Array
from birdstrike.inversion.observations.before_contact import FEWEST_FOR_LEVEL
from birdstrike.inversion.observations.expected import Expected
from birdstrike.inversion.observations.reader import ChannelRecord, read_record

BEGINNING = 20  # points from which the scatter at rest is taken
MEAN = 5  # points whose mean leaves the rest
LEAVES = 8.0  # standard deviations of that mean
MOVES = 0.05  # of the record's range: a beginning that changes by more is no rest
SPARE = 0.9  # of the time until the response is seen: it begins before that

_EXAMPLES = {"m": "0.05 mm", "N": "0.1 kN", "Pa": "0.05 MPa", "": "20 um/m"}
"""SI unit of a channel -> a noise for messages."""


def read_raw(measured: Measured) -> tuple[ChannelRecord, ...]:
    """The channels as the reader of calibrations would take them, the whole record long and without a case."""
    first, last = float(measured.time[0]), float(measured.time[-1])
    alone = Expected(measured.units, first, last, rest_until(measured), of="the file", modelled=False)
    return read_record(measured, alone)


def rest_until(measured: Measured) -> float:
    """The instant until which no channel has left its rest [s], a tenth of it spared; the first where none rests."""
    return min(_leaves_rest(*measured.points(name)) for name in measured.channels)


def _leaves_rest(times: Array, values: Array) -> float:
    """Of one channel: the first mean of five points that its scatter so far does not explain."""
    first = float(times[0]) if len(times) else 0.0
    if len(times) < BEGINNING + MEAN:
        return first
    means = np.convolve(values, np.full(MEAN, 1.0 / MEAN), "valid")
    if abs(means[BEGINNING - MEAN] - means[0]) > MOVES * float(np.ptp(values)):
        return first
    at = BEGINNING
    while at < len(means):
        rest = values[:at]
        spread = max(float(rest.std()), 1e-12 * float(np.abs(values).max())) / np.sqrt(MEAN)
        ahead = np.abs(means[at : 2 * at] - rest.mean()) > LEAVES * spread
        if ahead.any():
            return first + SPARE * (float(times[at + int(np.argmax(ahead))]) - first)
        at *= 2
    return first  # it never leaves: no rest that a response would end


def zeroed(measured: Measured) -> tuple[Measured, dict[str, float]]:
    """The record less every channel's mean before the response, and these means, SI; raises MeasuredError."""
    until = rest_until(measured)
    offsets = {name: _mean(measured, name, until) for name in measured.channels}
    notes = tuple(
        f"{name}: {reading(offset, measured.units[name], 6)}, the mean before {1e3 * until:.4g} ms, was subtracted."
        for name, offset in offsets.items()
    )
    channels = {name: values - offsets[name] for name, values in measured.channels.items()}
    return replace(measured, channels=channels, provenance=(*measured.provenance, *notes)), offsets


def _mean(measured: Measured, name: str, until: float) -> float:
    times, values = measured.points(name)
    rest = values[times < until]
    if len(rest) < FEWEST_FOR_LEVEL:
        raise MeasuredError(
            f"--zero: {name} in {measured.path} has {len(rest)} points at rest before its response and needs "
            f"{FEWEST_FOR_LEVEL}; record some time before contact, or subtract what the sensor reads at rest yourself"
        )
    return float(rest.mean())


def with_sigma(measured: Measured, stated: Mapping[str, float | None]) -> Measured:
    """The record with sigma columns: of each channel the standard deviation stated, SI, or, for None, its own.

    Raises MeasuredError for one that is not above 0, and for a record that gives none.
    """
    found = {one.name: one.noise for one in read_raw(measured)}
    sigma = dict(measured.sigma)
    for name, value in stated.items():
        example = _EXAMPLES.get(measured.units[name], f"1 {measured.units[name]}")
        if value is not None and not value > 0.0:
            raise MeasuredError(f'--sigma {name}: a standard deviation is above 0, such as --sigma {name}="{example}"')
        if value is None and not found[name].known:
            raise MeasuredError(
                f"--sigma record: {name} in {measured.path} gives no estimate of its noise: fewer than "
                f"{FEWEST_FOR_LEVEL} points before its response, and no white noise between neighbours, where only a "
                f'displacement can show it; state it: --sigma {name}="{example}"'
            )
        level = found[name].level if value is None else value
        sigma[name] = np.where(np.isfinite(measured.channels[name]), level, np.nan)
    return replace(measured, sigma=sigma)
