"""The zero of a record's clock, by the instant at which its response begins: a simulation of the shot shows it too."""

from __future__ import annotations

import numpy as np
from scipy.signal import medfilt, savgol_filter

from birdstrike.data.curves import Measured
from birdstrike.data.histories import Array, Histories
from birdstrike.inversion.observations.baseline import baseline_of
from birdstrike.inversion.observations.before_contact import FEWEST_FOR_TEST, BeforeContact
from birdstrike.inversion.observations.raw import rest_until

RISEN = 0.1
"""Share of the largest reading: below it noise and drift would decide, above it the bird's constants."""

SURE = 0.5
"""Share of the largest reading that neither noise nor drift reaches: the response has begun before that."""

STEEP = 0.75
FOOT = 4.0
"""So many times the time from SURE to STEEP before SURE, the response has not begun: 3 for a cosine, 1 for a ramp."""

SPIKES = 5  # points whose median is taken: single spikes begin no response
QUIET = 0.01  # of the largest reading: scatter that smoothing leaves
EXACT = 1e-6  # of the record's range: scatter of one that has no noise
PARABOLA = 2.25  # variance of the middle of a parabola through n points, times n over that of a point


def crossing(time: Array, values: Array, rest: float) -> float:
    """Instant [s] at which a curve has risen to a tenth of its largest size.

    rest: until when it surely reads nothing but its reading at rest [s]; the first instant or earlier: not known.
    """
    sound = medfilt(values, SPIKES) if len(values) > 4 * SPIKES else values
    rest = max(rest, _before_rise(time, sound))
    at_rest, scatter = _at_rest(time, values, rest)
    curve = sound - at_rest
    largest = float(np.abs(curve).max())
    rising = int(np.count_nonzero((time > rest) & (time <= time[_first(np.abs(curve), SURE)])))
    curve = _smoothed(curve, scatter / largest if largest else 0.0, rising)
    sure = _first(np.abs(curve), SURE)
    return _last_rise(time, np.sign(curve[sure]) * curve, sure)


def _first(size: Array, share: float) -> int:
    """Index of the first point at a share of the largest."""
    return int(np.argmax(size >= share * size.max()))


def _before_rise(time: Array, values: Array) -> float:
    """An instant [s] at which the response has not begun, by how steep it becomes."""
    size = np.abs(values - np.median(values[:SPIKES]))
    sure, steep = (float(time[_first(size, share)]) for share in (SURE, STEEP))
    return sure - FOOT * (steep - sure)


def _at_rest(time: Array, values: Array, rest: float) -> tuple[Array | float, float]:
    """Reading at rest (n,) by the record until `rest` [s], and its scatter about that; 0 where that is too short."""
    early = time <= rest
    if np.count_nonzero(early) < SPIKES:
        return 0.0, 0.0
    size = float(np.ptp(values))
    found = BeforeContact.of(time[early], values[early], size, float(time[-1]) - rest)
    baseline = None
    if len(found.times) >= FEWEST_FOR_TEST and not found.moves:
        worth = (found.level or EXACT * size) ** 2 * found.correlation.of_mean
        baseline = baseline_of(found.times, found.values, worth, found.hum)
    reading = float(np.median(values[early])) if baseline is None else baseline.at(time)
    return reading, found.level or 0.0


def _smoothed(curve: Array, scatter: float, most: int) -> Array:
    """The curve by parabolas through as many points as leave little of its scatter, at most `most`.

    scatter: standard deviation as a share of the largest reading.
    """
    wanted = int(PARABOLA * (scatter / QUIET) ** 2)
    points = min(wanted, most, len(curve)) // 2 * 2 - 1
    return np.asarray(savgol_filter(curve, points, 2), dtype=np.float64) if points >= SPIKES else curve


def _last_rise(time: Array, curve: Array, sure: int) -> float:
    """Instant [s] at which the curve last rises to a tenth of its largest size before the point `sure`."""
    level = RISEN * float(np.abs(curve).max())
    below = np.flatnonzero(curve[:sure] < level)
    if not len(below):
        return float(time[0])
    low = int(below[-1])
    share = (level - curve[low]) / (curve[low + 1] - curve[low])
    return float(time[low] + share * (time[low + 1] - time[low]))


def response_begins(measured: Measured, channel: str) -> float:
    """Instant [s] on the record's clock at which a channel has risen to a tenth."""
    time, values = measured.points(channel)
    return crossing(time, values, _rest(measured))


def _rest(measured: Measured) -> float:
    """Until when the record is surely at rest [s]; before its first instant where that is not known."""
    rest = rest_until(measured)
    return rest if rest > measured.time[0] else float(measured.time[0]) - 1.0


def duration(measured: Measured) -> float:
    """Time [s] from the beginning of the response to the end of the record."""
    channel = next(iter(measured.channels))
    return float(measured.time[-1]) - response_begins(measured, channel) + 0.3e-3


def shift_to(histories: Histories, measured: Measured, until: float) -> float:
    """What must be added to the record's clock [s], so that its response begins when the simulation's does.

    until: of the simulation's clock [s]; the record is compared over as much of its response.
    """
    channel = next(name for name in measured.channels if name in histories.channels)
    seen = histories.time <= until
    simulated = crossing(histories.time[seen], histories.channels[channel][seen], -1.0)
    time, values = measured.points(channel)
    part = time <= response_begins(measured, channel) + until - simulated
    return simulated - crossing(time[part], values[part], _rest(measured))
