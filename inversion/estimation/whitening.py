"""Residuals in units of their own uncertainty, and whether those of the best fit are noise.

Uncertainty: noise of each point plus errors common to many. n points whose errors are correlated over tau points are
worth n / tau independent points, and errors `fit` times larger than stated as much as fit^2 fewer; intervals that took
them for white noise would be sqrt(fit^2 tau) too narrow. What of a misfit the parameters can imitate never reaches the
residual: beside one as slow as the curve itself, the widened intervals are still too narrow.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import svd
from scipy.stats import chi2
from scipy.stats import f as f_distribution

from birdstrike.data.histories import Array
from birdstrike.inversion.misfit import rms
from birdstrike.inversion.observations.autocorrelation import (
    autocorrelation,
    correlated,
    density_freedom,
    integrated,
    uncorrelated,
)
from birdstrike.inversion.observations.observations import Channel, Observations
from birdstrike.inversion.results.fit import ResidualCorrelation

FEWEST_POINTS = 20
LOST = 1e10  # variance in units of the noise's beside which that of 1 has six digits left in a covariance
MANY = 200  # columns, beyond which the products of all pairs are quicker than singular values
FELT = 1e-6  # in variances of the noise: what lies along a direction below changes by less than a millionth
INSTANTS = 250  # of a channel, that carry a slow error
REJECT = 1e-3
# White noise passes either limit in 0.5 to 2 of a thousand records of 20 to 2000 points (10 000 drawn of each length).
LAGS, LAGS_LIMIT = 3, 6.0
TAU_LIMIT = 75.0
CHANCE = 0.01  # share of records whose noise alone gives a larger residual
WELL_KNOWN = 1e9  # degrees of freedom: scipy knows no F distribution of infinitely many


@dataclass(frozen=True)
class Whitening:
    """W with W Sigma W^T = I for Sigma = C + F F^T, C the covariance of the noise.

    noise: (n,) standard deviations; correlation: (n,) of each point's noise with that of the point before, as a
    first-order process has it; directions: (n, min(n, c)) orthonormal, shrink: (min(n, c),), from the singular values s
    of C^(-1/2) F: W = (I - Q diag(1 - 1/sqrt(1 + s^2)) Q^T) C^(-1/2) with the root of `uncorrelated`. An n x n matrix
    is formed only where F has more columns than rows.
    """

    noise: Array
    correlation: Array
    directions: Array
    shrink: Array
    log_determinant: float

    @classmethod
    def of(cls, noise: Array, factor: Array, correlation: Array | None = None) -> Whitening:
        """From noise (n,), factor F (n, c) and the noise's correlation (n,), none by default."""
        rho = np.zeros(len(noise)) if correlation is None else correlation
        directions, variances = principal(uncorrelated((factor / noise[:, None]).T, rho).T)
        log_determinant = float(np.log1p(variances).sum() + 2.0 * np.log(noise).sum() + np.log1p(-(rho**2)).sum())
        return cls(noise, rho, directions, 1.0 - 1.0 / np.sqrt(1.0 + variances), log_determinant)

    def apply(self, rows: Array) -> Array:
        """W x for every row x of rows (..., n)."""
        scaled = uncorrelated(rows / self.noise, self.correlation)
        return scaled - ((scaled @ self.directions) * self.shrink) @ self.directions.T


def principal(factor: Array) -> tuple[Array, Array]:
    """Orthonormal directions (n, q) and variances (q,) with F F^T = directions diag(variances) directions^T, q no more
    than n and c, of a factor F (n, c)."""
    n, c = factor.shape
    if c > MANY and (factor**2).sum() < LOST:
        if c > n:  # 0.9 s for 3.9 (1940 x 4043)
            variances, directions = np.linalg.eigh(factor @ factor.T)
            return directions, np.maximum(variances, 0.0)
        variances, vectors = np.linalg.eigh(factor.T @ factor)  # 0.2 s for 0.9 (3000 x 720)
        kept = variances > FELT
        return factor @ vectors[:, kept] / np.sqrt(variances[kept]), variances[kept]
    try:
        directions, s, _ = np.linalg.svd(factor, full_matrices=False)
    except np.linalg.LinAlgError:  # the divide and conquer sometimes fails on hundreds of nearly null directions
        directions, s, _ = svd(factor, full_matrices=False, lapack_driver="gesvd")
    return directions, s * s


