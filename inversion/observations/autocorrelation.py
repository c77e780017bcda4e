"""Correlation in time of a noise, from equally spaced readings: what it leaves of their number."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import correlate

from birdstrike.data.histories import Array

CORRELATED = 2.6  # lag-1 correlation times sqrt(n): beyond it the noise is not white (0.5 % of white records)


def autocorrelation(residual: Array) -> Array:
    """(n,) rho_k of a residual (n,) about zero at k points' distance."""
    products = correlate(residual, residual, method="fft")[len(residual) - 1 :]
    return products / products[0]


def integrated(rho: Array) -> float:
    """tau = 1 + 2 sum_k rho_k of autocorrelations (n,): n points are worth n / tau independent ones.

    The sum ends at the first pair rho_2m + rho_2m+1 <= 0 (initial positive sequence: Geyer, Statistical Science 7
    (1992) 473, sect. 3.3).
    """
    pairs = rho[: len(rho) - len(rho) % 2].reshape(-1, 2).sum(axis=1)
    ended = np.append(np.flatnonzero(pairs <= 0.0), len(pairs))[0]
    return 2.0 * float(pairs[:ended].sum()) - 1.0


def neighbour_correlation(times: Array, correlation_time: float) -> Array:
    """(n,) correlation exp(-dt/time) of each point's noise with that of the point before; 0 at the first, and of white
    noise."""
    if not correlation_time:
        return np.zeros(len(times))
    return np.append(0.0, np.exp(-np.diff(times) / correlation_time))


def uncorrelated(rows: Array, correlation: Array) -> Array:
    """White noise from that of a first-order process, for every row x of rows (..., n) in standard deviations.

    u_i = (x_i - rho_i x_{i-1}) / sqrt(1 - rho_i^2), rho_i (n,) the correlation with the point before: u = L^-1 x with
    the Cholesky factor L of the correlations exp(-|t_i - t_j|/time).
    """
    if not correlation.any():
        return rows
    before = np.concatenate([np.zeros_like(rows[..., :1]), rows[..., :-1]], axis=-1)
    return (rows - correlation * before) / np.sqrt(1.0 - correlation**2)


def correlated(white: Array, correlation: Array) -> Array:
    """The inverse of `uncorrelated` for rows (..., n): noise of a first-order process, in standard deviations."""
    found, fresh = white.copy(), np.sqrt(1.0 - correlation**2)
    for i in np.flatnonzero(correlation):
        found[..., i] = correlation[i] * found[..., i - 1] + fresh[i] * white[..., i]
    return found


@dataclass(frozen=True)
class Autocorrelation:
    """The first-order process r^k that stands for a noise, k readings apart.

    neighbours: correlation rho_1 of neighbouring readings; r: of the process; both 0 where the noise is white;
    of_variance: factor 1 + 2 sum rho_k^2 on the variance that the variance of white noise has (Bartlett, J. R. Stat.
    Soc. Suppl. 8 (1946) 27), over the same k.

    (1 + r) / (1 - r) = 1 + 2 sum rho_k over the first rho_k that are positive, so that means scatter as they do, and
    r <= rho_1. Noise that a filter has smoothed has a larger rho_1 than r, for its neighbours are alike and those
    farther apart are not. White noise with a slow drift has a smaller one: r = rho_1 keeps its white part.
    """

    neighbours: float = 0.0
    r: float = 0.0
    of_variance: float = 1.0

    @classmethod
    def of(cls, residual: Array) -> Autocorrelation:
        """Of a residual (n,) about zero; white unless the correlation of neighbours is clear."""
        n = len(residual)
        rho = autocorrelation(residual)[1:]
        if not rho[0] * np.sqrt(n) >= CORRELATED:
            return cls()
        rho = rho[: np.append(np.flatnonzero(rho <= 0.0), n - 1)[0]]
        first, total = float(rho[0]), float(rho.sum())
        return cls(first, min(first, total / (1.0 + total)), 1.0 + 2.0 * float(rho @ rho))

    @property
    def of_mean(self) -> float:
        """Factor on the variance that the mean of white noise has."""
        return (1.0 + self.r) / (1.0 - self.r)

    def time(self, step: float) -> float:
        """Correlation time [s], r = exp(-step/time), of readings `step` [s] apart; 0 where white."""
        return -step / float(np.log(self.r)) if self.r else 0.0


WHITE = Autocorrelation()
