"""Correlation in time of a noise, from equally spaced readings: what it leaves of their number."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import correlate
from scipy.stats import chi2

from birdstrike.data.histories import Array

POINTS_A_FREEDOM = 2.0  # times tau
NORMAL_90 = 1.645  # standard deviations, one side, of 5 %
NOT_FIRST_ORDER = 0.05  # share of first-order processes that the test rejects
FITTED_SHARE = 0.5  # of the readings, at most, that fitted terms take from a correlated noise
ROUNDS = 20  # of what the fitted terms have taken, which converges as a geometric series
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


def density_freedom(points: float, tau: float) -> float:
    """Degrees of freedom of an estimate of variance times tau, the spectral density at frequency 0, from such noise.

    Of white noise behind CFC180 to CFC1000, 300 to 3000 points less two to five fitted parameters, 0 to 1.4 % exceed
    the 1 % limit of such a chi-square (2000 records each); with a degree every tau points 0 to 6 % would.
    """
    return points / (POINTS_A_FREEDOM * tau)


def hidden_tau(points: int) -> float:
    """The largest tau of a first-order noise that so many readings at rest miss once in twenty records.

    Its neighbours are then correlated by 1.64 standard deviations more than the limit beyond which noise is not white.
    """
    r = min((CORRELATED + NORMAL_90) / np.sqrt(max(points, 1)), 1.0)
    longest = max(FITTED_SHARE * points / 2.0, 1.0)  # by a straight line through them
    return min((1.0 + r) / (1.0 - r), longest) if r < 1.0 else longest


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
    Soc. Suppl. 8 (1946) 27).

    Of noise that is a first-order process r is rho_1. Else (1 + r) / (1 - r) = 1 + 2 sum rho_k over the first rho_k
    that are positive, so that means scatter as they do, and r <= rho_1. Noise that a filter has smoothed has a larger
    rho_1 than r, for its neighbours are alike and those farther apart are not. White noise with a slow drift has a
    smaller one: r = rho_1 keeps its white part.
    """

    neighbours: float = 0.0
    r: float = 0.0
    of_variance: float = 1.0

    @classmethod
    def of(cls, residual: Array, fitted: int = 0) -> Autocorrelation:
        """Of a residual (n,) about so many fitted terms; white unless the correlation of neighbours is clear."""
        n = len(residual)
        rho = autocorrelation(residual)
        if not rho[1] * np.sqrt(n) >= CORRELATED:
            return cls()
        largest = _largest(n, fitted)
        bias = (fitted + (fitted + 3.0) * rho[1]) / n  # Marriott and Pope, Biometrika 41 (1954) 390, of a mean
        first = max(float(rho[1]), min(float(rho[1] + bias), largest))
        if is_first_order(residual, first):
            return cls(first, first, (1.0 + first**2) / (1.0 - first**2))
        positive = _positive(rho, fitted, largest)
        total = float(positive.sum())
        return cls(first, min(first, total / (1.0 + total)), 1.0 + 2.0 * float(positive @ positive))

    @property
    def of_mean(self) -> float:
        """Factor on the variance that the mean of white noise has."""
        return (1.0 + self.r) / (1.0 - self.r)

    def time(self, step: float) -> float:
        """Correlation time [s], r = exp(-step/time), of readings `step` [s] apart; 0 where white."""
        return -step / float(np.log(self.r)) if self.r else 0.0


def counting_points(points: int, fitted: int, correlation: Autocorrelation) -> float:
    """The points that count in the variance about a fit: of correlated noise a fitted term takes more than one."""
    taken = fitted * correlation.of_mean
    return points - (min(taken, FITTED_SHARE * points) if correlation.r else taken)


def is_first_order(residual: Array, r: float) -> bool:
    """Whether x_i - r x_{i-1} of a residual x (n,) is white (Ljung and Box, Biometrika 65 (1978) 297, at 5 %).

    Over as many lags as a mean of as many readings has that is correlated alike.
    """
    innovations = residual[1:] - r * residual[:-1]
    n = len(innovations)
    lags = np.arange(1, max(min(int((1.0 + r) / (1.0 - r)), n // 4), 2) + 1)
    q = n * (n + 2.0) * float((autocorrelation(innovations)[lags] ** 2 / (n - lags)).sum())
    return bool(chi2.sf(q, len(lags) - 1) > NOT_FIRST_ORDER)


def _largest(n: int, fitted: int) -> float:
    """The largest r that a correction may give: the fitted terms then take half of what n readings are worth."""
    of_mean = max(FITTED_SHARE * n / max(fitted, 1), 1.0)
    return (of_mean - 1.0) / (of_mean + 1.0)


def _positive(rho: Array, fitted: int, largest: float) -> Array:
    """The first positive rho_k, k >= 1, of a noise whose residual about so many fitted terms has rho (n,).

    Each term takes the variance of a mean, tau / n of the noise's, from the covariance at every lag: the fewer and the
    more alike the readings, the shorter the residual is correlated.
    """
    n, found = len(rho), rho[1:2]
    for _ in range(ROUNDS):
        total = float(found.sum())
        r = min(total / (1.0 + total), float(found[0]), largest)
        lost = min(fitted * (1.0 + r) / (1.0 - r) / n, FITTED_SHARE)
        raised = rho[1 : n // 2] * (1.0 - lost) + lost
        found = raised[: np.append(np.flatnonzero(raised <= 0.0), len(raised))[0]]
    return found


WHITE = Autocorrelation()