def factor_of(covariance: Array, least: float) -> Array:
    """F (n, q) with F F^T = a covariance (n, n), but for directions of less than the share `least` of its variance."""
    values, vectors = np.linalg.eigh(covariance)
    kept = values > least * values.sum()
    return vectors[:, kept] * np.sqrt(values[kept])


def factor_between(covariance: Callable[[Array, Array], Array], times: Array, least: float) -> Array:
    """`factor_of` a process with a covariance (n, m) of `times` (n,) and others (m,), found at `INSTANTS` of them,
    equally far apart in time, whatever the rate at which the record was taken.

    F = C(t, s) V L^(-1/2) with the eigenvalues L and vectors V of C(s, s) (Nystroem: Rasmussen and Williams, Gaussian
    Processes for Machine Learning, MIT 2006, sect. 8.1), where the process is smooth between the instants s.
    """
    if len(times) <= INSTANTS:
        return factor_of(covariance(times, times), least)
    places = np.unique(np.searchsorted(times, np.linspace(times[0], times[-1], INSTANTS)))
    factor = factor_of(covariance(times[places], times[places]), least)
    return covariance(times, times[places]) @ factor / (factor**2).sum(axis=0)


def widened(observations: Observations, residual: ResidualCorrelation) -> Observations:
    """The observations with their noise enlarged by the residual's correlation and size."""
    raised = (replace(c, noise=c.noise * residual.widened[c.name]) for c in observations.channels)
    return replace(observations, channels=tuple(raised))


def residual_correlation(observations: Observations, residual: Array) -> ResidualCorrelation:
    """Judge the whitened residual (n,) of the best fit channel by channel; gaps between instants are ignored.

    A channel is widened when its residual is clearly correlated, or larger than noise by a chi-square test at 0.1 %.
    Where its noise is known to be correlated, the residual is widened by its excess over that.
    """
    parts = observations.split(residual)
    found = {c.name: _judged(parts[c.name], c) for c in observations.channels}
    tau, fit, widened, by_chance = ({name: figures[i] for name, figures in found.items()} for i in range(4))
    return ResidualCorrelation(tau, fit, widened, by_chance)


def _judged(white: Array, channel: Channel) -> tuple[float, float, float, float]:
    """Correlation, size and factor on the noise of a channel's whitened residual (n,), and the factor by chance."""
    tau, known, errors = autocorrelation_time(white), 1.0, correlated(white, channel.correlation)
    expected = tau > 1.0 and (channel.filtered or channel.correlation_time > 0.0)
    if expected:
        # Noise without its fast part, as a filter leaves it, is not whitened over few points: over many it counts.
        tau, known = integrated(autocorrelation(errors)), channel.tau
    own = density_freedom(len(white), tau) if tau > 1.0 else len(white)
    tau = tau if tau > known else 1.0
    fit, larger = rms(errors), chi2.sf(white @ white, len(white)) < REJECT
    excess = max(1.0, tau / known)
    factor = float(max(1.0, fit * np.sqrt(excess))) if excess > 1.0 or larger else 1.0
    if expected or tau == 1.0:
        return tau, fit, factor, _by_chance(own, channel)
    hidden = channel.hidden_tau
    return tau, fit, factor, float(np.sqrt(hidden)) * _by_chance(own, channel) if hidden > 1.0 else 1.0


def _by_chance(freedom: float, channel: Channel) -> float:
    """The factor that the noise of a channel exceeds once in a hundred records, by so many degrees of freedom."""
    known = min(channel.freedom, WELL_KNOWN)
    return float(np.sqrt(max(f_distribution.isf(CHANCE, freedom, known), 1.0)))


def autocorrelation_time(residual: Array) -> float:
    """tau = 1 + 2 sum_k rho_k of a residual (n,) about zero, in points; 1 unless it is clearly above white noise's.

    Clearly: rho_1 + rho_2 + rho_3 > 6 / sqrt(n), 3.5 of white noise's standard deviations, or
    tau > 1 + 75 / sqrt(n), which finds the weak but long. With fewer than 20 points: 1.
    """
    n = len(residual)
    if n < FEWEST_POINTS or not residual.any():
        return 1.0
    rho = autocorrelation(residual)
    tau = integrated(rho)
    clear = rho[1 : LAGS + 1].sum() > LAGS_LIMIT / np.sqrt(n) or tau > 1.0 + TAU_LIMIT / np.sqrt(n)
    return max(tau, 1.0) if clear else 1.0
