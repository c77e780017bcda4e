"""What the discretisation does to the curves, as a covariance of the model's error.

Two parts. *Draws*: at several places of the parameters' box the strike is made twice, as declared and on a finer mesh
with another lattice lying otherwise in the bird's outline; the changes are draws of what a finer strike will differ by.
*Choices* that the draws leave alone (artificial viscosity, smoothing length; the contact's gap goes with the particle
spacing) are changed once each, and the change d of the curves enters as d d^T.

A few draws span little; their second moment is therefore widened by a stationary process under their envelope, whose
share and length are those that predict each draw best from the others.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.linalg import LinAlgError, cholesky, solve_triangular
from scipy.ndimage import uniform_filter1d

from data.histories import Array
from inversion.diagnosis.finer import CHOICES

LENGTHS = tuple(1.0 / 2.0**k for k in range(2, 8))  # of the record: correlation lengths that are tried
SHARES = (0.01, 0.03, 0.1, 0.3, 1.0)  # of the draws' variance: shares of the process that are tried
ENVELOPE = 0.05  # of the record: over which the envelope is smoothed
FLOOR = 1e-3  # of the largest change: no instant is free of error
POINTS = 100  # means over neighbours, on which length and share are chosen


@dataclass(frozen=True)
class Numerical:
    """Numerical error on the model's clock, all channels stacked (grid,).

    draws: (k, grid) changes by finer strikes; directions: name of a choice -> its change d (grid,); correlation: per
    channel, the time [s] over which what is rough in the draws hangs together.
    """

    draws: Array
    directions: Mapping[str, Array]
    correlation: tuple[float, ...]

    @classmethod
    def of(cls, changes: Mapping[str, Array], time: Array, channels: int) -> Numerical:
        """From the changes (grid,) of the curves by name."""
        draws = [d for name, d in changes.items() if name not in CHOICES]
        stacked = np.stack(draws) if draws else np.zeros((0, channels * len(time)))
        step = float(time[1] - time[0])
        correlation = tuple(_correlation_time(_beyond(part), step) for part in np.split(stacked, channels, axis=1))
        return cls(stacked, {name: d for name, d in changes.items() if name in CHOICES}, correlation)

    def covariance(
        self, sample: Callable[[Array], Array], times: Array, channel: np.ndarray, measurement: Array
    ) -> Array:
        """(n, n) on the record's points.

        sample: curves (q, grid) to points (q, n); times [s], channel: of every point; measurement: (n, n) of the
        noise, beside which the process is judged.
        """
        n = len(times)
        found = np.zeros((n, n))
        if self.directions:
            d = sample(np.stack(list(self.directions.values())))
            found += d.T @ d
        if not len(self.draws):
            return found
        draws = sample(self.draws)
        found += draws.T @ draws / len(draws)
        for number in np.unique(channel):
            here = np.flatnonzero(channel == number)
            block = np.ix_(here, here)
            found[block] += best_process(draws[:, here], times[here], measurement[block])
        return found

    @property
    def sizes(self) -> dict[str, Array]:
        """Name -> (grid,) typical change of the curves, for the user."""
        shown = {f"finer meshes on other lattices ({len(self.draws)} draws)": np.sqrt(np.mean(self.draws**2, axis=0))}
        return {**(shown if len(self.draws) else {}), **self.directions}


def best_process(draws: Array, times: Array, noise: Array) -> Array:
    """(n, n) covariance of the process under the envelope of draws (k, n) that predicts each from the others best.

    Score: expected log density of a draw with noise on it, N(0, second moment of the others + process + noise). One
    draw alone has nobody to be predicted from; it gets the widest process that is tried.
    """
    tried = list(product((share * (times[-1] - times[0]) for share in LENGTHS), SHARES))
    if len(draws) < 2:
        return _process(draws, times, tried[0][0], SHARES[-1])
    mean = _means(len(times))
    few, middle, quiet = draws @ mean.T, mean @ times, mean @ noise @ mean.T
    scores = [_predicts(few, middle, length, share, quiet) for length, share in tried]
    return _process(draws, times, *tried[int(np.argmax(scores))])


def _means(n: int) -> Array:
    """(m, n) of means over neighbours, at most POINTS of them."""
    block = -(-n // POINTS)
    rows = np.repeat(np.arange(-(-n // block)), block)[:n]
    mean = (rows == np.arange(rows[-1] + 1)[:, None]).astype(float)
    return mean / mean.sum(axis=1, keepdims=True)


def _predicts(draws: Array, times: Array, length: float, share: float, noise: Array) -> float:
    """Sum over draws of the expected log density given the others."""
    total = 0.0
    for i, own in enumerate(draws):
        others = np.delete(draws, i, axis=0)
        try:
            covariance = others.T @ others / len(others) + _process(others, times, length, share) + noise
            lower = cholesky(covariance, lower=True)
        except LinAlgError:
            return -np.inf
        inverse = solve_triangular(lower, np.eye(len(lower)), lower=True)
        whitened = inverse @ own
        expected_noise = float(((inverse @ noise) * inverse).sum())
        total += -0.5 * (whitened @ whitened + expected_noise) - float(np.log(np.diag(lower)).sum())
    return total


def _process(draws: Array, times: Array, length: float, share: float) -> Array:
    """Covariance under the draws' smoothed root mean square, of a correlation length [s]."""
    width = max(3, round(ENVELOPE * draws.shape[1]))
    mean = uniform_filter1d((draws**2).mean(axis=0), width, mode="nearest")
    envelope = np.sqrt(mean + (FLOOR * np.abs(draws).max()) ** 2)
    return share * envelope[:, None] * _matern(times, length) * envelope


def _matern(times: Array, length: float) -> Array:
    """Matern correlation 3/2 (Rasmussen & Williams, Gaussian Processes for Machine Learning, 2006, eq. 4.17)."""
    r = np.sqrt(3.0) * np.abs(times[:, None] - times) / length
    return (1.0 + r) * np.exp(-r)


def _beyond(draws: Array) -> Array:
    """What the other draws do not span of each."""
    if len(draws) < 2:
        return draws
    rest = []
    for i, own in enumerate(draws):
        others = np.delete(draws, i, axis=0).T
        rest.append(own - others @ np.linalg.lstsq(others, own, rcond=1e-8)[0])
    return np.stack(rest)


def _correlation_time(rest: Array, step: float) -> float:
    """Length l [s] of exp(-lag^2 / 2 l^2) that has the rest's correlation at a lag of 2."""
    total = float((rest**2).sum())
    if total == 0.0:
        return step
    rho = max(float((rest[:, 2:] * rest[:, :-2]).sum()) / total, 0.05)
    return 2.0 * step / np.sqrt(-2.0 * np.log(min(rho, 0.995)))
