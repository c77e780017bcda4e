"""The inversion of one measurement from a campaign: gate, emulator, time origin, both methods, verification."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from birdstrike.data.curves import Measured
from birdstrike.data.dataset import Dataset
from birdstrike.data.errors import RunFailed, UserError
from birdstrike.data.histories import Array, Histories
from birdstrike.inversion.estimation.calibration import Calibrator
from birdstrike.inversion.estimation.clock_drift import clock_drift
from birdstrike.inversion.estimation.coordinates import carried_coordinates, parameter_coordinates
from birdstrike.inversion.estimation.curve_model import CurveModel
from birdstrike.inversion.estimation.network_inversion import network_answer
from birdstrike.inversion.estimation.nuisances import Columns, stacked
from birdstrike.inversion.estimation.posterior import Posterior, Sampling, sample
from birdstrike.inversion.estimation.proposal import Ground, Proposal, by_emulator, by_network, too_coarse
from birdstrike.inversion.estimation.residual_correlation import ResidualCorrelation
from birdstrike.inversion.estimation.verification import Verification, channel_scores, overall, verify
from birdstrike.inversion.forward import Forward, watched
from birdstrike.inversion.identifiability.design_gate import design_figures, refuse_deficient
from birdstrike.inversion.identifiability.summary import identifiability_figures, posterior_figures
from birdstrike.inversion.ingredients import emulator_figures, emulator_warnings, measured_figures, training_figures
from birdstrike.inversion.inversion import Answer, Inversion
from birdstrike.inversion.misfit import whitened
from birdstrike.inversion.observations import prior_predictive as clouds
from birdstrike.inversion.observations.observations import Observations, observe
from birdstrike.inversion.observations.time_origin import TimeOrigin, time_origin
from birdstrike.surrogate.emulator import Emulator, ExtrapolationError, fit_emulator
from birdstrike.surrogate.holdout import input_times
from birdstrike.surrogate.inverse_network import HIDDEN, NetworkFit, fit_network

Progress = Callable[[float], None]

METHODS = {"network": ("network",), "emulator": ("emulator",), "both": ("network", "emulator")}


@dataclass(frozen=True)
class Options:
    """How to invert; noise: sensor -> 1 sigma, SI; time_offset: 1 sigma of the time origin [s], 0 where it is known.

    sampling: of the posterior, None for linearised intervals; analyse: directions, profiles and Sobol indices as well;
    hidden: neurons, None for a search; copies: noisy copies of every training run.
    """

    trainer: str = "lm"
    method: str = "both"
    seed: int = 0
    noise: Mapping[str, float] = field(default_factory=dict)
    time_offset: float = 0.0
    allow_rank_deficient: bool = False
    sampling: Sampling | None = field(default_factory=Sampling)
    analyse: bool = True
    hidden: int | None = HIDDEN
    copies: int = 0

    def methods(self) -> tuple[str, ...]:
        """The methods asked for; raises UserError."""
        if self.method not in METHODS:
            raise UserError(f'method = "{self.method}" is unknown; use one of: {", ".join(METHODS)}')
        return METHODS[self.method]


@dataclass(frozen=True)
class Located:
    """The measurement laid over the campaign: time origin found, cloud and residual judged."""

    ground: Ground
    observations: Observations
    origin: TimeOrigin
    cloud: clouds.Cloud
    residual: ResidualCorrelation
    warnings: tuple[str, ...]

    @property
    def emulator(self) -> Emulator:
        """The forward emulator."""
        return self.ground.calibrator.model.emulator


@dataclass(frozen=True)
class Outcome:
    """The inversion and what it was made with, for whoever writes or draws it."""

    inversion: Inversion
    observations: Observations
    emulator: Emulator
    network: NetworkFit | None
    verified: Mapping[str, Verification]
    posterior: Posterior | None = None


def invert(
    dataset: Dataset,
    measured: Measured,
    forward: Forward,
    options: Options | None = None,
    progress: Progress | None = None,
    emulator: Emulator | None = None,
    columns: Columns | None = None,
) -> Outcome:
    """Invert `measured` with a campaign's runs and verify every answer with `forward`.

    emulator: fitted before to the same runs, for another measurement, say; else it is fitted here. columns: errors that
    every model carries besides the emulator's: uncertain speed or mass, mesh error, a stated discrepancy.
    Raises UserError (channels, times, units, a rank-deficient design) and RunFailed when no verification run finishes.
    """
    choice, report = options or Options(), progress or _silent
    methods = choice.methods()
    located = locate(dataset, measured, choice, emulator, lambda f: report(0.2 * f), columns)
    warnings, proposals, network, training = list(located.warnings), {}, None, None
    if "network" in methods:
        read = input_times({c.name: c.times for c in located.observations.channels}, dataset, located.origin.value)
        network = train_network(located, read, choice, lambda f: report(0.2 + 0.1 * f))
        drift = clock_drift(located.ground.calibrator, located.ground.modes[0], located.origin)
        if located.ground.calibrator.model.known is not None:
            drift = np.column_stack([drift, located.ground.calibrator.model.known])
        answer = network_answer(dataset, network, located.observations, read, drift, choice.seed)
        proposals["network"] = by_network(located.ground, network, answer)
        training = training_figures(network, dataset, read)
        warnings += answer.warnings
    if "emulator" in methods:
        proposals["emulator"] = by_emulator(located.ground)
    posterior = located.ground.posterior
    verified = verify_all(dataset.names, proposals, forward, lambda f: report(0.3 + 0.7 * f))
    cloud = clouds.whose_fault(located.cloud, _missed(located, verified), _q2(located.emulator))
    if cloud.coarse:
        warnings[: 0 if located.cloud.inside else 1] = [clouds.warning(cloud, located.observations)]
        proposals = {method: too_coarse(proposal, dataset) for method, proposal in proposals.items()}
        posterior = None
    answers = {method: answered(located, proposals[method], verified[method]) for method in methods}
    warnings += [f"the verification run of the {m} failed: {v.failure}" for m, v in verified.items() if v.failure]
    inversion = Inversion(
        methods=answers,
        best=best(answers),
        ranges={n: (float(a), float(b)) for n, a, b in zip(dataset.names, dataset.lows, dataset.highs, strict=True)},
        design=located.ground.design,
        runs_used=len(dataset.runs),
        time_offset=located.origin,
        warnings=tuple(warnings),
        training=training,
        emulator=emulator_figures(located.emulator, dataset),
        cloud=cloud,
        measured=measured_figures(measured, located.observations),
        case_hash=dataset.case_hash,
        seed=choice.seed,
        residual=located.residual,
        posterior=posterior_figures(posterior, located.ground.coordinates) if posterior else None,
        identifiability=identifiability_figures(located.ground, choice.seed) if choice.analyse else None,
    )
    return Outcome(inversion, located.observations, located.emulator, network, verified, posterior)


def locate(
    dataset: Dataset,
    measured: Measured,
    choice: Options,
    fitted: Emulator | None,
    progress: Progress,
    columns: Columns | None = None,
) -> Located:
    """Gate the design, fit the emulator, calibrate it with the time origin, and judge the measurement by the cloud.

    The columns of known error are taken at a first fit without them.
    """
    observations = observe(measured, dataset, choice.noise)
    design = design_figures(dataset)
    refuse_deficient(design, choice.allow_rank_deficient)
    names = [c.name for c in observations.channels]
    emulator = fitted or fit_emulator(dataset, names, choice.seed, lambda f: progress(0.5 * f))
    carried = carried_coordinates(dataset, design.rank) if design.deficient else None
    coordinates = carried or parameter_coordinates(dataset, emulator.regions)
    calibrator = Calibrator(CurveModel(emulator, observations), coordinates, choice.time_offset)
    if columns is not None:
        known = columns(observations, calibrator.fit(choice.seed)[0])
        calibrator = replace(calibrator, model=replace(calibrator.model, known=known))
    best_fit, modes, residual = calibrator.judged(choice.seed)
    origin, held = time_origin(calibrator, modes)
    found = clouds.cloud(dataset, observations, replace(best_fit, t0=origin.value))
    posterior = None
    if choice.sampling is not None and found.inside and not design.deficient and "emulator" in choice.methods():
        judged = replace(calibrator, model=replace(calibrator.model, observations=residual.widen(observations)))
        posterior = sample(judged, modes, choice.seed, choice.sampling, lambda f: progress(0.6 + 0.4 * f))
    progress(1.0)
    first = list(residual.warnings) if found.inside else [clouds.warning(found, observations)]
    first += [f"{design.sentence}: no separate values are given"] if design.deficient else []
    first += posterior.warnings if posterior else ()
    warnings = (*first, *observations.warnings, *held, *emulator_warnings(emulator, dataset))
    ground = Ground(dataset, design, calibrator, modes, found.inside, posterior)
    return Located(ground, observations, origin, found, residual, warnings)


def train_network(located: Located, read: Mapping[str, Array], choice: Options, progress: Progress) -> NetworkFit:
    """Train on the runs at the measured instants `read`, moved to the model's clock."""
    on_model_clock = {channel: times - located.origin.value for channel, times in read.items()}
    chosen = [c.noise[np.isin(c.times, read[c.name])] for c in located.observations.channels]
    return fit_network(
        located.ground.dataset,
        on_model_clock,
        choice.trainer,
        choice.hidden,
        choice.seed,
        progress,
        np.concatenate(chosen),
        choice.copies,
    )


