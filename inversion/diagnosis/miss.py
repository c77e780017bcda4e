"""A model's miss in units of what it may miss by: noise, numerical error, and the model's own error at its fit."""

from __future__ import annotations

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.inversion.diagnosis.covariance import Whitener
from birdstrike.inversion.diagnosis.judge import Judge


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
