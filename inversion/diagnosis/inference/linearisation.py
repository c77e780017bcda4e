"""The shots at the places about which the system is linear: curves, Jacobians, and what effects change there."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.inversion.diagnosis.inference.hypotheses import CandidateEffect
from birdstrike.inversion.diagnosis.preparation.discrepancy import alike
from birdstrike.inversion.diagnosis.preparation.shots import (
    TIME_OFFSET,
    InstrumentEffect,
    Shot,
    instrument_effects,
    responses_of,
)
from birdstrike.inversion.estimation.prior import NormalPrior

UNSEEN_SHARE = 1e-6  # of the peak: a signature below it moves no sensor of that kind


@dataclass(frozen=True)
class Places:
    """Where the system is linearised. z: shot -> (k,) fractions of the ranges; h: effect's label -> size."""

    z: Mapping[str, Array]
    h: Mapping[str, float]


@dataclass(frozen=True)
class Linearisation:
    """All shots at the places about which the system is linear, each with its curves there."""

    shots: Sequence[Shot]
    places: Places

    @cached_property
    def z(self) -> list[Array]:
        """(k,) of each shot."""
        return [self.places.z[shot.name] for shot in self.shots]

    @cached_property
    def grids(self) -> list[Array]:
        """(grid,) curves of each shot."""
        return [shot.setup.grid(own[None])[0] for shot, own in zip(self.shots, self.z, strict=True)]

    @cached_property
    def means(self) -> list[Array]:
        """(n,) those at each record's points."""
        return [shot.sample(grid[None])[0] for shot, grid in zip(self.shots, self.grids, strict=True)]

    @cached_property
    def unnamed(self) -> list[dict[str, InstrumentEffect | None]]:
        """Of each shot the small errors that it can have: label -> the fault; None of an effect of the solver."""
        found: list[dict[str, InstrumentEffect | None]] = []
        for shot in self.shots:
            faults = instrument_effects(shot.setup.plan.case, shot.setup.channels)
            own: dict[str, InstrumentEffect | None] = dict.fromkeys(shot.setup.responses)
            found.append(own | {one.label: one for one in faults if len(one.sensors) == 1 or one.label == TIME_OFFSET})
        return found

    @property
    def unnamed_labels(self) -> tuple[str, ...]:
        """All of them: effects of the solver, then faults."""
        return tuple(dict.fromkeys([*responses_of(self.shots), *(label for own in self.unnamed for label in own)]))

    @cached_property
    def priors(self) -> dict[str, NormalPrior]:
        """Of each shot's parameters."""
        return {shot.name: shot.setup.plan.prior for shot in self.shots}

    @cached_property
    def jacobians(self) -> list[Array]:
        """(k, n) of each shot."""
        return [shot.sample(shot.setup.jacobian(own).T) for shot, own in zip(self.shots, self.z, strict=True)]

    @cached_property
    def peaks(self) -> list[Array]:
        """(channels,) of every shot: largest magnitude of the model's or the record's curve, whichever is larger."""
        found = []
        for shot, mean in zip(self.shots, self.means, strict=True):
            own = [float(np.abs(mean[shot.record.channel == i]).max()) for i in range(len(shot.record.traces))]
            found.append(np.maximum(own, [trace.peak for trace in shot.record.traces]))
        return found

    @cached_property
    def roughness(self) -> Array:
        """(k,) inverse lengths, in ranges, over which the discrepancy changes with the parameters at the least.

        One range for the parameter that moves the curves most, the others by how much less they move them.
        """
        size = np.zeros(len(self.shots[0].setup.lows))
        for shot, jacobian in zip(self.shots, self.jacobians, strict=True):
            for i, trace in enumerate(shot.record.traces):
                size += (jacobian[:, shot.record.channel == i] ** 2).mean(axis=1) / trace.peak**2
        return np.sqrt(size / max(float(size.max()), 1e-300))

    @cached_property
    def numerical_roughness(self) -> Array:
        """(k,) the same of numerical errors: by the lengths over which a finer mesh changes the curves, where known."""
        lengths = self.shots[0].setup.mesh.lengths
        return self.roughness if lengths is None else 1.0 / np.asarray(lengths)

    @property
    def near(self) -> Nearness:
        """How far the shots share numerical errors, and those of signatures."""
        return Nearness(self.shots, self.z, self.numerical_roughness)

    def discrepancy_shared(self, i: int, j: int, length: float) -> float:
        """Correlation of two shots' discrepancies; length: factor on the lengths over which it changes.

        They are shorter where what a finer mesh changes, the one discrepancy that is seen at many parameters, has a
        shorter length.
        """
        return alike(self.z[i], self.z[j], np.maximum(self.numerical_roughness, self.roughness), length)

    def rows(self, kind: str) -> np.ndarray:
        """Of the records that are of one kind of sensor."""
        kinds = [np.array(shot.kinds)[shot.record.channel] for shot in self.shots]
        return np.flatnonzero(np.concatenate(kinds) == kind)

    def by_shot(self, columns: Array) -> list[Array]:
        """The shots' parts of columns (n, ...) over all records."""
        return np.split(columns, np.cumsum([len(shot.record.values) for shot in self.shots])[:-1])


