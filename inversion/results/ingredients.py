"""What an inversion rests on: design, training, emulator, measurement, added runs, shots. SI units."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.curves import Measured
from birdstrike.data.formatting import many
from birdstrike.data.histories import Array

SAME_INSTANT = 1e-9
"""[s] By which an instant may have been rounded in a file: far less than any logger's interval."""


@dataclass(frozen=True)
class DesignFigures:
    """Which parameters a design separates.

    rank: independent directions of the centred, scaled design; discrepancy: squared centred L2; max_correlation:
    largest of two columns; parameters: how many are sought; finding: the directions in words.
    """

    rank: int
    discrepancy: float | None
    max_correlation: float | None
    parameters: int
    finding: str

    @property
    def deficient(self) -> bool:
        """True when separate estimates of all parameters cannot be had."""
        return self.rank < self.parameters

    @property
    def sentence(self) -> str:
        """What a deficient design carries."""
        return f"the design carries {many(self.rank, 'direction')}, not {self.parameters}"


@dataclass(frozen=True)
class TrainingFigures:
    """How the network was trained; inputs: channel -> instants on the record's clock [s]; held_out: run numbers.

    hidden_sizes: neurons -> mean and standard deviation over the starts of the cross-validated error, shares of the
    ranges; empty where the size was given; copies: of every training run, with the record's noise.
    """

    trainer: str
    shape: str
    epochs: int
    goal: float
    mse: float
    test_mse: float | None
    history: str
    status: str
    holdout: str
    held_out: tuple[int, ...]
    inputs: Mapping[str, tuple[float, ...]]
    hidden_sizes: Mapping[int, tuple[float, float]] = field(default_factory=dict)
    copies: int = 0


@dataclass(frozen=True)
class EmulatorFigures:
    """Components that are predicted, and leave-one-out figures of each channel (loo_rmse in SI)."""

    components: Mapping[str, int]
    q2: Mapping[str, float | None]
    loo_rmse: Mapping[str, float]
    standardised_rms: Mapping[str, float | None]
    runs_left_out: tuple[int, ...]


@dataclass(frozen=True)
class RestFigures:
    """The reading of a sensor at rest: value and interval before contact, SI; its terms as in observations.baseline."""

    kind: str
    value: float
    interval_95: tuple[float, float]
    middle: float
    frequency: float
    coefficients: tuple[float, ...]

    def at(self, times: Array) -> Array:
        """(n,) the reading at rest at `times` [s]."""
        apart = times - self.middle
        phase = 2.0 * np.pi * self.frequency * apart
        terms = [np.ones(len(times)), apart, np.sin(phase), np.cos(phase)][: len(self.coefficients)]
        return np.stack(terms, axis=1) @ np.array(self.coefficients)


@dataclass(frozen=True)
class MeasuredFigures:
    """Where the measurement came from, and how noisy it is taken to be (SI, root mean square of a channel).

    cuts: channel -> reason -> instants [s] inside the simulated record that were left out; at_rest: channel -> what was
    subtracted from it. Both empty in older files. digest: SHA-256 of the file's content, "" where it is not known;
    start: of the simulations, on the record's clock [s].
    """

    path: str
    provenance: tuple[str, ...]
    simulated: bool
    points: Mapping[str, int]
    noise: Mapping[str, float]
    noise_source: Mapping[str, str]
    cuts: Mapping[str, Mapping[str, tuple[float, ...]]] = field(default_factory=dict)
    at_rest: Mapping[str, RestFigures] = field(default_factory=dict)
    digest: str = ""
    start: float = 0.0

    def cut(self, channel: str, *reasons: str) -> Array:
        """Instants [s] of a channel that were cut for these reasons."""
        found = self.cuts.get(channel, {})
        return np.array([t for reason in reasons for t in found.get(reason, ())])

    def used(self, channel: str, time: Array, values: Array) -> NDArray[np.bool_]:
        """(n,) True at the readings that the fit of a channel used, of a record's `time` (n,) [s] and `values` (n,).

        Of the readings since `start` that were not cut the fit used the first `points`: beyond the end of the simulated
        record it took none.
        """
        cut = self.cut(channel, *self.cuts.get(channel, {}))
        left_out = np.isin(np.round(time / SAME_INSTANT), np.round(cut / SAME_INSTANT))
        sound = np.isfinite(values) & (time >= self.start - SAME_INSTANT) & ~left_out
        return np.asarray(sound & (np.cumsum(sound) <= self.points[channel]))

    def above_rest(self, record: Measured) -> Measured:
        """The record as it was read, less what its sensors read at rest: what the fit compared."""
        rest = {name: own.at(record.time) for name, own in self.at_rest.items() if name in record.channels}
        return replace(record, channels={name: v - rest.get(name, 0.0) for name, v in record.channels.items()})

    def fitted(self, record: Measured) -> Measured:
        """A record above rest with gaps where the fit left a reading out."""
        kept = {name: self.used(name, record.time, values) for name, values in record.channels.items()}
        return replace(record, channels={n: np.where(kept[n], v, np.nan) for n, v in record.channels.items()})

    def known_noise(self, channel: str) -> float | None:
        """Standard deviation of a channel's noise, SI; None where it is only assumed."""
        return None if self.noise_source[channel] == "assumed" else self.noise[channel]


@dataclass(frozen=True)
class RefinementFigures:
    """Runs added near the answer; error: of the emulator at the answer in units of noise, before each and at the end.

    added: one entry a run, name -> SI; reason: why it ended; added_variance: what the emulator adds to the variance of
    the interval that suffers most, as a share of the variance without it, before each run and at the end; empty in
    older files.
    """

    added: tuple[dict[str, float], ...]
    error: tuple[float, ...]
    reason: str
    added_variance: tuple[float, ...] = ()


@dataclass(frozen=True)
class MeshCorrectionFigures:
    """What a finer mesh adds to a campaign's curves, and what that cost.

    particles, elements: of the fine mesh, the latter None where the target's is that of the file `mesh_file`; runs:
    simulations on it; seconds: of those that were not stored yet, fits included; added, error: channel -> root mean
    square of the difference, and of its leave-one-out error, shares of the runs' peak.
    """

    particles: int
    elements: tuple[int, int] | None
    runs: int
    seconds: float
    added: Mapping[str, float]
    error: Mapping[str, float]
    mesh_file: str | None = None

    @property
    def sentence(self) -> str:
        """What it is, what it cost and what it came to."""
        parts = [
            f"{name.replace('_', ' ')} {100 * share:.2g} % of the peak (known to {100 * self.error[name]:.2g} %)"
            for name, share in self.added.items()
        ]
        return (
            f"mesh correction: {self.runs} simulations of {self.particles} particles and {self.shells} in "
            f"{self.seconds:.0f} s; they differ from the campaign's mesh by {', '.join(parts)}"
        )

    @property
    def shells(self) -> str:
        """The fine mesh of the target."""
        if self.elements is None:
            return f"the mesh of {self.mesh_file}"
        return "{} x {} shells".format(*self.elements)


@dataclass(frozen=True)
class ShotFigures:
    """One of several records that were inverted together.

    suffix: of its channels' names; time_offset [s]; inside: whether its own fit passes the prior predictive check;
    digest: SHA-256 of the file's content, "" where it is not known.
    """

    path: str
    suffix: str
    case_hash: str
    time_offset: float
    inside: bool
    digest: str = ""
