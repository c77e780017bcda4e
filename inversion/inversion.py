"""What an inversion found: the content of `inversion.json`. SI units; None where a thing does not exist."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from pydantic import TypeAdapter

from birdstrike.data.files import write_atomically
from birdstrike.inversion.estimation.residual_correlation import ResidualCorrelation
from birdstrike.inversion.identifiability.design_gate import DesignFigures
from birdstrike.inversion.identifiability.directions import Direction
from birdstrike.inversion.observations.prior_predictive import Cloud
from birdstrike.inversion.observations.time_origin import TimeOrigin

SCHEMA_VERSION = 1


@dataclass(frozen=True)
class Estimate:
    """One parameter by one method.

    value: SI; of a parameter that is not identified it is only the point at which the verification ran; None where the
    design carries no separate value. reason: one line that says why it is identified or not.
    """

    value: float | None
    interval_95: tuple[float, float] | None
    unit: str
    identified: bool
    reason: str

    @property
    def consistent(self) -> bool:
        """Whether the interval, where there is one, holds the value, rounding aside."""
        if self.value is None or self.interval_95 is None:
            return True
        low, high = self.interval_95
        rounding = 1e-9 * max(abs(low), abs(high))
        return low - rounding <= self.value <= high + rounding


@dataclass(frozen=True)
class ChannelScore:
    """Errors of one channel, SI `unit`.

    predicted_rmse: by the emulator at the method's answer; verified_rmse: by the solver, at the estimated time origin,
    verified_relative: the same over the measured peak; verified_rmse_at_zero_offset: by the solver on its own clock.
    """

    unit: str
    predicted_rmse: float | None
    verified_rmse: float | None
    verified_relative: float | None
    verified_rmse_at_zero_offset: float | None


@dataclass(frozen=True)
class Combination:
    """What a rank-deficient design does carry: coordinates 0..1 over the runs, and a line in the user's words.

    directions: for each coordinate, name -> change of the parameter from 0 to 1, SI; point: where the verification ran.
    """

    directions: tuple[dict[str, float], ...]
    coordinates: tuple[float, ...]
    interval_95: tuple[tuple[float, float] | None, ...]
    point: dict[str, float]
    sentence: str


@dataclass(frozen=True)
class Answer:
    """One method's answer.

    predicted_rmse, verified_rmse: of the first measured channel, SI; verified_relative: root mean square of the
    channels' errors relative to their peaks; run: key of the verification run in the run store; failure: why it did not
    finish.
    """

    parameters: Mapping[str, Estimate]
    predicted_rmse: float | None
    verified_rmse: float | None
    verified_relative: float | None
    channels: Mapping[str, ChannelScore]
    combination: Combination | None
    run: str | None
    failure: str | None


@dataclass(frozen=True)
class TrainingFigures:
    """How the network was trained; inputs: channel -> instants on the record's clock [s]; held_out: run numbers."""

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


@dataclass(frozen=True)
class EmulatorFigures:
    """Components that are predicted, and leave-one-out figures of each channel (loo_rmse in SI)."""

    components: Mapping[str, int]
    q2: Mapping[str, float | None]
    loo_rmse: Mapping[str, float]
    standardised_rms: Mapping[str, float | None]
    runs_left_out: tuple[int, ...]


@dataclass(frozen=True)
class MeasuredFigures:
    """Where the measurement came from, and how noisy it is taken to be (SI, root mean square of a channel)."""

    path: str
    provenance: tuple[str, ...]
    simulated: bool
    points: Mapping[str, int]
    noise: Mapping[str, float]
    noise_source: Mapping[str, str]


