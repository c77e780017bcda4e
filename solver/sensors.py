"""Sensors: what is read at every step, and its resampling to the user's clock without aliasing."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from data.histories import Array
from solver.case_settings import Sensor
from solver.kernels.contact import bilinear
from solver.plate import Plate

if TYPE_CHECKING:
    from solver.strike import Strike


def nodes_at(plate: Plate, at: tuple[float, float]) -> tuple[NDArray[np.int64], Array]:
    """The four nodes and shape functions of the undeformed point `at` [m] from the plate's centre."""
    corners = plate.mesh.surface[plate.quads]
    low, high = corners.min(axis=1), corners.max(axis=1)
    outside = np.maximum(np.maximum(low - at, at - high), 0.0).sum(axis=1)
    element = int(np.argmin(outside))
    xi, eta = np.clip(2.0 * (at - low[element]) / (high[element] - low[element]) - 1.0, -1.0, 1.0)
    return plate.quads[element], np.array(bilinear(xi, eta))


def gauge(sensor: Sensor, strike: Strike) -> Callable[[Strike], float]:
    """Reading of one sensor from the present state; displacement [m] and forces [N] are positive in the push."""
    if sensor.kind == "contact_force":
        return lambda now: now.push
    if sensor.kind == "reaction_force":
        return lambda now: -float(now.reaction[2])
    nodes, shape = nodes_at(strike.plate, sensor.at)
    rest = strike.plate.x[nodes, 2].copy()
    return lambda now: float(shape @ (rest - now.plate.x[nodes, 2]))


class Recorder:
    """Per-step readings; the push is towards -z, and displacement and forces are positive in the push."""

    def __init__(self, strike: Strike, sensors: Mapping[str, Sensor], steps: int) -> None:
        self.kinds = {name: sensor.kind for name, sensor in sensors.items()}
        self.time = np.zeros(steps + 1)
        self.readings = {name: np.zeros(steps + 1) for name in sensors}
        self.gauges = {name: gauge(sensor, strike) for name, sensor in sensors.items()}

    def read(self, strike: Strike) -> None:
        """Take all readings of the present step."""
        self.time[strike.step] = strike.time
        for name, read in self.gauges.items():
            self.readings[name][strike.step] = read(strike)

    def sampled(self, clock: Array) -> dict[str, Array]:
        """Channels on the user's clock [s]: displacements interpolated, forces as means over the sampling interval."""
        return {
            name: np.interp(clock, self.time, values)
            if self.kinds[name] == "displacement"
            else mean_over_interval(clock, self.time, values)
            for name, values in self.readings.items()
        }


def mean_over_interval(clock: Array, time: Array, force: Array) -> Array:
    """Mean force over each sampling interval centred on the clock, from the impulse: no impulse is lost or aliased."""
    impulse = np.concatenate([[0.0], np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(time))])
    half = 0.5 * (clock[1] - clock[0])
    early, late = np.clip(clock - half, 0.0, time[-1]), np.clip(clock + half, 0.0, time[-1])
    return (np.interp(late, time, impulse) - np.interp(early, time, impulse)) / (late - early)