@dataclass(frozen=True)
class Nearness:
    """How far shots share an error: by how near their parameters z (k,) lie; weight: see `alike`."""

    shots: Sequence[Shot]
    z: Sequence[Array]
    weight: Array

    def shared(self, factors: Sequence[Mapping[str, Array]]) -> Array:
        """(n, ...) directions, one standard deviation each, of an error that every shot has by itself.

        factors: source -> (n, q) of each shot; none of a shot that has not the error.
        """
        acting = [i for i, own in enumerate(factors) if own]
        near = np.array([[alike(self.z[i], self.z[j], self.weight) for j in acting] for i in acting])
        share = np.zeros((len(factors), len(acting)))
        if acting:
            share[acting] = np.linalg.cholesky(near + 1e-9 * np.eye(len(acting)))
        rows = paired(factors, [len(shot.record.values) for shot in self.shots])
        columns = [np.vstack([part * own for part, own in zip(each, rows, strict=True)]) for each in share.T]
        return np.hstack([np.zeros((sum(map(len, rows)), 0)), *columns])


def change(one: CandidateEffect, at: Linearisation, h: float) -> Array:
    """(n,) change of all records by an instrument's fault of size h."""
    assert one.fault is not None, "a response is a multiple of its signature"
    parts = [
        shot.instrument_change(one.fault, grid, h) if acts(one, shot) else np.zeros(len(shot.record.values))
        for shot, grid in zip(at.shots, at.grids, strict=True)
    ]
    return np.concatenate(parts)


def acts(one: CandidateEffect, shot: Shot) -> bool:
    return not shot.baseline and shot.name in one.shots


def signature(one: CandidateEffect, at: Linearisation) -> Array:
    """(n,) by which h changes all records at the places: of a fault the slope there, of a response the change by h = 1.

    They are one but where the response in another case bends otherwise than the first's
    (`CandidateEffect.response_in`).
    """
    parts: list[Array] = []
    h = at.places.h.get(one.label, 0.0)
    for shot, z, grid in zip(at.shots, at.z, at.grids, strict=True):
        if not acts(one, shot):
            parts.append(np.zeros(len(shot.record.values)))
        elif one.fault is not None:
            parts.append(shot.instrument_signature(one.fault, grid, h))
        else:
            parts.append(one.change_in(shot, z, h))
    return np.concatenate(parts)


def unnamed_errors(at: Linearisation, h: Mapping[str, float] | None = None) -> Array:
    """(n, q) small errors of model and instruments, of the solver's effects, then of every sensor: `unnamed_error` of
    all labels; h: sizes of the effects that a measured shot has.

    Model and test differ by a little of everything that the library lists and more; without these directions every such
    error would be named as the effect that it imitates (Brynjarsdottir & O'Hagan, Inverse Problems 30 (2014) 114007).
    They belong to rig and model, and all shots share them. So does the clock of all sensors: what counts as contact.
    """
    labels, sizes = at.unnamed_labels, h or {}
    rows = [unnamed_error(at, label, sizes.get(label, 0.0)) for label in labels]
    return np.array(rows).reshape(len(labels), sum(map(len, at.means))).T


def unnamed_error(at: Linearisation, label: str, h: float = 0.0) -> Array:
    """(n,) a small error of a plausible size; baselines have it too.

    h: size of the effect that a measured shot has, beside which its instrument errs. 0 in a shot that cannot have the
    error, because its case states that effect or has not the sensor.
    """
    parts: list[Array] = []
    for shot, z, grid, known in zip(at.shots, at.z, at.grids, at.unnamed, strict=True):
        if label not in known:
            parts.append(np.zeros(len(shot.record.values)))
        elif (fault := known[label]) is None:
            parts.append(shot.response_to(label, z))
        else:
            parts.append(shot.instrument_signature(fault, grid, 0.0 if shot.baseline else h))
    return np.concatenate(parts)


def paired(factors: Sequence[Mapping[str, Array]], points: Sequence[int]) -> list[Array]:
    """(n, q) of each shot, a direction in the same column in all of them; 0 where a shot has it not.

    factors: source -> (n, q) of each shot; points: n of each. The shots' channels, and how many directions each source
    has, may differ.
    """
    widths: dict[str, int] = {}
    for own in factors:
        for source, columns in own.items():
            widths[source] = max(widths.get(source, 0), columns.shape[1])
    found = []
    for own, n in zip(factors, points, strict=True):
        none = np.zeros((n, 0))
        parts = [own.get(source, none) for source in widths]
        padded = [
            np.pad(part, ((0, 0), (0, width - part.shape[1])))
            for part, width in zip(parts, widths.values(), strict=True)
        ]
        found.append(np.hstack([none, *padded]))
    return found
