"""Refinement: runs where the answer may lie and the emulator is least sure, until its error is below the noise."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from birdstrike.data.curves import Measured
from birdstrike.data.dataset import Dataset
from birdstrike.data.errors import RunFailed, UserError
from birdstrike.data.histories import Array, Histories
from birdstrike.doe.campaign.results import is_smooth
from birdstrike.inversion.estimation.calibration import Calibrator, Mode
from birdstrike.inversion.estimation.likelihood import Likelihood
from birdstrike.inversion.estimation.locate import InversionOptions, Located, locate
from birdstrike.inversion.estimation.nuisances import Columns
from birdstrike.inversion.forward import Forward
from birdstrike.inversion.results.ingredients import RefinementFigures

CANDIDATES = 400  # posterior draws among which the next run is chosen


def refine(
    dataset: Dataset,
    measured: Measured,
    forward: Forward,
    options: InversionOptions,
    runs: int,
    columns: Columns | None = None,
    progress: Callable[[float], None] | None = None,
) -> tuple[Dataset, RefinementFigures]:
    """At most `runs` runs more, one after the other, the emulator fitted anew after each.

    It ends when the emulator's error at the most probable point is below the measurement's noise (root mean square over
    the points). A run that fails ends it too: its reason is kept.
    """
    if runs < 0:
        raise UserError(f"refine = {runs} is below 0; give the number of runs that may be added")
    added: list[dict[str, float]] = []
    errors: list[float] = []
    reason = f"all {runs} runs were used"
    choice = replace(options, method="emulator", analyse=False)
    while True:
        located = locate(dataset, measured, choice, None, lambda _: None, columns)
        errors.append(emulator_error(located.calibration.calibrator, located.calibration.modes[0]))
        if errors[-1] < 1.0:
            reason = f"the emulator's error at the answer is {errors[-1]:.2f} of the noise"
            break
        if len(added) == runs:
            break
        theta = {name: float(v) for name, v in zip(dataset.names, next_point(located), strict=True)}
        try:
            dataset = with_run(dataset, theta, forward(theta))
        except RunFailed as failure:
            reason = f"a run failed: {failure}"
            break
        added.append(theta)
        if progress is not None:
            progress(len(added) / runs)
    return dataset, RefinementFigures(tuple(added), tuple(errors), reason)


def emulator_error(calibrator: Calibrator, mode: Mode) -> float:
    """Root mean square over the measured points of the emulator's standard deviation in units of the noise."""
    alone = replace(calibrator.model, known=None)
    factor = alone.error_factor(mode.theta, mode.t0) / alone.observations.noise[:, None]
    jitter = (alone.noise / alone.observations.noise) ** 2 - 1.0
    return float(np.sqrt(((factor**2).sum() + jitter.sum()) / len(factor)))


def next_point(located: Located) -> Array:
    """Parameters (k,) SI where posterior density times emulator variance is greatest, among the posterior's draws.

    Where nothing was drawn (no fit explains the record, or the posterior was not asked for) the best fit itself.
    """
    calibration, posterior = located.calibration, located.calibration.posterior
    if posterior is None:
        return calibration.modes[0].theta
    some = np.linspace(0, len(posterior.z) - 1, min(CANDIDATES, len(posterior.z))).round().astype(int)
    calibrator = calibration.calibrator
    tau = posterior.t0[some] / calibrator.sigma if calibrator.sigma else np.zeros(len(some))
    density = Likelihood.of(calibrator, calibration.modes).log_posterior(np.column_stack([posterior.z[some], tau]))
    modes = (replace(calibration.modes[0], theta=posterior.theta[i], t0=float(posterior.t0[i])) for i in some)
    error = np.array([emulator_error(calibrator, mode) for mode in modes])
    return posterior.theta[some[int(np.argmax(density + 2.0 * np.log(error)))]]


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
        smooth=np.append(dataset.smooth, is_smooth(histories.summary)),
    )
