"""Where the measurement lies in a campaign: design accepted, emulator calibrated with the time origin, fit checked."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from birdstrike.data.curves import Measured
from birdstrike.data.dataset import Dataset
from birdstrike.data.errors import UserError
from birdstrike.data.formatting import listing, plain, quantity, span
from birdstrike.data.progress import Progress, part_of, silent
from birdstrike.doe.designs.quality import Quality, weakest_quality
from birdstrike.doe.designs.space import ParameterSpace
from birdstrike.inversion.estimation.answers.proposal import Calibration
from birdstrike.inversion.estimation.calibration import Calibrator, Mode
from birdstrike.inversion.estimation.coordinates import (
    Coordinates,
    carried_coordinates,
    parameter_coordinates,
)
from birdstrike.inversion.estimation.curve_model import CurveModel
from birdstrike.inversion.estimation.known_errors import Columns, error_columns, noise_columns, poor
from birdstrike.inversion.estimation.posterior import Sampling, sample
from birdstrike.inversion.estimation.prior import conflicts
from birdstrike.inversion.estimation.time_origin import time_origin
from birdstrike.inversion.estimation.unseen_drift import with_drift
from birdstrike.inversion.observations.expected import stated_noise
from birdstrike.inversion.observations.observations import Observations, observe
from birdstrike.inversion.observations.plausibility import implausible
from birdstrike.inversion.observations.prior_predictive import POOR_Q2, prior_predictive
from birdstrike.inversion.results.fit import PriorPredictive, ResidualCorrelation, TimeOrigin
from birdstrike.inversion.results.ingredients import DesignFigures
from birdstrike.solver.case.case import Case
from birdstrike.solver.case.settings import Prior
from birdstrike.surrogate.emulator import Emulator, fit_emulator
from birdstrike.surrogate.inverse_network import HIDDEN, usual_copies

METHODS = {"network": ("network",), "emulator": ("emulator",), "both": ("network", "emulator")}
WORTH_SAYING = 0.01  # of a range


@dataclass(frozen=True)
class InversionOptions:
    """How to invert; noise: sensor -> 1 sigma, SI; time_offset: 1 sigma of the time origin [s], 0 where it is known.

    sampling: of the posterior, None for linearised intervals; analyse: directions, profiles and Sobol indices as well;
    hidden: neurons, None for a search; copies: noisy copies of every training run, None for the usual number; outputs:
    of the network, "bounded" by the ranges or "linear"; more_runs: the option by which the command that asks adds runs,
    for messages; priors: dotted key -> what the case states of a parameter beside its range.
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
    copies: int | None = None
    outputs: str = "bounded"
    more_runs: str = "--refine N"
    priors: Mapping[str, Prior] = field(default_factory=dict)

    @property
    def noisy_copies(self) -> int:
        """Copies of every training run."""
        return usual_copies(self.trainer, self.outputs) if self.copies is None else self.copies

    @property
    def fit_alone(self) -> InversionOptions:
        """The same for the emulator's best fit alone, without a network, a posterior or an analysis."""
        return replace(self, method="emulator", sampling=None, analyse=False)

    def of_case(self, case: Case) -> InversionOptions:
        """The same with the noise, the time origin and the priors that a case states."""
        return replace(
            self,
            noise=stated_noise(case),
            time_offset=case.inversion.nuisance.get("time_offset", 0.0),
            priors=case.priors,
        )

    def methods(self) -> tuple[str, ...]:
        """The methods asked for; raises UserError."""
        if self.method not in METHODS:
            raise UserError(f'method = "{self.method}" is unknown; use one of: {", ".join(METHODS)}')
        return METHODS[self.method]


@dataclass(frozen=True)
class Located:
    """The measurement laid over the campaign: time origin, prior predictive check and residual.

    record_warnings: about the record's sign, unit and clock; warnings: about the answer, the gravest first, less what
    the prior predictive check says; remarks: what was left out or assumed of record and campaign.
    """

    calibration: Calibration
    observations: Observations
    origin: TimeOrigin
    prior_predictive: PriorPredictive
    residual: ResidualCorrelation
    record_warnings: tuple[str, ...]
    warnings: tuple[str, ...]
    remarks: tuple[str, ...]

    @property
    def emulator(self) -> Emulator:
        """The forward emulator."""
        return self.calibration.calibrator.model.emulator


