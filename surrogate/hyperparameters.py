"""Hyperparameters of a Gaussian process: their posterior mean, not the most likely values.

A few dozen runs leave the length scales and the scatter of the runs uncertain, and the most likely values are then
overconfident (often no scatter at all). The posterior is flat in the logarithms over the allowed ranges, the variance
is integrated out with the prior 1/variance: p ~ |K|^(-1/2) (y^T K^-1 y)^(-n/2). It is found by adaptive importance
sampling (Bugallo et al., IEEE Signal Processing Magazine 34 (2017) 60). Rasmussen and Williams 2006, sect. 5.2.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import solve_triangular
from scipy.stats import qmc

from birdstrike.data.histories import Array

LENGTHS = (0.2, 1e2)
"""Of the scaled features: a few dozen runs in several dimensions lie about half a range apart and cannot show anything
shorter; a feature without influence goes to the upper end."""
SCATTER = (1e-6, 2.0)  # variance of the runs' scatter over that of the smooth part
DRAWS, ROUNDS = 256, 5
HEAVY = 5.0  # degrees of freedom of the proposals, heavier in the tails than the posterior
LARGEST_BATCH = 4_000_000  # elements of the matrices that are handled at once


def hyperparameters(u: Array, y: Array, seed: int = 0) -> tuple[float, Array, float]:
    """Variance, lengths (d,) and scatter (variance) of y (n,) at features u (n, d).

    Lengths by the posterior mean of their logarithms; scatter over variance, which enters a prediction's variance as it
    is, by its posterior mean; the variance is the likeliest at these.
    """
    points, weights = _posterior(u, y, seed)
    lengths, ratio = weights @ points[:, :-1], float(weights @ np.exp(points[:, -1]))
    matrix = _matrices(u, np.append(lengths, np.log(ratio))[None])[0]
    variance = float(y @ np.linalg.solve(matrix, y)) / len(y)
    return variance, np.exp(lengths), ratio * variance


def _posterior(u: Array, y: Array, seed: int) -> tuple[Array, Array]:
    """Points (q, d + 1), logarithms of lengths and scatter ratio, and their weights."""
    d = u.shape[1]
    bounds = np.log(np.array([LENGTHS] * d + [SCATTER]))
    rng = np.random.default_rng(seed)
    points = bounds[:, 0] + qmc.Sobol(d + 1, rng=rng).random(DRAWS) * np.ptp(bounds, axis=1)
    log_weights = _log_likelihood(u, y, points)
    for _ in range(ROUNDS):
        weights = _tempered(log_weights, 4.0 * (d + 1))
        centre = weights @ points
        factor = np.linalg.cholesky(1.2 * np.cov(points.T, aweights=weights) + 1e-4 * np.eye(d + 1))
        heavy = rng.normal(size=(DRAWS, d + 1)) / np.sqrt(rng.chisquare(HEAVY, DRAWS) / HEAVY)[:, None]
        drawn = centre + heavy @ factor.T
        inside = ((drawn >= bounds[:, 0]) & (drawn <= bounds[:, 1])).all(axis=1)
        if inside.sum() <= d + 1:
            break
        points = drawn[inside]
        away = solve_triangular(factor, (points - centre).T, lower=True)
        proposed = -0.5 * (HEAVY + d + 1) * np.log1p((away**2).sum(axis=0) / HEAVY)
        log_weights = _log_likelihood(u, y, points) - proposed
    return points, _tempered(log_weights, 1.0)


def _tempered(log_weights: Array, least: float) -> Array:
    """Normalised weights, flattened until they are worth `least` points."""
    power = 1.0
    while True:
        weights = np.exp(power * (log_weights - log_weights.max()))
        weights /= weights.sum()
        if 1.0 / (weights**2).sum() >= least or power < 1e-3:
            return weights
        power *= 0.7


def _log_likelihood(u: Array, y: Array, points: Array) -> Array:
    """(q,) of y (n,), the variance integrated out."""
    n = len(y)
    parts: list[Array] = []
    step = max(1, LARGEST_BATCH // n**2)
    for begin in range(0, len(points), step):
        factor = np.linalg.cholesky(_matrices(u, points[begin : begin + step]))
        white = np.linalg.solve(factor, np.broadcast_to(y[:, None], (len(factor), n, 1)))[..., 0]
        halves = np.log(np.diagonal(factor, axis1=1, axis2=2)).sum(axis=1)
        parts.append(-halves - 0.5 * n * np.log((white**2).sum(axis=1) / n))
    return np.concatenate(parts)


def _matrices(u: Array, points: Array) -> Array:
    """(q, n, n) Matern 5/2 correlation plus scatter on the diagonal."""
    squares = (u[:, None, :] - u[None, :, :]) ** 2
    r = np.sqrt(5.0 * np.einsum("ijd,qd->qij", squares, np.exp(-2.0 * points[:, :-1])))
    matrices = (1.0 + r * (1.0 + r / 3.0)) * np.exp(-r)
    i = np.arange(len(u))
    matrices[:, i, i] += np.exp(points[:, -1])[:, None] + 1e-10
    return matrices
