"""A model's miss in units of what it may miss by: noise, numerical error, and the model's own error at its fit."""

from __future__ import annotations

import numpy as np

from data.histories import Array
from inversion.diagnosis.covariance import Whitener
from inversion.diagnosis.groundwork import emulator_error
from inversion.diagnosis.judge import Judge
from inversion.diagnosis.refit import Fit


def allowance(judge: Judge, fit: Fit) -> Array:
    """(n, n) covariance of a fit's miss on the judge's points.

    The model's own error is the emulator's at the fit, or, where a strike has corrected it, that strike's scatter.
    """
    model = fit.problem.model
    own = judge.jitter if np.ndim(model.correction) else emulator_error(model, fit.theta)
    return judge.measurement + judge.numerical + own


def errors(judge: Judge, miss: Array, covariance: Array, points: np.ndarray | None = None) -> tuple[float, float]:
    """Whitened RMS of a miss (n,) on points (n,): by its covariance, and by the measurement noise alone."""
    return rms(Whitener.of(covariance, points).apply(miss)), rms(Whitener.of(judge.measurement, points).apply(miss))


def rms(values: Array) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(values**2)))


def by_channel(judge: Judge, miss: Array) -> dict[str, float]:
    """RMS of a miss (n,) per sensor, SI."""
    channel = judge.record.channel
    return {trace.name: rms(miss[channel == i]) for i, trace in enumerate(judge.record.traces)}