def verify_all(
    names: tuple[str, ...], proposals: Mapping[str, Proposal], forward: Forward, progress: Progress
) -> dict[str, Verification]:
    """Run the forward model at every answer; raises RunFailed when none finishes."""
    verified: dict[str, Verification] = {}
    for method, proposal in proposals.items():
        theta = {name: float(value) for name, value in zip(names, proposal.theta, strict=True)}
        before = len(verified)
        verified[method] = verify(watched(forward, lambda f, n=before: progress((n + f) / len(proposals))), theta)
        progress((before + 1) / len(proposals))
    if all(v.histories is None for v in verified.values()):
        raise RunFailed("no verification run finished: " + "; ".join(f"{m}: {v.failure}" for m, v in verified.items()))
    return verified


def answered(located: Located, proposal: Proposal, verification: Verification) -> Answer:
    """A proposal with the errors of its verification run."""
    model, t0 = located.ground.calibrator.model, located.origin.value
    try:
        located.emulator.check(proposal.theta[None])
        predicted = located.observations.split(model.curves(model.scores(proposal.theta[None]), t0)[0])
    except ExtrapolationError:
        predicted = None
    scores = channel_scores(verification, predicted, located.observations, t0)
    first = scores[located.observations.channels[0].name]
    key = verification.histories.summary.get("run_key") if verification.histories is not None else None
    return Answer(
        parameters=proposal.estimates,
        predicted_rmse=first.predicted_rmse,
        verified_rmse=first.verified_rmse,
        verified_relative=overall(scores),
        channels=scores,
        combination=proposal.combination,
        run=str(key) if key is not None else None,
        failure=verification.failure,
    )


