"""How a few draws of an error are widened: the process beside them that predicts each draw best from the others."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.linalg import LinAlgError, cholesky, solve_triangular
from scipy.ndimage import uniform_filter1d

from birdstrike.data.histories import Array

LENGTHS = tuple(2.0**-k for k in range(2, 9))  # of the record: correlation lengths that are tried
SHARES = (0.01, 0.03, 0.1, 0.3, 1.0, 3.0)  # of the rest's variance: shares of the process that are tried
WEIGHTS = (1.0, 1.5, 2.5)  # of gain and shift: few draws may show too little of them
ENVELOPE = 0.05  # of the record: over which the envelope is smoothed
FLOOR = 1e-3  # of the largest rest: no instant is free of error
POINTS = 100  # means over neighbours, on which the process is chosen


@dataclass(frozen=True)
class Draws:
    """One channel's draws on its points.

    changes, rest: (k, n); moments: (k, 2) gains and shifts; frames: (k, 2, n) unit gain and shift of each draw's curve;
    times (n,) [s]; noise: (n, n).
    """

    changes: Array
    rest: Array
    moments: Array
    frames: Array
    times: Array
    noise: Array

    def best(self) -> tuple[float, float, float]:
        """Length [s] and share of the process, and weight of gain and shift, that predict each draw from the others.

        Score: expected log density of a draw with noise on it.
        """
        mean = _means(len(self.times), POINTS)
        few = Draws(
            self.changes @ mean.T,
            self.rest @ mean.T,
            self.moments,
            self.frames @ mean.T,
            mean @ self.times,
            mean @ self.noise @ mean.T,
        )
        span = self.times[-1] - self.times[0]
        tried = list(product((share * span for share in LENGTHS), SHARES))
        length, share = tried[int(np.argmax([few.score(*one, WEIGHTS[0]) for one in tried]))]
        weight = WEIGHTS[int(np.argmax([few.score(length, share, one) for one in WEIGHTS]))]
        return length, share, weight

    def score(self, length: float, share: float, weight: float) -> float:
        """Sum over draws of the expected log density given the others."""
        kernel, total = matern(self.times, length), 0.0
        for i in range(len(self.changes)):
            others = np.arange(len(self.changes)) != i
            (mean, left), (gone, moving) = about(self.rest[others]), about(self.moments[others])
            moved, size = moving @ self.frames[i], envelope(left)
            second = (left.T @ left + weight * moved.T @ moved) / others.sum()
            draw = self.changes[i] - gone @ self.frames[i] - mean
            total += expected(second + share * size[:, None] * kernel * size, draw, self.noise)
        return total


def about(draws: Array) -> tuple[Array, Array]:
    """Mean (...) of draws (k, ...), and the draws about it, larger so that their second moment is a further draw's."""
    k, mean = len(draws), draws.mean(axis=0)
    return mean, (draws - mean) * np.sqrt((k + 1.0) / max(k - 1.0, 1.0))


def expected(covariance: Array, draw: Array, noise: Array) -> float:
    """Expected log density, but for a constant, of a draw (n,) with noise on it, under N(0, covariance + noise)."""
    try:
        lower = cholesky(covariance + noise, lower=True, check_finite=False)
    except LinAlgError:
        return -np.inf
    inverse = solve_triangular(lower, np.eye(len(lower)), lower=True, check_finite=False)
    whitened = inverse @ draw
    noisy = float(((inverse @ noise) * inverse).sum())
    return -0.5 * float(whitened @ whitened + noisy) - float(np.log(np.diag(lower)).sum())


def process(rest: Array, times: Array, length: float, share: float) -> Array:
    """(n, n) covariance under the envelope of draws (k, n), of a correlation length [s]."""
    size = envelope(rest)
    return share * size[:, None] * matern(times, length) * size


def envelope(rest: Array) -> Array:
    """(n,) smoothed root mean square of draws (k, n)."""
    width = max(3, round(ENVELOPE * rest.shape[1]))
    mean = uniform_filter1d((rest**2).mean(axis=0), width, mode="nearest")
    return np.sqrt(mean + (FLOOR * np.abs(rest).max()) ** 2)


def _means(n: int, most: int) -> Array:
    """(m, n) of means over neighbours, at most `most` of them."""
    block = -(-n // most)
    rows = np.repeat(np.arange(-(-n // block)), block)[:n]
    mean = (rows == np.arange(rows[-1] + 1)[:, None]).astype(float)
    return mean / mean.sum(axis=1, keepdims=True)


def matern(times: Array, length: float) -> Array:
    """Matern correlation 3/2 (Rasmussen & Williams, Gaussian Processes for Machine Learning, 2006, eq. 4.17)."""
    r = np.sqrt(3.0) * np.abs(times[:, None] - times) / length
    return (1.0 + r) * np.exp(-r)
