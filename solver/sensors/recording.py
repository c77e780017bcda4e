"""Sensors on the user's clock: what is read at every step, what the instruments make of it, and its sampling."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.solver.case.sensors import Instrument, Sensor
from birdstrike.solver.sensors.gauges import gauges
from birdstrike.solver.sensors.instrument import recorded

if TYPE_CHECKING:
    from birdstrike.solver.coupling import Strike


class Recorder:
    """Readings of every step; the push is towards -z (see `gauges` for the signs).

    On the user's clock a displacement is the reading at the instant: the plate's inertia has limited its band. Strain,
    forces and pressure are means over the sampling interval around the instant. What oscillates at a multiple of the
    sampling rate, and would otherwise come back as a slow wave that is not there, leaves nothing; no impulse is lost.
    An instrument acts on the readings of every step, before they are sampled.
    """

    def __init__(self, strike: Strike, sensors: Mapping[str, Sensor], steps: int) -> None:
        self.kinds = {name: sensor.kind for name, sensor in sensors.items()}
        self.time = np.zeros(steps + 1)
        self.readings = {name: np.zeros(steps + 1) for name in sensors}
        self.gauges = gauges(dict(sensors), strike)

    def read(self, strike: Strike) -> None:
        """Take all readings of the present step."""
        self.time[strike.step] = strike.time
        for name, read in self.gauges.items():
            self.readings[name][strike.step] = read(strike)

    def sampled(self, clock: Array, instruments: Mapping[str, Instrument] | None = None) -> dict[str, Array]:
        """Channels on the user's clock [s], as the instruments give them."""
        behind = instruments or {}
        return {
            name: sample(self.kinds[name], clock, self.time, recorded(behind.get(name), self.time, values))
            for name, values in self.readings.items()
        }


def sample(kind: str, clock: Array, time: Array, values: Array) -> Array:
    """A channel on the clock [s]: displacements interpolated, all others as means over the sampling interval."""
    return np.interp(clock, time, values) if kind == "displacement" else mean_over_interval(clock, time, values)


def mean_over_interval(clock: Array, time: Array, values: Array) -> Array:
    """Mean over each sampling interval centred on the clock, from the integral: no impulse is lost or aliased."""
    integral = np.concatenate([[0.0], np.cumsum(0.5 * (values[1:] + values[:-1]) * np.diff(time))])
    half = 0.5 * (clock[1] - clock[0])
    early, late = np.clip(clock - half, 0.0, time[-1]), np.clip(clock + half, 0.0, time[-1])
    return (np.interp(late, time, integral) - np.interp(early, time, integral)) / (late - early)
