"""Hyperparameters of a Gaussian process: their posterior mean, not the most likely values.

A few dozen runs leave the length scales and the scatter of the runs uncertain, and the most likely values are then
overconfident (often no scatter at all). The posterior is flat in the logarithms over the allowed ranges, the variance
is integrated out with the prior 1/variance: p ~ |K|^(-1/2) (y^T K^-1 y)^(-n/2). It is found by adaptive multiple
importance sampling: every round draws about what all rounds before found, and all draws count by the mixture of all
proposals (Cornuet et al., Scand. J. Statist. 39 (2012) 798), the first of which covers the whole ranges, so that a
second mode is not lost. Rasmussen and Williams 2006, sect. 5.2.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.special import chdtri, ndtri
from scipy.stats import multivariate_t, qmc

from birdstrike.data.histories import Array

LENGTHS = (0.2, 1e2)
"""Of the scaled features: a few dozen runs in several dimensions lie about half a range apart and cannot show anything
shorter; a feature without influence goes to the upper end."""
SCATTER = (1e-6, 2.0)  # variance of the runs' scatter over that of the smooth part
DRAWS, FEWEST_ROUNDS, MOST_ROUNDS = 256, 5, 20
ENOUGH = 100.0
"""Draws that the weighted ones must be worth before rounds end: with less, intervals depend on the seed."""
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
    likelihood, proposals = _log_likelihood(u, y, points), list[_Student]()
    uniform = -np.log(np.ptp(bounds, axis=1)).sum()
    density = np.full(DRAWS, uniform)
    for number in range(MOST_ROUNDS):
        log_weights = likelihood - density
        if number >= FEWEST_ROUNDS and _worth(_weights(log_weights)) >= ENOUGH:
            break
        proposals.append(_Student.about(points, _tempered(log_weights, 4.0 * (d + 1))))
        drawn = proposals[-1].draw(rng)
        inside = ((drawn >= bounds[:, 0]) & (drawn <= bounds[:, 1])).all(axis=1)
        points = np.vstack([points, drawn[inside]])
        likelihood = np.append(likelihood, _log_likelihood(u, y, drawn[inside]))
        density = np.logaddexp.reduce([np.full(len(points), uniform), *(one.log_density(points) for one in proposals)])
    return points, _tempered(likelihood - density, 1.0)


@dataclass(frozen=True)
class _Student:
    """Student's t with HEAVY degrees of freedom in p dimensions: centre (p,), factor (p, p) of its scale matrix."""

    centre: Array
    factor: Array

    @classmethod
    def about(cls, points: Array, weights: Array) -> _Student:
        """A little wider than weighted points (q, p)."""
        scale = 1.2 * np.cov(points.T, aweights=weights) + 1e-4 * np.eye(points.shape[1])
        return cls(weights @ points, np.linalg.cholesky(scale))

    def draw(self, rng: np.random.Generator) -> Array:
        """(DRAWS, p) evenly spread."""
        p = len(self.centre)
        unit = np.clip(qmc.Sobol(p + 1, rng=rng).random(DRAWS), 1e-9, 1.0 - 1e-9)
        heavy = ndtri(unit[:, :p]) / np.sqrt(chdtri(HEAVY, unit[:, p]) / HEAVY)[:, None]
        return self.centre + heavy @ self.factor.T

    def log_density(self, points: Array) -> Array:
        """(q,) at points (q, p)."""
        known: Any = multivariate_t  # its stubs take integers alone
        return np.asarray(known.logpdf(points, self.centre, self.factor @ self.factor.T, HEAVY))


def _weights(log_weights: Array) -> Array:
    """Normalised."""
    weights = np.exp(log_weights - log_weights.max())
    return weights / weights.sum()


def _worth(weights: Array) -> float:
    """Equally weighted draws that are as good."""
    return float(1.0 / (weights**2).sum())


def _tempered(log_weights: Array, least: float) -> Array:
    """Normalised weights, flattened until they are worth `least` points."""
    power = 1.0
    while True:
        weights = _weights(power * log_weights)
        if _worth(weights) >= least or power < 1e-3:
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


def matern(distance: Array) -> Array:
    """Matern correlation of order 5/2 at a distance over the lengths; Rasmussen and Williams 2006, eq. 4.17."""
    r = np.sqrt(5.0) * distance
    return (1.0 + r * (1.0 + r / 3.0)) * np.exp(-r)


def _matrices(u: Array, points: Array) -> Array:
    """(q, n, n) Matern 5/2 correlation plus scatter on the diagonal."""
    squares = (u[:, None, :] - u[None, :, :]) ** 2
    matrices = matern(np.sqrt(np.einsum("ijd,qd->qij", squares, np.exp(-2.0 * points[:, :-1]))))
    i = np.arange(len(u))
    matrices[:, i, i] += np.exp(points[:, -1])[:, None] + 1e-10
    return matrices
