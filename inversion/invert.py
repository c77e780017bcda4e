"""The inversion of one measurement from a campaign: design check, emulator, time origin, both methods, verification."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from birdstrike.data.curves import Measured
from birdstrike.data.dataset import Dataset
from birdstrike.data.errors import RunFailed
from birdstrike.data.histories import Array, Histories
from birdstrike.data.progress import Progress, part_of, silent
from birdstrike.data.run_warnings import merged
from birdstrike.inversion.estimation.answers.network_inversion import NetworkAnswer, network_answer
from birdstrike.inversion.estimation.answers.proposal import Proposal, by_emulator, by_network, not_identified
from birdstrike.inversion.estimation.known_errors import Columns, poor, stacked
from birdstrike.inversion.estimation.locate import (
    InversionOptions,
    Located,
    locate,
)
from birdstrike.inversion.estimation.posterior import Posterior
from birdstrike.inversion.estimation.time_origin import clock_drift
from birdstrike.inversion.estimation.verification import VerificationRun, channel_scores, overall, verify
from birdstrike.inversion.forward import Forward, watched
from birdstrike.inversion.identifiability.summary import identifiability_figures, posterior_figures
from birdstrike.inversion.misfit import finite, rms, whitened
from birdstrike.inversion.observations.observations import Observations
from birdstrike.inversion.observations.plausibility import of_another_size
from birdstrike.inversion.observations.prior_predictive import (
    emulator_or_model,
    prior_predictive_warning,
)
from birdstrike.inversion.observations.reader import OUTSIDE, ChannelRecord
from birdstrike.inversion.results.estimates import Answer
from birdstrike.inversion.results.fit import PriorPredictive
from birdstrike.inversion.results.ingredients import EmulatorFigures, MeasuredFigures, RestFigures, TrainingFigures
from birdstrike.inversion.results.inversion import Inversion
from birdstrike.surrogate.emulator import CurveEmulator, Emulator, ExtrapolationError
from birdstrike.surrogate.holdout import describe, describe_times, input_times
from birdstrike.surrogate.inverse_network import NetworkFit, fit_network
from birdstrike.surrogate.trainers.levenberg_marquardt import Settings

TRAINING_FILE = "training.csv"


@dataclass(frozen=True)
class InversionOutcome:
    """The inversion and what it was made with, for whoever writes or draws it."""

    inversion: Inversion
    observations: Observations
    emulator: Emulator
    network: NetworkFit | None
    verified: Mapping[str, VerificationRun]
    posterior: Posterior | None = None


def invert(
    dataset: Dataset,
    measured: Measured,
    forward: Forward,
    options: InversionOptions | None = None,
    progress: Progress = silent,
    emulator: Emulator | None = None,
    columns: Columns | None = None,
) -> InversionOutcome:
    """Invert `measured` with a campaign's runs and verify every answer with `forward`.

    Parameters
    ----------
    dataset : Dataset
        The runs of a campaign.
    measured : Measured
        The record, SI.
    forward : callable
        {dotted case key: SI value} -> Histories; verifies the answers.
    options : InversionOptions, optional
        Methods, noise, time origin, sampling.
    progress : callable, optional
        Takes the share of the work that is done, 0..1.
    emulator : Emulator, optional
        Fitted before to the same runs; else it is fitted here.
    columns : callable, optional
        Errors that every model carries besides the emulator's: uncertain speed or mass, mesh error, a stated
        discrepancy.

    Returns
    -------
    InversionOutcome
        The inversion, and the trained models, observations and verification runs behind it.

    Raises
    ------
    UserError
        For channels, times, units, or a rank-deficient design.
    RunFailed
        When no verification run finishes.
    """
    choice = options or InversionOptions()
    methods = choice.methods()
    located = locate(dataset, measured, choice, emulator, columns, part_of(progress, 0.0, 0.2))
    proposals, network, training, of_network = {}, None, None, ()
    if "network" in methods:
        network, answer, training = answer_of_network(located, choice, part_of(progress, 0.2, 0.3))
        proposals["network"] = by_network(located.calibration, network, answer)
        of_network = answer.warnings
    if "emulator" in methods:
        proposals["emulator"] = by_emulator(located.calibration)
    posterior = located.calibration.posterior
    verified = verify_all(dataset, proposals, forward, part_of(progress, 0.3, 1.0))
    tested = verified if "emulator" in verified else {**verified, **_run_at_the_fit(located, forward)}
    predictive = _checked_by_solver(located, tested, dataset, choice)
    if predictive != located.prior_predictive:
        proposals = {m: not_identified(one, dataset, bool(predictive.coarse)) for m, one in proposals.items()}
        posterior = None
    answers = {method: answered(located, proposals[method], verified[method]) for method in methods}
    failed = [f"the verification run of the {m} failed: {v.failure}" for m, v in verified.items() if v.failure]
    inversion = Inversion(
        methods=answers,
        best=best(answers),
        ranges=dataset.ranges,
        logarithmic=tuple(np.array(dataset.names)[dataset.logarithmic].tolist()),
        design=located.calibration.design,
        runs_used=len(dataset.runs),
        time_offset=located.origin,
        warnings=(
            *failed,
            *_of_fit(located, predictive, choice),
            *located.warnings,
            *of_network,
            *located.remarks,
            *_of_runs(verified),
        ),
        training=training,
        emulator=emulator_figures(located.emulator, dataset),
        prior_predictive=predictive,
        measured=measured_figures(measured, located.observations, float(dataset.time[0])),
        case_hash=dataset.case_hash,
        seed=choice.seed,
        residual=located.residual,
        posterior=posterior_figures(posterior, located.calibration.coordinates) if posterior else None,
        identifiability=identifiability_figures(located.calibration, choice.seed) if choice.analyse else None,
    )
    return InversionOutcome(inversion, located.observations, located.emulator, network, verified, posterior)


def _checked_by_solver(
    located: Located, tested: Mapping[str, VerificationRun], dataset: Dataset, choice: InversionOptions
) -> PriorPredictive:
    """Whether the record lies among the campaign's curves, once runs at the answers have shown the emulator's error."""
    found = emulator_or_model(located.prior_predictive, _solver_error(located, tested), _q2(located.emulator))
    if found.coarse and of_another_size(dataset, located.observations, choice.time_offset):
        return replace(found, inside=False, coarse="")  # the record is at fault, whatever the emulator's error
    return found


def answer_of_network(
    located: Located, choice: InversionOptions, progress: Progress
) -> tuple[NetworkFit, NetworkAnswer, TrainingFigures]:
    """The network trained for the record, what it says of the measured values, and how it was trained."""
    calibration, dataset = located.calibration, located.calibration.dataset
    read = input_times({c.name: c.times for c in located.observations.channels}, dataset, located.origin.value)
    drift = clock_drift(calibration.calibrator, calibration.modes[0], located.origin)
    if calibration.calibrator.model.known is not None:
        drift = np.column_stack([drift, calibration.calibrator.model.known])
    network = train_network(located, read, choice, progress, drift)
    answer = network_answer(dataset, network, located.observations, read, drift, choice.seed)
    return network, answer, training_figures(network, dataset, read, choice.noisy_copies)


def train_network(
    located: Located, read: Mapping[str, Array], choice: InversionOptions, progress: Progress, nuisances: Array
) -> NetworkFit:
    """Train on the runs at the measured instants `read`, moved to the model's clock.

    nuisances: (n,) or (n, s), change of the stacked curve for one standard deviation of the time origin and each known
    error, of which noisy copies of the runs have their share.
    """
    on_model_clock = {channel: times - located.origin.value for channel, times in read.items()}
    places = [np.isin(c.times, read[c.name]) for c in located.observations.channels]
    chosen = [c.noise[place] for c, place in zip(located.observations.channels, places, strict=True)]
    moved = nuisances.reshape(len(nuisances), -1)[np.concatenate(places)]
    return fit_network(
        located.calibration.dataset,
        on_model_clock,
        choice.trainer,
        choice.hidden,
        choice.seed,
        progress,
        noise=np.concatenate(chosen),
        copies=choice.noisy_copies,
        outputs=choice.outputs,
        nuisances=moved,
    )


def verify_all(
    dataset: Dataset, proposals: Mapping[str, Proposal], forward: Forward, progress: Progress
) -> dict[str, VerificationRun]:
    """Run the forward model at every answer; raises RunFailed when none finishes."""
    verified: dict[str, VerificationRun] = {}
    for method, proposal in proposals.items():
        before = len(verified)
        part = watched(forward, lambda f, n=before: progress((n + f) / len(proposals)))
        verified[method] = verify(part, dataset.named(proposal.theta))
        progress((before + 1) / len(proposals))
    if all(v.histories is None for v in verified.values()):
        raise RunFailed("no verification run finished: " + "; ".join(f"{m}: {v.failure}" for m, v in verified.items()))
    return verified


def _of_fit(located: Located, predictive: PriorPredictive, choice: InversionOptions) -> tuple[str, ...]:
    """Why the model cannot produce the record, its likely cause first; an emulator too coarse to tell comes before."""
    if predictive.inside:
        return located.record_warnings
    outside = prior_predictive_warning(predictive, located.observations, choice.more_runs)
    return (outside, *located.record_warnings) if predictive.coarse else (*located.record_warnings, outside)


def _of_runs(verified: Mapping[str, VerificationRun]) -> tuple[str, ...]:
    """Warnings of the simulations themselves."""
    runs = [run.histories for run in verified.values() if run.histories is not None]
    return merged([run.summary.get("warnings", []) for run in runs])


def answered(located: Located, proposal: Proposal, verification: VerificationRun) -> Answer:
    """A proposal with the errors of its verification run."""
    model, t0 = located.calibration.calibrator.model, located.origin.value
    try:
        located.emulator.check(proposal.theta[None])
        predicted = located.observations.split(model.curve(proposal.theta, t0))
    except ExtrapolationError:
        predicted = None
    scores = channel_scores(verification, predicted, located.observations, t0, _allowed(located))
    first = scores[located.observations.channels[0].name]
    key = verification.histories.summary.get("run_key") if verification.histories is not None else None
    return Answer(
        parameters=proposal.estimates,
        predicted_rmse=first.predicted_rmse,
        verified_rmse=first.verified_rmse,
        verified_relative=overall(s.verified_relative for s in scores.values()),
        verified_misfit=overall(s.verified_misfit for s in scores.values()),
        channels=scores,
        combination=proposal.combination,
        run=str(key) if key is not None else None,
        failure=verification.failure,
    )


def _run_at_the_fit(located: Located, forward: Forward) -> dict[str, VerificationRun]:
    """The run at the emulator's answer, which a network's does not stand for, where it decides what the fit is worth.

    Empty where the fit is accepted and no channel is predicted poorly.
    """
    inside, channels = located.prior_predictive.inside, located.emulator.channels.values()
    if inside and not any(poor(channel) for channel in channels):
        return {}
    theta = by_emulator(located.calibration).theta
    return {"emulator": verify(forward, located.calibration.dataset.named(theta))}


def _solver_error(located: Located, verified: Mapping[str, VerificationRun]) -> float | None:
    """Root mean square error of a verification run's worst channel in units of the noise; None without a run.

    Of the best run where the fit is rejected; where it is not, of the run at the emulator's own answer.
    """
    runs = {method: v.histories for method, v in verified.items() if v.histories is not None}
    errors = {method: _worst(located, run) for method, run in runs.items()}
    least = min(errors.values(), default=None)
    return errors.get("emulator", least) if located.prior_predictive.inside else least


def _worst(located: Located, run: Histories) -> float:
    """The largest of the channels' root mean square errors in units of the noise, of poor ones and of their own error.

    The answer of an emulator that predicts a channel poorly cannot fit that channel better than it predicts it. Where
    the fit is accepted only the poor channels are in doubt: the others have been tested by the fit.
    """
    record = located.observations
    model, values = (record.split(rows) for rows in (stacked(run, record, located.origin.value), record.values))
    unit = _allowed(located)
    tested = (
        [name for name in values if poor(located.emulator.channels[name])] if located.prior_predictive.inside else []
    )
    return max(whitened(model[name], values[name], unit[name]) for name in tested or values)


def _allowed(located: Located) -> dict[str, Array]:
    """Channel -> (n,) SI, by how much a run at the right answer may differ from the record (one standard deviation).

    Noise and, of a channel that the emulator predicts poorly, the error of left-out runs: such a channel's error says
    little about the answer.
    """
    emulator = located.emulator.channels
    return {c.name: np.hypot(c.noise, _left_out_error(emulator[c.name])) for c in located.observations.channels}


def _left_out_error(emulator: CurveEmulator) -> float:
    """What may part a run from the record where a channel is predicted poorly, SI; else 0: it must fit the noise.

    The error of left-out runs is mostly jitter, which both have, each its own.
    """
    return float(np.sqrt(2.0) * emulator.validation.rmse) if poor(emulator) else 0.0


def _q2(emulator: Emulator) -> dict[str, float | None]:
    return {name: curve.validation.q2 for name, curve in emulator.channels.items()}


def best(answers: Mapping[str, Answer]) -> str | None:
    """The method whose verification run differs least from the record, in units of the noise.

    Not in shares of the peaks, which would weigh a rough force, whose noise is a tenth of its peak, as much as a
    displacement that is known to a hundredth.
    """
    verified = {m: a.verified_misfit for m, a in answers.items() if a.verified_misfit is not None}
    return min(verified, key=lambda m: verified[m]) if verified else None


def training_figures(fit: NetworkFit, dataset: Dataset, read: Mapping[str, Array], copies: int) -> TrainingFigures:
    """How the network was trained; read: the instants it reads, on the record's clock; copies: of every run, noisy."""
    training = fit.training
    return TrainingFigures(
        trainer=training.trainer,
        shape=str(fit.network.shape),
        epochs=training.epochs,
        goal=Settings().goal,
        mse=float(training.mse.min()),
        test_mse=finite(fit.training.test_mse[-1]),
        history=TRAINING_FILE,
        status=training.status,
        holdout=f"{describe(int(dataset.distinct.sum()))}; {describe_times(read)}",
        held_out=tuple(int(run) for run in dataset.runs[fit.held_out]),
        inputs={channel: tuple(map(float, times)) for channel, times in read.items()},
        hidden_sizes={size.hidden: (size.mean, size.spread) for size in fit.tried},
        copies=copies,
    )


