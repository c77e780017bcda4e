"""What a diagnosis needs of a case before it sees a record: emulator, responses to effects, numerical error."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from birdstrike.data.dataset import Dataset
from birdstrike.data.errors import RunFailed, UserError
from birdstrike.data.histories import Array, Histories
from birdstrike.inversion.diagnosis.finer import CHOICES, choices, elsewhere, pairs
from birdstrike.inversion.diagnosis.model import NUISANCE_EFFECT, Clock, Model, Place
from birdstrike.inversion.diagnosis.numerical import Numerical
from birdstrike.inversion.diagnosis.point_error import PointError
from birdstrike.inversion.diagnosis.probes import with_probes
from birdstrike.inversion.diagnosis.record import Record
from birdstrike.inversion.diagnosis.responses import Known, Response, cases_of, learn, library, pooled
from birdstrike.inversion.diagnosis.strikes import Strikes
from birdstrike.inversion.estimation.coordinates import Box, Coordinates, parameter_coordinates
from birdstrike.solver.case.case import Case
from birdstrike.surrogate.emulator import Emulator, fit_emulator

CENTRE, DECLARED = "campaign's centre", "as declared beside "


@dataclass(frozen=True)
class Groundwork:
    """A case made ready.

    probed: the case with the sensors that a next measurement could have; theta: the campaign's centre by dotted key;
    runs: strikes at the centre, and those of the numerical error, by label; refused: effects that the case cannot
    carry, and why.
    """

    case: Case
    probed: Case
    dataset: Dataset
    emulator: Emulator
    coordinates: Coordinates
    clock: Clock
    known: tuple[Known, ...]
    refused: Mapping[str, str]
    responses: Mapping[str, Response]
    numerical: Numerical
    theta: Mapping[str, float]
    runs: Mapping[str, Histories]

    def model(self, record: Record) -> Model:
        """The model on a record's points."""
        parts = (self.case, self.clock, self.emulator, self.coordinates, self.known, self.responses)
        return Model(*parts, record, self.numerical.finer)

    def numerical_of(self, channels: Sequence[str]) -> Numerical:
        """The numerical error of any channels of the probed case."""
        return _numerical(self.runs, replace(self.clock, channels=tuple(channels)), {})

    def nuisances(self) -> tuple[tuple[int, float], ...]:
        """(index of the effect, sigma in its plausible sizes) of the case's nuisances."""
        names = [known.name for known in self.known]
        stated = {NUISANCE_EFFECT[n]: sigma for n, sigma in self.case.inversion.nuisance.items() if sigma > 0.0}
        missing = [name for name in stated if name not in names]
        if missing:
            raise UserError([f"the case cannot carry its nuisance {name}: {self.refused[name]}" for name in missing])
        return tuple((names.index(n), sigma / self.known[names.index(n)].size) for n, sigma in stated.items())


def prepare(
    case: Case, dataset: Dataset, channels: tuple[str, ...], strikes: Strikes, progress: Callable[[float], None]
) -> Groundwork:
    """Fit the emulator of the channels and run the strikes that teach responses and numerical error.

    Raises UserError where the campaign is too small and RunFailed when the strike at the campaign's centre fails.
    """
    emulator = fit_emulator(dataset, channels, progress=progress)
    coordinates = parameter_coordinates(dataset, emulator.regions)
    clock = Clock(dataset.time, channels)
    probed = with_probes(case)
    known, refused = library(case)
    theta = centre(dataset, coordinates)
    base, others = probed.with_values(theta), elsewhere(probed, coordinates)
    cases = {CENTRE: base, **others} | cases_of(base, list(others.values()), known) | choices(probed, theta)
    finer = pairs(probed, coordinates)
    for name, pair in finer.items():
        cases |= {f"{DECLARED}{name}": pair.declared, name: pair.finer}
    runs = strikes.run(cases)
    if CENTRE not in runs:
        raise RunFailed(f"the strike at the campaign's centre failed: {strikes.failures[CENTRE]}", "check the case")
    bases = [clock.stack(runs[name]) if name in runs else None for name in others]
    shapes = {name: _smooth(emulator, clock, pair.theta) for name, pair in finer.items()}
    numerical = _numerical(runs, clock, shapes)
    jitter = scatter(emulator, numerical, channels)
    learnt = {
        one.name: learn(one, clock.stack(runs[CENTRE]), bases, runs, clock.stack, jitter)
        for one in known
        if not one.of_record
    }
    responses = pooled({name: one for name, one in learnt.items() if one is not None}, len(channels))
    kept = tuple(one for one in known if one.of_record or one.name in responses)
    lost = {name: "its strikes failed" for name, response in learnt.items() if response is None}
    return Groundwork(
        case,
        probed,
        dataset,
        emulator,
        coordinates,
        clock,
        kept,
        {**refused, **lost},
        responses,
        numerical,
        theta,
        runs,
    )


def _numerical(runs: Mapping[str, Histories], clock: Clock, shapes: Mapping[str, Array]) -> Numerical:
    """From the strikes at hand; shapes: the draws' declared curves without what a strike has of its own, if known."""
    declared = {name: clock.stack(runs[f"{DECLARED}{name}"]) for name in runs if f"{DECLARED}{name}" in runs}
    changes = [clock.stack(runs[name]) - curve for name, curve in declared.items()]
    base, grid = clock.stack(runs[CENTRE]), len(clock.channels) * len(clock.time)
    return Numerical(
        np.array([shapes.get(name, curve) for name, curve in declared.items()]).reshape(-1, grid),
        np.array(changes).reshape(-1, grid),
        {name: clock.stack(runs[name]) - base for name in CHOICES if name in runs},
        len(clock.channels),
        float(clock.time[1] - clock.time[0]),
    )


def _smooth(emulator: Emulator, clock: Clock, theta: Array) -> Array:
    """(grid,) the emulator's curves at theta (k,)."""
    u = emulator.inputs(theta[None])
    return np.concatenate([emulator.channels[c].curves(u, clock.time)[0] for c in clock.channels])


def scatter(emulator: Emulator, numerical: Numerical, channels: tuple[str, ...]) -> tuple[float, ...]:
    """RMS per channel by which a strike leaves what is smooth in parameters and effects: as runs or lattices do."""
    rough = [emulator.channels[c].rough() for c in channels]
    return tuple(float(np.sqrt(max(pair))) for pair in zip(rough, numerical.scatter, strict=True))


def centre(dataset: Dataset, coordinates: Coordinates) -> dict[str, float]:
    """Middle of the largest box in which runs stand, by dotted key, SI."""
    box = max(coordinates.boxes, key=lambda b: float(np.prod(b.highs - b.lows)))
    theta = coordinates.theta((0.5 * (box.lows + box.highs))[None], box)[0]
    return {name: float(value) for name, value in zip(dataset.names, theta, strict=True)}


def numerical_error(numerical: Numerical, error: PointError) -> Callable[[Model, Place, Box], Array]:
    """(n, n) covariance of the numerical error on the record's points, as a function of where a model stands.

    Gain and shift act on the model's own curve; they and the rest go through its instrument.
    """

    def covariance(there: Model, place: Place, box: Box) -> Array:
        b = place.b[0]
        frame = there.through(numerical.frame(there.grid(place, box)[0]), b)
        read = numerical.through(error, lambda rows: there.through(rows, b)) if there.moved(b) else error
        return read.at(frame)

    return covariance


def middle(box: Box) -> Array:
    """(r,) the box's middle."""
    return 0.5 * (box.lows + box.highs)
