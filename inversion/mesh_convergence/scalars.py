"""Numbers of a simulation whose convergence is studied: peaks and their times, impulse."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from birdstrike.data.histories import Array, Histories, farthest, side_of
from birdstrike.solver.case.case import Case


@dataclass(frozen=True)
class Scalar:
    """One number read from one sensor's curve: its name, sensor and SI unit."""

    name: str
    sensor: str
    unit: str
    of: Callable[[Array, Array], float]

    def at(self, histories: Histories, like: Histories) -> float:
        """The number of a simulation, read on the side of 0 on which the sensor of another one swings farthest."""
        side = side_of(like.channels[self.sensor])
        number = self.of(histories.time, side * histories.channels[self.sensor])
        return number if self.of is peak_time else side * number

    def at_the_end(self, histories: Histories) -> bool:
        """Whether the number is a peak that the record cuts off."""
        values = histories.channels[self.sensor]
        return self.of is peak_value and bool(np.any(values)) and int(farthest(values)) == len(values) - 1


def scalars(case: Case) -> list[Scalar]:
    """Those that each kind of sensor names: impulse of a contact force, peak of a reaction, peak and its time else."""
    return [
        Scalar(f"{name}_{figure}", name, unit or sensor.unit, of)
        for name, sensor in case.sensors.items()
        for figure, (unit, of) in FIGURES.items()
        if figure in sensor.figures
    ]


def impulse(time: Array, force: Array) -> float:
    """Integral of the force [N] over the record [N s]."""
    return float(np.trapezoid(force, time))


def peak_value(time: Array, values: Array) -> float:
    """Largest reading above 0, between the samples by the parabola through the three around it."""
    return _peak(time, values)[1]


def peak_time(time: Array, values: Array) -> float:
    """Time of the largest reading [s], between the samples: else the output interval would pose as convergence."""
    return _peak(time, values)[0]


def _peak(time: Array, values: Array) -> tuple[float, float]:
    at = int(np.argmax(values))
    if not 0 < at < len(values) - 1:
        return float(time[at]), float(values[at])
    left, top, right = values[at - 1 : at + 2]
    bend = left - 2.0 * top + right
    shift = 0.5 * (left - right) / bend if bend else 0.0
    return float(time[at] + shift * (time[1] - time[0])), float(top - 0.25 * (left - right) * shift)


FIGURES: dict[str, tuple[str, Callable[[Array, Array], float]]] = {
    "impulse": ("N s", impulse),
    "peak": ("", peak_value),
    "peak_time": ("s", peak_time),
}
"""Figure of a sensor's curve -> its unit, empty for the sensor's own, and how it is read."""