def _missed(located: Located, verified: Mapping[str, Verification]) -> float | None:
    """Root mean square error of a verification run's worst channel in units of the noise; None without a run.

    Of the best run where the fit misses the record; where it does not, of the run at the emulator's own answer.
    """
    runs = {method: v.histories for method, v in verified.items() if v.histories is not None}
    errors = {method: _worst(located, run) for method, run in runs.items()}
    least = min(errors.values(), default=None)
    return errors.get("emulator", least) if located.cloud.inside else least


def _worst(located: Located, run: Histories) -> float:
    """The largest of the channels' root mean square errors in units of the noise."""
    record = located.observations
    model, values, noise = (
        record.split(rows) for rows in (stacked(run, record, located.origin.value), record.values, record.noise)
    )
    return max(whitened(model[name], values[name], noise[name]) for name in values)


def _q2(emulator: Emulator) -> dict[str, float | None]:
    return {name: curve.validation.q2 for name, curve in emulator.channels.items()}


def _silent(_: float) -> None:
    """Nobody watches the progress."""


def best(answers: Mapping[str, Answer]) -> str | None:
    """The method with the smallest verified error."""
    verified = {m: a.verified_relative for m, a in answers.items() if a.verified_relative is not None}
    return min(verified, key=lambda m: verified[m]) if verified else None