class DesignError(UserError):
    """A design that varies fewer independent directions than there are parameters."""


def locate(
    dataset: Dataset,
    measured: Measured,
    choice: InversionOptions,
    fitted: Emulator | None = None,
    columns: Columns | None = None,
    progress: Progress = silent,
) -> Located:
    """Accept the design, fit the emulator, calibrate it with the time origin, and check the prior predictive.

    fitted: an emulator of the same runs, else it is fitted here. The columns of known error are taken at a first fit
    without them. A measured record's drift: see `unseen_drift`.
    """
    observations = observe(measured, dataset, choice.noise, choice.time_offset)
    design = design_figures(dataset)
    refuse_deficient(design, choice.allow_rank_deficient)
    names = [c.name for c in observations.channels]
    emulator = fitted or fit_emulator(dataset, names, choice.seed, part_of(progress, 0.0, 0.5))
    carried = carried_coordinates(dataset, design.rank, _judged(dataset)[1]) if design.deficient else None
    coordinates = carried or parameter_coordinates(dataset, emulator.regions, choice.priors)
    calibrator = _with_known_errors(dataset, observations, emulator, coordinates, choice, columns)
    fits, drifts = calibrator.best_fits(choice.seed), ()
    if not measured.simulated:
        calibrator, fits, drifts = with_drift(calibrator, fits, choice.seed)
    best_fit, modes, residual = fits
    origin, origin_remarks = time_origin(calibrator, modes)
    predictive = prior_predictive(dataset, observations, best_fit.residual, origin.value)
    raised, posterior = calibrator.raised(residual), None
    if choice.sampling is not None and predictive.inside and not design.deficient and "emulator" in choice.methods():
        posterior = sample(raised, modes, choice.seed, choice.sampling, part_of(progress, 0.6, 1.0))
    progress(1.0)
    warnings = (
        *([f"{design.sentence}: no separate values are given"] if design.deficient else ()),
        *(posterior.warnings if posterior else ()),
        *(residual.warnings if predictive.inside else ()),
        *drifts,
        *_of_priors(coordinates, choice, dataset, modes[0]),
    )
    return Located(
        calibration=Calibration(dataset, design, calibrator, raised, modes, predictive.inside, posterior),
        observations=observations,
        origin=origin,
        prior_predictive=predictive,
        residual=residual,
        record_warnings=implausible(dataset, observations, choice.time_offset),
        warnings=warnings,
        remarks=(*observations.warnings, *origin_remarks, *emulator_warnings(emulator, dataset)),
    )


def _with_known_errors(
    dataset: Dataset,
    observations: Observations,
    emulator: Emulator,
    coordinates: Coordinates,
    choice: InversionOptions,
    columns: Columns | None,
) -> Calibrator:
    """The problem with what is known to be wrong: baselines, correlated noise, the emulator's errors, and `columns`."""

    def problem(t0: float) -> Calibrator:
        """With the errors of poorly predicted channels where a clock t0 [s] late has them."""
        errors = error_columns(emulator, dataset, observations, t0)
        known = np.hstack([observations.baseline_columns, noise_columns(observations), errors])
        return Calibrator(
            CurveModel(emulator, observations, known if known.size else None), coordinates, choice.time_offset
        )

    calibrator = problem(0.0)
    if choice.time_offset and any(poor(emulator.channels[channel.name]) for channel in observations.channels):
        calibrator = problem(calibrator.fit(choice.seed)[0].t0)
    if columns is None:
        return calibrator
    return calibrator.with_known(columns(observations, calibrator.fit(choice.seed)[0]))


