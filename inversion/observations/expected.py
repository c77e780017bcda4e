"""What a record is read for: the simulated record of a case or a campaign, and what either states of its sensors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from birdstrike.data.dataset import Dataset
from birdstrike.data.histories import Array
from birdstrike.inversion.observations.high_frequency import white_scatter
from birdstrike.solver.case.case import Case

ROUNDING = 1e-9  # of the record's end: an instant no later than that still lies in it
FARTHEST_ORIGIN = 4.0  # standard deviations by which the time origin may be off
LARGEST_SPARE = 0.25  # of the simulated record, kept free at its end for a clock that may be early
OWN_SHARE = 0.5
"""Of the variance between neighbours that may be the model's own before the noise cannot be read from it."""
AT_REST = 1e-4  # of a run's peak


def stated_noise(case: Case) -> dict[str, float]:
    """Sensor -> standard deviation that a case states of its readings, SI; those without one are left out."""
    return {name: sensor.noise for name, sensor in case.sensors.items() if sensor.noise}


def declared_drifts(case: Case) -> dict[str, float]:
    """Sensor -> drift of its instrument that the case states, SI a second."""
    return {name: own.drift for name, own in case.instrument.items() if own.drift}


@dataclass(frozen=True)
class Expected:
    """What is known of a record before it is read.

    units: sensor -> SI unit; start, end: of the simulated record [s], on the record's clock; rest_until: until
    when the plate is surely at rest [s]; noise: sensor -> standard deviation that the case states, SI; of: what has the
    sensors, in messages; spared: what the simulation covers beyond `end` [s]; runs: where simulations are at hand,
    their clock (m,) [s] and sensor -> curves (runs, m), SI: what scatters between neighbouring instants in them is no
    noise of the record; modelled: whether the record is to be compared with a model, which rings as the sensor does;
    drifts: sensor -> drift from the record's zero that the model has as well, SI a second.
    """

    units: Mapping[str, str]
    start: float
    end: float
    rest_until: float
    noise: Mapping[str, float] = field(default_factory=dict)
    of: str = "the case"
    spared: float = 0.0
    runs: tuple[Array, Mapping[str, Array]] | None = None
    modelled: bool = True
    drifts: Mapping[str, float] = field(default_factory=dict)

    @classmethod
    def of_case(cls, case: Case, end: float, spare: float = 0.0) -> Expected:
        """By a case simulated until `end` [s]; spare: by how much the clock may be late beyond its nuisance [s].

        The plate is at rest until contact less four standard deviations of the time origin.
        """
        uncertain = spare + FARTHEST_ORIGIN * case.inversion.nuisance.get("time_offset", 0.0)
        units = {name: sensor.unit for name, sensor in case.sensors.items()}
        return cls(
            units=units,
            start=0.0,
            end=end - spare,
            rest_until=case.first_contact - uncertain,
            noise=stated_noise(case),
            of=f"case {case.name}",
            drifts=declared_drifts(case),
        )

    @classmethod
    def of_campaign(cls, dataset: Dataset, noise: Mapping[str, float], time_offset: float = 0.0) -> Expected:
        """By a campaign's runs; time_offset: standard deviation of the time origin [s].

        The plate is at rest until the first curve of a run begins, less four standard deviations of the time origin.
        As much is spared at the end, at most a quarter of the record, so that the simulation still has a value for
        every point when the record's clock turns out to be early.
        """
        start, end = float(dataset.time[0]), float(dataset.time[-1])
        reach = FARTHEST_ORIGIN * time_offset
        spared = min(reach, LARGEST_SPARE * (end - start))
        return cls(
            units=dataset.channel_units,
            start=start,
            end=end - spared,
            rest_until=max(start, first_motion(dataset)) - reach,
            noise=noise,
            of="the campaign's case",
            spared=spared,
            runs=(dataset.time, dataset.curves),
            drifts=dataset.drifts,
        )

    def own_scatter(self, name: str, times: Array) -> float:
        """Standard deviation between neighbouring instants of the runs themselves, median of the runs, SI."""
        if self.runs is None or name not in self.runs[1]:
            return 0.0
        clock, curves = self.runs
        inside = times[(times >= clock[0]) & (times <= clock[-1])]
        scatters = [white_scatter(inside, np.interp(inside, clock, curve)) for curve in curves[name]]
        return float(np.median([0.0 if scatter is None else scatter[0] for scatter in scatters]))


def first_motion(dataset: Dataset) -> float:
    """The last instant at which no run has moved any sensor yet [s]."""
    first = len(dataset.time) - 1
    for curves in dataset.curves.values():
        peaks = np.abs(curves).max(axis=1, keepdims=True)
        moving = np.flatnonzero((np.abs(curves) > AT_REST * np.maximum(peaks, 1e-300)).any(axis=0))
        first = min(first, *(int(i) for i in moving[:1]), len(dataset.time) - 1)
    return float(dataset.time[max(first - 1, 0)])