def emulator_figures(emulator: Emulator, dataset: Dataset) -> EmulatorFigures:
    """Leave-one-out figures of every channel and the runs that were left out."""
    q2 = {name: finite(curve.validation.q2) for name, curve in emulator.channels.items()}
    standardised = {name: curve.validation.standardised for name, curve in emulator.channels.items()}
    return EmulatorFigures(
        components={name: len(curve.processes) for name, curve in emulator.channels.items()},
        q2=q2,
        loo_rmse={name: curve.validation.rmse for name, curve in emulator.channels.items()},
        standardised_rms={n: rms(s) if s.size else None for n, s in standardised.items()},
        runs_left_out=tuple(int(run) for run in dataset.runs if int(run) not in emulator.runs),
    )


def measured_figures(measured: Measured, observations: Observations, start: float) -> MeasuredFigures:
    """Provenance, points and noise of the measurement; start: of the simulations, on its clock [s]."""
    return MeasuredFigures(
        path=measured.path,
        provenance=tuple(measured.provenance),
        simulated=measured.simulated,
        points={c.name: len(c.times) for c in observations.channels},
        noise={c.name: rms(c.noise) for c in observations.channels},
        noise_source={c.name: c.noise_source for c in observations.channels},
        cuts={c.name: _cuts(c.record) for c in observations.channels if c.record is not None and _cuts(c.record)},
        at_rest={c.name: rest for c in observations.channels if (rest := _at_rest(c.record)) is not None},
        digest=measured.digest,
        start=start,
    )


def _cuts(record: ChannelRecord) -> dict[str, tuple[float, ...]]:
    """Instants [s] of the simulated record that were left out, by reason."""
    return {cut.reason: tuple(map(float, cut.times)) for cut in record.cuts if cut.reason != OUTSIDE}


def _at_rest(record: ChannelRecord | None) -> RestFigures | None:
    """What was subtracted from a channel."""
    if record is None or not record.zeroed or record.baseline is None:
        return None
    own = record.baseline
    value = float(own.at(np.array([own.middle]))[0])
    terms = tuple(map(float, own.coefficients))
    return RestFigures(own.kind, value, own.interval(own.middle), own.middle, own.frequency, terms)
