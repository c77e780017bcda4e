"""Refinement: runs where the answer may lie and the emulator is least sure, until they no longer pay."""

from __future__ import annotations

from dataclasses import replace
from numbers import Integral

import numpy as np

from birdstrike.data.curves import Measured
from birdstrike.data.dataset import Dataset
from birdstrike.data.errors import RunFailed, UserError
from birdstrike.data.histories import Array, Histories
from birdstrike.data.progress import Progress, silent
from birdstrike.doe.campaign.results import is_smooth
from birdstrike.inversion.estimation.calibration import Calibrator, Mode
from birdstrike.inversion.estimation.known_errors import Columns
from birdstrike.inversion.estimation.likelihood import Likelihood
from birdstrike.inversion.estimation.locate import InversionOptions, Located, locate
from birdstrike.inversion.forward import Forward
from birdstrike.inversion.results.ingredients import RefinementFigures

AUTO = "auto"
MOST_RUNS = 1000
"""More of them near one answer are not worth their cost: a larger campaign is."""
AUTO_RUNS = 10
"""Budget of `auto`: the points of a quadratic in three parameters, enough for the small region of an answer."""
PAYS = 0.2  # of an interval's variance: below it the interval is at most a tenth wider than with a perfect emulator
OF_THE_NOISE = 1.0  # emulator error at an answer, below which no more runs are asked for
CANDIDATES = 400  # points about the best fits among which the next run is chosen
WIDER = 1.5  # of the best fits' standard deviations: a first emulator may have placed them wrongly


def refine(
    dataset: Dataset,
    measured: Measured,
    forward: Forward,
    options: InversionOptions,
    runs: int | str,
    columns: Columns | None = None,
    progress: Progress = silent,
) -> tuple[Dataset, RefinementFigures]:
    """At most `runs` runs more, one after the other, the emulator fitted anew after each.

    A number: until the emulator's error at the most probable point is below the measurement's noise (root mean square
    over the points). "auto": until the emulator adds less than a fifth to the variance of every parameter's interval,
    with at most 10 runs; the runs' own scatter, which no further run takes away, counts as the record's. A run that
    fails ends it too: its reason is kept; and none is added where no fit explains the record.
    """
    refuse_budget(runs)
    auto, budget = runs == AUTO, AUTO_RUNS if isinstance(runs, str) else runs
    added, errors, shares = list[dict[str, float]](), list[float](), list[float]()
    choice = options.fit_alone
    while True:
        located = locate(dataset, measured, choice, columns=columns)
        calibration, mode = located.calibration, located.calibration.modes[0]
        errors.append(emulator_error(calibration.calibrator, mode))
        shares.append(added_variance(calibration.raised, mode))
        reason = _enough(located, errors[-1], shares[-1], auto)
        if reason or len(added) == budget:
            break
        theta = dataset.named(next_point(located, options.seed))
        try:
            dataset = with_run(dataset, theta, forward(theta))
        except RunFailed as failure:
            reason = f"a run failed: {failure}"
            break
        added.append(theta)
        progress(len(added) / budget)
    if not reason:
        still = (
            f", and the emulator still adds {100 * shares[-1]:.0f} % to an interval's variance: --refine N adds more"
        )
        reason = f"all {budget} runs were used{still if auto else ''}"
    return dataset, RefinementFigures(tuple(added), tuple(errors), reason, tuple(shares))


def refuse_budget(runs: int | str) -> None:
    """Raise UserError for what is neither a number of runs nor `auto`, and for more runs than pay."""
    if runs == AUTO:
        return
    if isinstance(runs, bool | str) or not isinstance(runs, Integral) or runs < 0:
        raise UserError(f'--refine = {runs}; give the number of runs that may be added, 0 .. {MOST_RUNS}, or "{AUTO}"')
    if runs > MOST_RUNS:
        raise UserError(
            f"--refine = {runs} is more than {MOST_RUNS} runs near one answer; enlarge the campaign: run-doe --runs"
        )


