"""Models made again for other data: another record, fewer points, another noise; the solver's corrections go along.

A strike tells what the solver adds to emulator and learnt responses at one place; near that place it stays true, so
that no strike is paid again for every draw of the noise.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np
from birdstrike.inversion.diagnosis.covariance import Whitener
from birdstrike.inversion.diagnosis.judge import MOVED, Judge, Judged
from birdstrike.inversion.diagnosis.record import Record, averaged
from birdstrike.inversion.diagnosis.strikes import Strikes
from scipy.linalg import solve_triangular

from birdstrike.data.histories import Array
from birdstrike.inversion.audit.experiment import Truth
from birdstrike.inversion.diagnosis.ranking import Fit, Problem, again

Models = Mapping[str, Judged]


def struck(one: Judged) -> bool:
    """Whether the solver has corrected the model."""
    return np.ndim(one.fit.problem.model.correction) > 0


def without_noise(record: Record, truth: Truth) -> Record:
    """The record's own points, as the noise-free truth has them."""
    return replace(record, traces=tuple(replace(one, values=values) for one, values in _clean(record, truth)))


def _clean(record: Record, truth: Truth) -> Iterator[tuple]:
    for one in record.traces:
        yield one, averaged(np.interp(one.times, truth.time, truth.channels[one.name]), one.block)


def of_record(judge: Judge, models: Models, record: Record) -> dict[str, Judged]:
    """For a record on the same points, with the same noise."""
    return {name: _again(judge, one, recorded(one.fit.problem, record)) for name, one in models.items()}


def of_part(judge: Judge, models: Models) -> dict[str, Judged]:
    """For the points that `judge` uses."""
    return {
        name: _again(judge, one, replace(one.fit.problem, whitener=part(one.fit.problem.whitener, judge.used)))
        for name, one in models.items()
    }


def confirmed_where_moved(judge: Judge, before: Models, after: Models, strikes: Strikes) -> dict[str, Judged]:
    """`after`, those struck asked of the solver once more whose curve lies far from where it was struck."""
    moved = [one for name, one in after.items() if struck(one) and distance(before[name].fit, one.fit) > MOVED]
    return {**after, **(judge.confirm(moved, strikes) if moved else {})}


def distance(before: Fit, after: Fit) -> float:
    """RMS by which the curve moved between two fits, in its own standard deviations."""
    model = after.problem.model
    change = model.points(after.place, after.box) - model.points(before.place, before.box)
    return float(np.sqrt(np.mean(after.problem.whitener.apply(change[0]) ** 2)))


def recorded(problem: Problem, record: Record) -> Problem:
    """The problem with another record."""
    return replace(problem, model=replace(problem.model, record=record))


def covariance_of(whitener: Whitener) -> Array:
    """Sigma (used, used) of a whitener: W = L^-1, Sigma = L L^T."""
    lower = solve_triangular(whitener.inverse, np.eye(len(whitener.inverse)), lower=True)
    return lower @ lower.T


def part(whitener: Whitener, used: np.ndarray) -> Whitener:
    """Of some of the points of one that counts all."""
    return Whitener.of(covariance_of(whitener), used)


def _again(judge: Judge, one: Judged, problem: Problem) -> Judged:
    return judge.judged(one.name, again(one.fit, problem), one.confirmed, one.doubt)
