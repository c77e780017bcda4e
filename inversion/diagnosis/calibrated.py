"""How much larger the numerical error is than its draws say, where the diagnosis looks.

A few draws span few directions. What the diagnosis reads off a record, every effect's score and every parameter's, lies
partly beside them, where the covariance is the widening process's. So each draw is taken for a record, judged by the
others, and the draws' part of the covariance is multiplied until the scores of a typical draw scatter as they should.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import cho_solve, cholesky
from scipy.optimize import brentq

from birdstrike.data.histories import Array
from birdstrike.inversion.diagnosis.point_error import PointError

FEWEST = 5  # draws that tell how they scatter
LARGEST = 1e3  # times; draws that scatter by more are no draws of one error
CLOSE = 0.02
BLIND = 1e-6  # of a signature's square: what the others leave of it is rounding


@dataclass(frozen=True)
class Columns:
    """What a record is read for: derivatives (n, shared) by parameters and nuisances and (n, m) by effects on its
    points, and the priors' rows (rows, shared) of the former.
    """

    shared: Array
    priors: Array
    effects: Array


def calibrated(error: PointError, columns: Columns, measurement: Array) -> PointError:
    """The error with the size, at least 1, at which a typical draw's mean squared score is 1; measurement: (n, n).

    Typical is the median over the draws. With fewer than five draws the size stays.
    """
    if len(error.rest) < FEWEST:
        return error
    parts: list[tuple[Array, Array, Array]] = []
    for i, (frame, change) in enumerate(zip(error.frames, error.changes, strict=True)):
        others = error.without(i)
        parts.append((others.fixed(frame) + measurement, others.drawn(frame), change - others.mean(frame)))

    def excess(log_size: float) -> float:
        scores = [
            mean_square(fixed + np.exp(log_size) * drawn, change, columns, measurement)
            for fixed, drawn, change in parts
        ]
        return float(np.median(scores)) - 1.0

    top = float(np.log(LARGEST))
    if excess(0.0) <= 0.0:
        return error
    if excess(top) >= 0.0:
        return error.sized(LARGEST)
    root: Any = brentq(excess, 0.0, top, xtol=CLOSE)
    return error.sized(float(np.exp(root)))


def mean_square(covariance: Array, change: Array, columns: Columns, noise: Array) -> float:
    """Mean over effects and parameters of the expected squared score of a change (n,) with noise (n, n) on it.

    A score is (g^T P r)^2 / |P g|^2 with P the projection off what the other unknowns can imitate, all whitened by the
    covariance (n, n) and the priors, whose rows scatter by 1; its expectation is 1 where the covariance is the change's
    and the noise's own.
    """
    factor = (cholesky(covariance, lower=True), True)
    every = np.hstack([columns.shared, columns.effects])
    m, q = columns.shared.shape[1], every.shape[1]
    priors = np.hstack([columns.priors, np.zeros((len(columns.priors), q - m))])
    solved = cho_solve(factor, every)
    inner = every.T @ solved + priors.T @ priors
    scores: list[float] = []
    for own in range(q):
        mix = _beside(own, [i for i in range(m) if i != own], inner)
        size = float(mix @ inner @ mix)
        if size > BLIND * inner[own, own]:
            weight, prior = solved @ mix, priors @ mix
            scores.append(float((weight @ change) ** 2 + weight @ noise @ weight + prior @ prior) / size)
    return float(np.mean(scores)) if scores else 1.0


def _beside(own: int, others: list[int], inner: Array) -> Array:
    """(q,) coefficients of P g: the unknown's own column less what the others imitate of it."""
    mix = np.zeros(len(inner))
    mix[own] = 1.0
    mix[others] = -np.linalg.lstsq(inner[np.ix_(others, others)], inner[others, own], rcond=1e-12)[0]
    return mix