def _enough(located: Located, error: float, share: float, auto: bool) -> str:
    """Why no further run is needed; empty where one is."""
    if not auto:
        return f"the emulator's error at the answer is {error:.2f} of the noise" if error < OF_THE_NOISE else ""
    if not located.prior_predictive.inside or located.calibration.design.deficient:
        return "no run was added, since the record does not lie where runs near one answer would help"
    return f"the emulator adds {100 * share:.0f} % to an interval's variance" if share < PAYS else ""


def emulator_error(calibrator: Calibrator, mode: Mode) -> float:
    """Root mean square over the measured points of the emulator's standard deviation in units of the noise."""
    alone = replace(calibrator.model, known=None)
    factor = alone.error_factor(mode.theta, mode.t0) / alone.observations.noise[:, None]
    jitter = (alone.noise_at(mode.t0) / alone.observations.noise) ** 2 - 1.0
    return float(np.sqrt(((factor**2).sum() + jitter.sum()) / len(factor)))


def added_variance(calibrator: Calibrator, mode: Mode) -> float:
    """Largest relative increase of a parameter's variance by the emulator's error beyond the runs' own scatter.

    Linearised at the best fit, prior included; calibrator: of the noise that the intervals have.
    """
    model, tau = calibrator.model, calibrator.tau(mode)
    prior = np.diag(calibrator.coordinates.prior.sd**-2.0)
    whole, least = (
        np.diag(np.linalg.inv(calibrator.data_information(mode.z, tau, whitening, mode.box) + prior))
        for whitening in (
            model.whitening(mode.t0, model.error_factor(mode.theta, mode.t0)),
            model.whitening(mode.t0, model.scatter_factor(mode.theta, mode.t0)),
        )
    )
    return float(max(0.0, (whole / least).max() - 1.0))


def next_point(located: Located, seed: int = 0) -> Array:
    """Parameters (k,) SI where posterior density times variance for want of runs is greatest, about the best fits."""
    calibration = located.calibration
    calibrator, rng = calibration.raised, np.random.default_rng(seed)
    share = -(-CANDIDATES // len(calibration.modes))
    parts, taus = list[Array](), list[Array]()
    for mode in calibration.modes:
        z = np.vstack([mode.z, mode.z + rng.normal(size=(share, len(mode.z))) @ (WIDER * mode.root).T])
        parts.append(np.clip(z, mode.box.lows, mode.box.highs))
        taus.append(np.full(len(z), calibrator.tau(mode)))
    z, tau = np.vstack(parts), np.concatenate(taus)
    likelihood = Likelihood.of(calibrator, calibration.modes)
    theta = likelihood.theta(z)
    score = likelihood.log_posterior(np.column_stack([z, tau])) + np.log(_unvisited(calibrator, theta) + 1e-300)
    return theta[int(np.argmax(score))]


def _unvisited(calibrator: Calibrator, theta: Array) -> Array:
    """(q,) variance of the curves at theta (q, k) for want of runs nearby, in units of the noise's, summed."""
    model = calibrator.model
    u, total = model.emulator.inputs(theta), np.zeros(len(theta))
    for c in model.observations.channels:
        emulator = model.emulator.channels[c.name]
        weights = ((emulator.basis[: len(emulator.processes)] ** 2).mean(axis=1)) * np.sum(c.noise**-2.0)
        for process, weight in zip(emulator.processes, weights, strict=True):
            total += weight * process.distance_variance(u)
    return total


def with_run(dataset: Dataset, theta: dict[str, float], histories: Histories) -> Dataset:
    """The data set with one more run, on its own clock."""
    curves = {
        name: np.vstack([rows, np.interp(dataset.time, histories.time, histories.channels[name])])
        for name, rows in dataset.curves.items()
    }
    return replace(
        dataset,
        runs=np.append(dataset.runs, dataset.runs.max() + 1),
        parameters=np.vstack([dataset.parameters, [theta[name] for name in dataset.names]]),
        curves=curves,
        smooth=np.append(dataset.smooth, is_smooth(histories.summary, dataset.smooth_loss)),
    )
