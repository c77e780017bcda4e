"""The model of a diagnosis: emulator plus learnt responses plus the instrument, on the record's points."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import lfilter

from birdstrike.data.histories import Array, Histories
from birdstrike.inversion.diagnosis.record import Record, averaged
from birdstrike.inversion.diagnosis.responses import Known, Response
from birdstrike.inversion.estimation.coordinates import Box, Coordinates
from birdstrike.solver.case.case import Case
from birdstrike.solver.effects.instrument import transducers
from birdstrike.surrogate.emulator import Emulator

NUISANCE_EFFECT = {
    "time_offset": "time_offset",
    "speed": "impact_speed",
    "mass": "bird_mass",
    "thickness": "plate_thickness",
    "angle": "impact_angle",
}
"""A nuisance is an effect of known small size that every model carries."""


@dataclass(frozen=True)
class Clock:
    """The model's own instants (m,) [s], uniform from 0, and the channels that are stacked on it."""

    time: Array
    channels: tuple[str, ...]

    def stack(self, histories: Histories) -> Array:
        """(grid,) the channels of a strike one after the other."""
        return np.concatenate([np.interp(self.time, histories.time, histories.channels[c]) for c in self.channels])


@dataclass(frozen=True)
class Place:
    """Where models are evaluated, q at once: z (q, r) parameters, b (q, m) effects in plausible sizes."""

    z: Array
    b: Array


@dataclass(frozen=True)
class Model:
    """f(z, b) on the record's points.

    known: the effects, in the order of b; responses: of those that act on the strike; finer: curves (q, grid) with what
    finer meshes add; correction: (grid,) what the solver added to this sum where it was last asked.
    """

    case: Case
    clock: Clock
    emulator: Emulator
    coordinates: Coordinates
    known: tuple[Known, ...]
    responses: Mapping[str, Response]
    record: Record
    finer: Callable[[Array], Array]
    correction: Array | float = 0.0

    def corrected(self, correction: Array) -> Model:
        """The model with another correction."""
        return replace(self, correction=correction)

    def grid(self, place: Place, box: Box) -> Array:
        """(q, grid) curves on the model's clock before the instrument."""
        theta = self.coordinates.theta(place.z, box)
        u = self.emulator.inputs(theta)
        emulators = [self.emulator.channels[c] for c in self.clock.channels]  # whose clock is the model's
        parts = [one.mean + one.scores(u) @ one.basis[: len(one.processes)] for one in emulators]
        curves = np.concatenate(parts, axis=1) + self.correction
        for i, known in enumerate(self.known):
            if known.name in self.responses and place.b[:, i].any():
                curves = curves + self.responses[known.name].at(place.b[:, i])
        return curves

    def points(self, place: Place, box: Box) -> Array:
        """(q, n) on the record's points, as finer meshes would have it, through the instrument."""
        return self.recorded(self.finer(self.grid(place, box)), place.b)

    def recorded(self, curves: Array, b: Array) -> Array:
        """(q, n): curves (q, grid) through the instruments that b (q, m) describes, at the record's points."""
        said = [self._instruments(row) for row in b]
        read = [self._one(curve, own) for curve, own in zip(curves, said, strict=True)]
        return np.array(read, dtype=np.float64).reshape(len(curves), len(self.record.values))

    def through(self, changes: Array, b: Array) -> Array:
        """(q, n): what changes (q, grid) of the curves do to the record, through the instruments that b (m,) describes.

        A drift reads without any signal: it is no part of a change.
        """
        if not self.moved(b):
            return self.sample(changes)
        rows = np.vstack([changes, np.zeros((1, changes.shape[1]))])
        read = self.recorded(rows, np.repeat(b[None], len(rows), axis=0))
        return read[:-1] - read[-1]

    def moved(self, b: Array) -> bool:
        """Whether effects b (m,) act on the record itself."""
        return bool(self._instruments(b))

    def sample(self, curves: Array) -> Array:
        """(q, n): curves (q, grid) at the record's points, without an instrument."""
        return self.recorded(curves, np.zeros((len(curves), len(self.known))))

    def _instruments(self, b: Array) -> dict[str, float]:
        """Magnitudes of the instrument's effects, SI; those of one's own are not linear in b and go through strikes."""
        return {k.name: k.magnitude(float(b[i])) for i, k in enumerate(self.known) if k.of_record and b[i]}

    def _one(self, curve: Array, own: Mapping[str, float]) -> Array:
        """reading(t) = gain * lowpass[signal](t - offset) + drift t, as solver/sensors/instrument.py has it."""
        m, parts = len(self.clock.time), []
        moved = transducers(self.case)
        offset = own.get("time_offset", 0.0)
        for i, trace in enumerate(self.record.traces):
            signal = curve[i * m : (i + 1) * m]
            acts = trace.name in moved
            if acts and own.get("sensor_bandwidth", 0.0) > 0.0:
                signal = low_pass(signal, float(self.clock.time[1]), own["sensor_bandwidth"])
            values = np.interp(trace.times - offset, self.clock.time, signal)
            if acts:
                drift = own.get("sensor_drift", 0.0) if trace.unit == "m" else 0.0
                values = values * (1.0 + own.get("sensor_gain", 0.0)) + drift * trace.times
            parts.append(averaged(values, trace.block))
        return np.concatenate(parts)


def low_pass(signal: Array, step: float, tau: float) -> Array:
    """`solver.sensors.instrument.low_pass` on a uniform clock: tau y' + y = s, exact for a signal linear in between."""
    h = step / tau
    decay, mean_decay = np.exp(-h), -np.expm1(-h) / h
    first = signal[0] * (1.0 - (1.0 - mean_decay))
    return lfilter([1.0 - mean_decay, mean_decay - decay], [1.0, -decay], signal, zi=[first])[0]