@dataclass(frozen=True)
class PosteriorFigures:
    """The emulator's posterior, draws in `draws` (CSV, SI). name -> figure; `time_offset` [s] among the names.

    contraction: 1 - (posterior sd / prior sd)^2 of the parameters; correlation: rows in the order of `names`;
    rhat, effective: of the parameters; acceptance, steps: of the chains; converged: R-hat <= 1.01, 400 effective draws.
    """

    names: tuple[str, ...]
    most_probable: Mapping[str, float]
    mean: Mapping[str, float]
    sd: Mapping[str, float]
    interval_95: Mapping[str, tuple[float, float]]
    contraction: Mapping[str, float]
    correlation: tuple[tuple[float, ...], ...]
    rhat: Mapping[str, float | None]
    effective: Mapping[str, float]
    acceptance: float
    steps: int
    converged: bool
    draws: str


@dataclass(frozen=True)
class ProfileFigures:
    """values: SI; rise: of minus twice the log posterior; at_bound: other parameters at an end; sentence: in words."""

    values: tuple[float, ...]
    rise: tuple[float, ...]
    at_bound: tuple[tuple[str, ...], ...]
    sentence: str


@dataclass(frozen=True)
class SobolFigures:
    """One channel over time [s]: sd SI over the ranges; name -> first-order and total index, null where sd is 0."""

    times: tuple[float, ...]
    sd: tuple[float, ...]
    first: Mapping[str, tuple[float | None, ...]]
    total: Mapping[str, tuple[float | None, ...]]


@dataclass(frozen=True)
class IdentifiabilityFigures:
    """Singular directions (the best told first), profile likelihood by parameter, Sobol indices by channel."""

    directions: tuple[Direction, ...]
    profiles: Mapping[str, ProfileFigures]
    sobol: Mapping[str, SobolFigures]


@dataclass(frozen=True)
class RefinementFigures:
    """Runs added near the answer; error: of the emulator at the answer in units of noise, before each and at the end.

    added: one entry a run, name -> SI; reason: why it ended.
    """

    added: tuple[dict[str, float], ...]
    error: tuple[float, ...]
    reason: str


@dataclass(frozen=True)
class ShotFigures:
    """One of several records that were inverted together.

    suffix: of its channels' names; time_offset [s]; inside: what its own fit says of the cloud.
    """

    path: str
    suffix: str
    case_hash: str
    time_offset: float
    inside: bool


@dataclass(frozen=True)
class Inversion:
    """The whole result.

    methods: those that were run; best: the one with the smallest verified error; ranges: name -> limits of the search,
    SI; runs_used: finished runs of the campaign, those of a refinement included; residual: of the emulator's best fit.
    None in older files, and where not asked for: residual, posterior, identifiability, refinement. known_errors: what
    the model's error holds besides the emulator's; shots: of several records; shot_scatter: 1 sigma, relative
    amplitude.
    """

    methods: Mapping[str, Answer]
    best: str | None
    ranges: Mapping[str, tuple[float, float]]
    design: DesignFigures
    runs_used: int
    time_offset: TimeOrigin
    warnings: tuple[str, ...]
    training: TrainingFigures | None
    emulator: EmulatorFigures
    cloud: Cloud
    measured: MeasuredFigures
    case_hash: str
    seed: int
    schema_version: int = SCHEMA_VERSION
    residual: ResidualCorrelation | None = None
    posterior: PosteriorFigures | None = None
    identifiability: IdentifiabilityFigures | None = None
    refinement: RefinementFigures | None = None
    known_errors: tuple[str, ...] = ()
    shots: tuple[ShotFigures, ...] = ()
    shot_scatter: float | None = None

    def save(self, path: Path) -> None:
        """Write JSON; what is not finite becomes null."""
        for answer in self.methods.values():
            for name, estimate in answer.parameters.items():
                assert estimate.consistent, f"{name}: {estimate.value} lies outside {estimate.interval_95}"
        write_atomically(path, _ADAPTER.dump_json(self, indent=2).decode() + "\n")

    @classmethod
    def load(cls, path: Path) -> Inversion:
        """Read what `save` wrote."""
        return _ADAPTER.validate_json(path.read_bytes())


_ADAPTER = TypeAdapter(Inversion)
