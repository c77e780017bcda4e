"""The zero of a record's clock, by the instant at which its response begins: a simulation of the shot shows it too."""

from __future__ import annotations

import numpy as np
from scipy.signal import medfilt

from birdstrike.data.curves import Measured
from birdstrike.data.histories import Array, Histories
from birdstrike.inversion.observations.raw import rest_until

RISEN = 0.1
"""Share of the first large reading: below it noise and drift would decide, above it the bird's constants."""

FILTER = 5  # points whose median is taken: single spikes begin no response


def crossing(time: Array, values: Array, rest: float) -> float:
    """Instant [s] at which a curve has risen to a tenth of its largest size; rest: until when it reads nothing [s]."""
    before = values[time <= rest]
    smooth = medfilt(values, FILTER) if len(values) > 4 * FILTER else values
    size = np.abs(smooth - (float(before.mean()) if len(before) > 1 else 0.0))
    risen = int(np.argmax(size >= RISEN * size.max()))
    if risen == 0:
        return float(time[0])
    low, high = size[risen - 1], size[risen]
    share = (RISEN * size.max() - low) / (high - low)
    return float(time[risen - 1] + share * (time[risen] - time[risen - 1]))


def response_begins(measured: Measured, channel: str) -> float:
    """Instant [s] on the record's clock at which a channel has risen to a tenth."""
    time, values = measured.points(channel)
    rest = rest_until(measured)
    return crossing(time, values, rest if rest > measured.time[0] else float(time[0]) - 1.0)


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
    begins = response_begins(measured, channel)
    part = time <= begins + until - simulated
    rest = rest_until(measured)
    first = crossing(time[part], values[part], rest if rest > measured.time[0] else float(time[0]) - 1.0)
    return simulated - first
