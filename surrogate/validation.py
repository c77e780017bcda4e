"""Accuracy of an emulator: leave-one-out prediction of its own runs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from birdstrike.data.histories import Array


@dataclass(frozen=True)
class Validation:
    """Leave-one-out figures of one channel.

    q2: 1 - sum of squared errors over sum of squared deviations from the mean curve (1 = perfect, 0 = no better than
    the mean); rmse: root mean square over runs and instants, in the channel's SI unit; standardised: (runs, components)
    errors of the component scores in units of their predicted standard deviation; about N(0, 1) when that is right.
    Optimistic where runs jitter: the mean curve and the components include the run that is left out.
    """

    q2: float
    rmse: float
    standardised: Array


def q2(truth: Array, predicted: Array) -> float:
    """Share of the variance about the column means that is predicted, NaN without any; truth, predicted: (n, ...)."""
    total = float(np.sum((truth - truth.mean(axis=0)) ** 2))
    return 1.0 - float(np.sum((truth - predicted) ** 2)) / total if total > 0.0 else float("nan")


def rmse(truth: Array, predicted: Array) -> float:
    """Root mean square difference, in the unit of the arrays."""
    return float(np.sqrt(np.mean((truth - predicted) ** 2)))


def leave_one_out(covariance: Array, values: Array) -> Array:
    """Predictions (n,) of each value by the others, of a zero-mean Gaussian process.

    covariance: (n, n), nugget included; values: (n,). With Q = K^-1: mean_i = y_i - (Q y)_i / Q_ii; hyperparameters
    are kept. Dubrule, Mathematical Geology 15 (1983) 687; Rasmussen and Williams 2006, eq. 5.12.
    """
    inverse = np.linalg.inv(covariance)
    return values - inverse @ values / np.diag(inverse)
