"""What a prediction rests on: bird, missing effects and model error from a results folder, in one form."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.histories import Array
from birdstrike.inversion.diagnosis.preparation.discrepancy import OWN_SHARE, repeatability
from birdstrike.inversion.estimation.known_errors import DISCREPANCY_LENGTH
from birdstrike.inversion.misfit import rms
from birdstrike.solver.case.case import Case
from birdstrike.solver.case.overlay import Raw

KNOWN_TO = 1.5  # factor, one standard deviation, to which one record fixes the size of the model's error


@dataclass(frozen=True)
class Explanation:
    """One model that the records allow, with draws of its posterior.

    probability: among the explanations; names, parameters: dotted keys and (n, k) SI; members: labels of its effects,
    effects: their names, sizes: their plausible magnitudes, magnitudes: (n, q) SI; amplitude: kind of sensor -> (n,)
    share of the peak, of the model's error that the shots share; material: table of the bird's material that takes the
    place of the case's; empty where the case's stays.
    """

    label: str
    probability: float
    names: tuple[str, ...]
    parameters: Array
    members: tuple[str, ...] = ()
    effects: tuple[str, ...] = ()
    sizes: tuple[float, ...] = ()
    magnitudes: Array = field(default_factory=lambda: np.zeros((0, 0)))
    amplitude: Mapping[str, Array] = field(default_factory=dict)
    own: Mapping[str, Array] = field(default_factory=dict)
    material: Raw = field(default_factory=dict)


@dataclass(frozen=True)
class SensorError:
    """What the fitted models leave of a sensor's record.

    times: (n,) [s] since first contact; residual: explanation -> (draws, n) SI, record less model at each of its draws,
    or (1, n) at its fit where no more is known; sigma: (n,) of the noise; peak: SI; length: correlation time [s];
    growth_times, growth: s(t) >= 1 of the error's size; kind: of the sensor; finer: (n,) SI, one standard deviation of
    what a still finer mesh would add, where that is known.
    """

    times: Array
    residual: Mapping[str, Array]
    sigma: Array
    peak: float
    length: float
    growth_times: Array
    growth: Array
    kind: str = ""
    finer: Array | None = None

    def finer_at(self, kept: NDArray[np.int64]) -> Array:
        """(k,) SI of some instants; 0 where it is not known."""
        return np.zeros(len(kept)) if self.finer is None else self.finer[kept]

    def grown(self, times: Array) -> Array:
        """s at `times` [s] since first contact."""
        return np.interp(times, self.growth_times, self.growth)

    def left(self, label: str, rows: NDArray[np.int64]) -> Array:
        """(rows, n) SI: what an explanation leaves at rows of its draws."""
        own = self.residual[label]
        return own[rows] if len(own) > 1 else np.repeat(own, len(rows), axis=0)

    def excess(self, label: str) -> float:
        """Mean square share of the peak, at first contact, of what an explanation leaves beyond the noise."""
        beyond = (self.residual[label] ** 2 - self.sigma**2) / self.grown(self.times) ** 2
        return max(float(beyond.mean()), 0.0) / self.peak**2


@dataclass(frozen=True)
class LearntShot:
    """A shot that was learnt from: its conditions (see inversion.conditions), what the models leave of its sensors."""

    name: str
    conditions: Mapping[str, float]
    errors: Mapping[str, SensorError]


@dataclass(frozen=True)
class Learnt:
    """What a prediction rests on.

    source: the command that made it; case: of the first shot; corrected: whether its models stand for a finer mesh than
    the campaign's; diagnosed: whether campaign and fine mesh are those of a diagnosis; next_measurement: its proposal;
    said: what was used, and what the user must know of it; set_size: explanations that the command found, of which a
    choice and the budget may leave fewer, 0 where there is one alone; set_said: what they are, "models of ...".
    """

    source: str
    folder: Path
    case: Case
    shots: tuple[LearntShot, ...]
    explanations: tuple[Explanation, ...]
    corrected: bool
    diagnosed: bool
    said: tuple[str, ...]
    next_measurement: str = ""
    warnings: tuple[str, ...] = ()
    set_size: int = 0
    set_said: str = ""

    @property
    def posterior(self) -> tuple[str, ...]:
        """What was used, in words, of those explanations that a choice or the budget has left."""
        if not self.set_size:
            return self.said
        used, words = sum(one.probability > 0.0 for one in self.explanations), self.set_said
        which = f"{used}" if used == self.set_size else f"{used} of {self.set_size}"
        which, words = ("the only", words.replace("models", "model", 1)) if self.set_size == 1 else (which, words)
        return (f"{which} {words}", *self.said)

    @cached_property
    def sensors(self) -> tuple[str, ...]:
        """Sensors of all shots."""
        return tuple(dict.fromkeys(name for shot in self.shots for name in shot.errors))


def calibrated_error(
    case: Case, name: str, times: Array, measured: Array, models: Mapping[str, Array], noise: float | None
) -> SensorError:
    """Of a calibration's record, with one run of every model at its answer.

    times: (m,) [s] since first contact; measured: (m,) SI, NaN where the fit used no reading; models: label -> (m,) SI;
    noise: standard deviation, SI, None where it is not known: then by the steps between neighbours.
    """
    sensor = case.sensors[name]
    kept = np.isfinite(measured) & np.all([np.isfinite(curve) for curve in models.values()], axis=0)
    residual = {label: (measured - curve)[None, kept] for label, curve in models.items()}
    steps = np.abs(np.diff(next(iter(residual.values()))[0]))
    noise = noise or float(np.median(steps) / 0.954)  # of white noise: 0.6745 sqrt(2)
    return SensorError(
        times=times[kept],
        residual=residual,
        sigma=np.full(int(kept.sum()), noise),
        peak=float(np.abs(measured[kept]).max()),
        length=DISCREPANCY_LENGTH * case.time.end,
        growth_times=np.array([0.0, case.time.end]) - case.first_contact,
        growth=np.ones(2),
        kind=sensor.kind,
    )


def amplitudes(
    shots: Sequence[LearntShot], label: str, stated: Mapping[str, float], n: int, rng: np.random.Generator
) -> tuple[Mapping[str, Array], Mapping[str, Array]]:
    """Kind of sensor -> (n,) draws of the share of the peak by which the model errs: what shots share, a shot's own.

    As stated for a sensor, else what its residuals show beyond the noise; root mean square over the sensors of a kind.
    """
    sizes: dict[str, list[float]] = {}
    for shot in shots:
        for name, error in shot.errors.items():
            size = stated[name] if name in stated else float(np.sqrt(error.excess(label)))
            sizes.setdefault(error.kind, []).append(max(size, repeatability(error.kind)))
    found = {kind: rms(own) * KNOWN_TO ** rng.standard_normal(n) for kind, own in sizes.items()}
    parts = {kind: unseen_parts(size, np.full(n, repeatability(kind))) for kind, size in found.items()}
    return {kind: shared for kind, (shared, _) in parts.items()}, {kind: own for kind, (_, own) in parts.items()}


def unseen_parts(size: Array, remaining: Array) -> tuple[Array, Array]:
    """Amplitudes (n,) of what shots share and of a shot's own, of an error `size` that no baseline shows.

    As the diagnosis has them: `OWN_SHARE` of its variance may be the shot's own, besides what always `remaining` is.
    """
    return np.sqrt(1.0 - OWN_SHARE) * size, np.sqrt(OWN_SHARE * size**2 + remaining**2)
