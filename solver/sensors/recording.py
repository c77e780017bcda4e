"""Sensors on the user's clock: what is read at every step, what the instruments make of it, and its sampling."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Protocol

import numpy as np

from birdstrike.data.errors import UserError
from birdstrike.data.histories import Array
from birdstrike.solver.sensors.instrument import Instrument, recorded
from birdstrike.solver.sensors.sensor import Reading, Run, Sensor, deformable

if TYPE_CHECKING:  # the type brings in the compiled kernels, which loading a case has no use for
    from birdstrike.solver.target.mesh import ShellMesh


class Stepped(Run, Protocol):
    """The running state and how far it is; time: [s]."""

    @property
    def step(self) -> int:
        """Number of steps taken."""
        ...

    @property
    def time(self) -> float:
        """[s]."""
        ...


class Recorder:
    """Readings of every step; displacements and forces are positive in the push, towards -z.

    An instrument acts on the readings of every step, before they are sampled, each kind of sensor in its own way.
    """

    def __init__(self, run: Stepped, sensors: Mapping[str, Sensor], steps: int) -> None:
        refuse_misplaced(sensors, run.plate.mesh)
        self.sensors = dict(sensors)
        self.time = np.zeros(steps + 1)
        self.values = {name: np.zeros(steps + 1) for name in sensors}
        self.readings = readings(self.sensors, run)

    def read(self, run: Stepped) -> None:
        """Take all readings of the present step."""
        self.time[run.step] = run.time
        for name, reading in self.readings.items():
            self.values[name][run.step] = reading(run)

    def sampled(self, clock: Array, instruments: Mapping[str, Instrument] | None = None) -> dict[str, Array]:
        """Channels on the user's clock [s], as the instruments give them."""
        behind = instruments or {}
        return {
            name: self.sensors[name].sampled(clock, self.time, recorded(behind.get(name), self.time, values))
            for name, values in self.values.items()
        }


def refuse_misplaced(sensors: Mapping[str, Sensor], mesh: ShellMesh, causes: Iterable[str] = ()) -> None:
    """Raise UserError where sensors do not lie on these shells at rest; causes: what is said before them."""
    wrong = [text for name, sensor in sensors.items() for text in sensor.misplaced(name, mesh)]
    if wrong:
        raise UserError(dict.fromkeys([*causes, *wrong]))


def readings(sensors: Mapping[str, Sensor], run: Run) -> dict[str, Reading]:
    """Reading functions by sensor; the plate sums the strain increments of the elements that any of them feels."""
    felt = [elements for sensor in sensors.values() if len(elements := sensor.elements(run))]
    if felt:
        deformable(run).watch(np.unique(np.concatenate(felt)))
    return {name: sensor.reading(run) for name, sensor in sensors.items()}


def remarks_on_sensors(sensors: Mapping[str, Sensor], run: Run) -> list[str]:
    """What the user should know of the readings of a finished run."""
    return [remark for name, sensor in sensors.items() for remark in sensor.remarks(name, run)]