def _of_priors(coordinates: Coordinates, choice: InversionOptions, dataset: Dataset, best: Mode) -> list[str]:
    """Warnings about stated priors: contradicted by the record, or not used."""
    if not choice.priors:
        return []
    names = " and ".join(plain(name, dataset.names) for name in choice.priors)
    if not coordinates.prior.stated.any():
        return [f"the prior of {names} is not used: the design varies combinations of the parameters alone"]

    def shown(i: int, z: float) -> str:
        return quantity(float(coordinates.values(i, np.array([z]))[0]), dataset.units[i])

    sd = np.sqrt(np.diag(best.covariance)[:-1])
    warnings = conflicts(coordinates.prior, dataset.names, best.z, sd, shown)
    if "network" in choice.methods():
        warnings.append(f"the network does not know the prior of {names}: it knows the ranges alone")
    return warnings


def design_figures(dataset: Dataset) -> DesignFigures:
    """Quality of the runs that finished and stayed smooth, those that the emulator rests on."""
    quality, _ = _judged(dataset)
    return DesignFigures(
        quality.rank, quality.discrepancy, quality.max_correlation, quality.parameters, quality.sentence
    )


def _judged(dataset: Dataset) -> tuple[Quality, ParameterSpace]:
    """Quality of the smooth runs, and the space in whose scale it is so, as run-doe judges a design."""
    space = ParameterSpace.of_dataset(dataset)
    return weakest_quality(space.to_unit(dataset.parameters[dataset.smooth]), space)


def refuse_deficient(design: DesignFigures, allowed: bool) -> None:
    """Raise DesignError where separate values would be invented; `allowed`: what the design carries will do."""
    if not design.deficient or (allowed and design.rank > 0):
        return
    remedy = "" if design.rank == 0 else "; --allow-rank-deficient gives the combination that is carried instead"
    raise DesignError(f"{design.sentence}: {design.finding}{remedy}")


def emulator_warnings(emulator: Emulator, dataset: Dataset) -> tuple[str, ...]:
    """Runs left out, values near which no run lies, and channels that are predicted poorly."""
    sentences: list[str] = []
    lost = [str(int(run)) for run in dataset.runs[~dataset.smooth]]
    if lost:
        limit = f"{100 * dataset.smooth_loss:g} % of the bird"
        which = f"{'run' if len(lost) == 1 else 'runs'} {', '.join(lost)}"
        sentences.append(f"{which} lost more than {limit}: the emulator leaves them out")
    for i, name in enumerate(dataset.names):
        for low, high in _gaps(emulator, dataset, i):
            where = f"{plain(name, dataset.names)} {span(low, high, dataset.units[i])}"
            sentences.append(f"{where}: too few smooth runs stand there, so no answer is sought there")
    q2 = {plain(channel): curve.validation.q2 for channel, curve in emulator.channels.items()}
    if poorly := [f"{channel} (Q2 {one:.2f})" for channel, one in q2.items() if not one > POOR_Q2]:
        what, it = ("each", "them") if len(poorly) > 1 else ("the channel", "it")
        sentences.append(
            f"the emulator predicts left-out runs of {listing(poorly)} poorly: {what} carries the error of these "
            f"predictions and counts for less; add runs, or leave {it} out: --channels"
        )
    return tuple(sentences)


def _gaps(emulator: Emulator, dataset: Dataset, i: int) -> list[tuple[float, float]]:
    """Stretches of parameter i's range that no region of the emulator covers, in whose scale they are worth saying."""
    space, low, high = ParameterSpace.of_dataset(dataset), float(dataset.lows[i]), float(dataset.highs[i])
    gaps: list[tuple[float, float]] = []
    reached = low
    for start, end in sorted({(float(r.lows[i]), float(r.highs[i])) for r in emulator.regions}):
        gaps.append((reached, start))
        reached = max(reached, end)
    gaps.append((reached, high))

    def place(value: float) -> float:
        return float(space.to_unit(np.full(len(space.names), value))[i])

    return [(a, b) for a, b in gaps if place(b) - place(a) > WORTH_SAYING]
