"""Gaussian algebra of the evidence: products of the columns under any error, directions integrated out, magnitudes.

With C = 1 + a^2 U in the coordinates of `system.Block`, X^T C^-1 X costs a weighted sum of products; parameters and
errors of known prior variance are integrated out of it by a Schur complement. Of the magnitudes that stay some cannot
be negative: their distribution is normal, cut off at 0.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.polynomial.legendre import leggauss
from scipy.integrate import cumulative_trapezoid
from scipy.linalg import cho_factor, cho_solve
from scipy.special import erfcx, log_ndtr, ndtri_exp, softmax

from birdstrike.data.histories import Array, Indices
from birdstrike.inversion.diagnosis.inference.hypotheses import CandidateEffect
from birdstrike.inversion.diagnosis.inference.system import Block

MANY = 64  # columns integrated out, from which on Cholesky factors pay, one node after the other
LEGENDRE = leggauss(32)
ROOTS = 0.5 * (LEGENDRE[0] + 1.0)
NODES, LOG_WEIGHTS = ROOTS**3, np.log(1.5 * LEGENDRE[1] * ROOTS**2)
"""On 0..1: shares of the distribution of one of two magnitudes that cannot be negative, and their weights. They are
dense near 0: of two effects with one signature, which the data call negative, nearly all lies there."""
FARTHEST = 10.0  # standard deviations from where a cut-off variable may lie at best
CELLS = 1000  # of a grid over its density
CLOSING_IN = 4  # grids, each a thousandth of the last one where the density is that narrow
LEAST_LOG_DENSITY = -35.0  # of the largest: beyond, less than rounding


@dataclass(frozen=True)
class Grams:
    """X^T C^-1 X of any columns at any combination of amplitudes. x: (p, m) of each kind, in its diagonal coordinates;
    weights: (nodes, p) of each kind; index: (combinations,) node of each kind; logdet: (combinations,) log det C.
    """

    x: tuple[Array, ...]
    weights: tuple[Array, ...]
    index: tuple[np.ndarray, ...]
    logdet: Array

    @classmethod
    def of(cls, blocks: Sequence[Block], columns: Array, combinations: Array) -> Grams:
        """From the blocks' diagonal coordinates."""
        x, weights, indices, logdet = [], [], [], np.zeros(len(combinations))
        for i, block in enumerate(blocks):
            values, index = np.unique(combinations[:, i], return_inverse=True)
            x.append(block.T @ columns[block.rows])
            weights.append(1.0 / (1.0 + values[:, None] ** 2 * block.lam))
            indices.append(index)
            logdet += (block.logdet - np.log(weights[-1]).sum(axis=1))[index]
        return cls(tuple(x), tuple(weights), tuple(indices), logdet)

    def at(self, nodes: Indices, columns: Sequence[int]) -> Array:
        """(nodes, q, q) of some columns."""
        return next(whole for _, whole in self.in_parts(nodes, columns, len(nodes)))

    def in_parts(self, nodes: Indices, columns: Sequence[int], step: int) -> Iterator[tuple[slice, Array]]:
        """The same for `step` nodes after the other, with their places among `nodes`."""
        each = []
        for x, weights, index in zip(self.x, self.weights, self.index, strict=True):
            own = x[:, np.asarray(columns)]
            used, back = np.unique(index[nodes], return_inverse=True)
            roots = np.sqrt(weights[used])[:, :, None] * own
            each.append((roots.transpose(0, 2, 1) @ roots, back))
        for first in range(0, len(nodes), step):
            part, whole = slice(first, first + step), 0.0
            for products, back in each:
                whole = whole + products[back[part]]
            yield part, np.asarray(whole)

    def node(self, number: int) -> Array:
        """(m, m) of one combination, all columns."""
        return self.at(np.array([number]), range(self.x[0].shape[1]))[0]


@dataclass(frozen=True)
class Directions:
    """What is integrated out beside a model's magnitudes. columns: (r,) of the system: the free directions, then what
    is not known of the members' signatures; errors: prior deviations of the latter."""

    columns: Indices
    errors: Array


@dataclass(frozen=True)
class Information:
    """Some columns with parameters, unnamed errors and errors of signatures integrated out, at some nodes.

    S: (nodes, c, c) their information; logdet: (nodes,).
    """

    S: Array
    logdet: Array

    def of(self, columns: Sequence[int]) -> Information:
        """Of some of the columns, the residual first."""
        at = np.asarray(columns)
        return Information(self.S[:, at[:, None], at], self.logdet)

    def at(self, nodes: Indices, columns: Sequence[int]) -> Information:
        """Of some of the columns, the residual first, at some of the nodes."""
        at = np.asarray(columns)
        return Information(self.S[nodes[:, None, None], at[:, None], at], self.logdet[nodes])


@dataclass(frozen=True)
class Reduced(Information):
    """The same with what the directions were. W: (nodes, r, c) what they take of the columns; V: (nodes, k, k)
    covariance of the parameters, the columns known.
    """

    W: Array
    V: Array


def integrated(whole: Array, d: Array) -> tuple[Array, Array, Array]:
    """S (nodes, c, c), W (nodes, r, c), log det (nodes,) of `Reduced`: the first r columns integrated out.

    whole: (nodes, r + c, r + c) X^T C^-1 X; d: (nodes, r) prior standard deviations.
    """
    r = d.shape[1]
    own = d[:, :, None] * whole[:, :r, :r] * d[:, None, :] + np.eye(r)
    cross = d[:, :, None] * whole[:, :r, r:]
    if r < MANY:
        W, logdet = np.linalg.solve(own, cross), np.linalg.slogdet(own)[1]
    else:
        factor = cho_factor(own, lower=True, overwrite_a=True, check_finite=False)
        W = cho_solve(factor, cross, check_finite=False)
        logdet = 2.0 * np.log(np.einsum("nrr->nr", factor[0])).sum(axis=1)
    return whole[:, r:, r:] - cross.transpose(0, 2, 1) @ W, W, logdet


def covariance_of(information: Array, d: Array) -> Array:
    """(nodes, r, r) posterior covariance, by the information (nodes, r, r) and prior deviations d (nodes, r)."""
    own = d[:, :, None] * information * d[:, None, :] + np.eye(d.shape[1])
    return d[:, :, None] * np.linalg.inv(own) * d[:, None, :]


def log_mass_above_zero(members: Sequence[CandidateEffect], best: Array, covariance: Array) -> Array:
    """(...) log of 2 for each magnitude that cannot be negative, times the probability that none is; best (..., q)."""
    sided = [i for i, one in enumerate(members) if one.one_sided]
    if not sided:
        return np.zeros(best.shape[:-1])
    sd = np.sqrt(np.einsum("...ii->...i", covariance))
    if len(sided) == 1:
        return np.log(2.0) + log_ndtr(best[..., sided[0]] / sd[..., sided[0]])
    quadrant = _Quadrant.of(best / sd, covariance[..., 0, 1] / (sd[..., 0] * sd[..., 1]))
    return 2.0 * np.log(2.0) + quadrant.log_probability


def cut_off_at_zero(members: Sequence[CandidateEffect], mean: Array, covariance: Array) -> tuple[Array, Array]:
    """Mean (..., n), covariance with the members (..., n, q) of normal variables, one-sided members cut off at 0."""
    sided = [i for i, one in enumerate(members) if one.one_sided]
    if len(sided) == 1:
        return _one_cut_off(mean, covariance, sided[0])
    return _both_cut_off(mean, covariance) if sided else (mean, covariance)


def drawn_above_zero(mean: Array, covariance: Array, count: int, rng: np.random.Generator) -> Array:
    """(count, q) draws of one or two normal variables, cut off at 0, however far below it they lie.

    Of two the one that is more often negative is drawn first, then the other beside it.
    """
    sd = np.sqrt(np.diag(covariance))
    a = mean / sd
    if len(a) == 1:
        return sd * (a + _above(-a, rng.random((count, 1))))
    rho, first = float(covariance[0, 1] / (sd[0] * sd[1])), int(a.argmin())
    rest = float(np.sqrt(max(1.0 - rho**2, 1e-300)))
    z = _first_of_two(float(a.min()), float(a.max()), rho, rng.random(count))
    beside = a.max() + rho * z
    found = np.empty((count, 2))
    found[:, first], found[:, 1 - first] = a.min() + z, beside + rest * _above(-beside / rest, rng.random(count))
    return sd * np.maximum(found, 0.0)


def _above(least: Array, share: Array) -> Array:
    """Standard normal variables beyond `least`: of what lies beyond it the share `share` lies between."""
    return np.maximum(-ndtri_exp(np.log1p(-share) + log_ndtr(-least)), least)


def _first_of_two(own: float, other: float, rho: float, shares: Array) -> Array:
    """Distances from its mean of one of two standard normal variables of means `own` and `other`, both positive.

    shares: of its distribution. Its density is log-concave: what holds it is found by grids that close in on its peak.
    """
    rest = np.sqrt(max(1.0 - rho**2, 1e-300))
    ends = max(-own, min(0.0, -rho * other) - FARTHEST), max(-own, 0.0, -rho * other) + FARTHEST
    for _ in range(CLOSING_IN):
        z = np.linspace(*ends, CELLS + 1)
        logs = log_ndtr((other + rho * z) / rest) - 0.5 * z**2
        near = np.flatnonzero(logs > logs.max() + LEAST_LOG_DENSITY)
        ends = float(z[max(near[0] - 1, 0)]), float(z[min(near[-1] + 1, CELLS)])
    mass = cumulative_trapezoid(np.exp(logs - logs.max()), z, initial=0.0)
    return np.asarray(np.interp(shares * mass[-1], mass, z))


@dataclass(frozen=True)
class _Quadrant:
    """Where two standard normal variables of means a (..., 2) and correlation rho are both positive, by quadrature over
    the one that is more often negative, cut off at 0: the other is seldom negative beside it.

    first: (...) which that is; z: (..., nodes) its distance from its mean; logs: (..., nodes) log of their probability.
    """

    first: Array
    z: Array
    logs: Array

    @classmethod
    def of(cls, a: Array, rho: Array) -> _Quadrant:
        """Probabilities in logarithms, which the tails leave finite."""
        first = a.argmin(axis=-1)
        own, other = a.min(axis=-1)[..., None], a.max(axis=-1)[..., None]
        tail = log_ndtr(own)
        z, rho = -ndtri_exp(np.log1p(-NODES) + tail), rho[..., None]
        beside = log_ndtr((other + rho * z) / np.sqrt(np.maximum(1.0 - rho**2, 1e-300)))
        return cls(first, z, tail + LOG_WEIGHTS + beside)

    @property
    def log_probability(self) -> Array:
        """(...) of both being positive."""
        return np.asarray(np.logaddexp.reduce(self.logs, axis=-1))


def _both_cut_off(mean: Array, covariance: Array) -> tuple[Array, Array]:
    """Mean (..., n), covariance with the first two (..., n, 2) of normal variables of which these two are not negative.

    At every value of the one the other is cut off at 0, exactly; the whole is the mixture.
    """
    sd = np.sqrt(np.maximum(np.einsum("...ii->...i", covariance[..., :2, :]), 1e-300))
    quadrant = _Quadrant.of(mean[..., :2] / sd, covariance[..., 0, 1] / (sd[..., 0] * sd[..., 1]))
    w = softmax(quadrant.logs, axis=-1)
    means, covariances = np.empty(mean.shape), np.empty(covariance.shape)
    for i in (0, 1):
        of = quadrant.first == i
        along = covariance[of][..., i] / sd[of][:, i, None]
        held = mean[of][:, None] + quadrant.z[of][..., None] * along[:, None]
        rest = covariance[of] - along[..., None] * along[:, None, :2]
        parts = _one_cut_off(held, np.broadcast_to(rest[:, None], (*held.shape, 2)), 1 - i)
        means[of], covariances[of] = _mixtures(w[of], *parts)
    return means, covariances


def _mixtures(weights: Array, means: Array, covariances: Array) -> tuple[Array, Array]:
    """Mean (m, n) and covariance with the first q (m, n, q) of m mixtures of k distributions; weights: (m, k)."""
    mean = np.einsum("mk,mkn->mn", weights, means)
    spread = means - mean[:, None]
    within = np.einsum("mk,mknq->mnq", weights, covariances)
    return mean, within + np.einsum("mk,mkn,mkq->mnq", weights, spread, spread[..., : covariances.shape[-1]])


def _one_cut_off(mean: Array, covariance: Array, i: int) -> tuple[Array, Array]:
    """Mean (..., n), covariance with the first q (..., n, q) of normal variables of which number i < q is not negative.

    With a = mean_i/sd_i and L = phi(a)/Phi(a): mean_i + sd_i L, variance_i (1 - L (L + a)); the others by their
    regression on it (Johnson, Kotz & Balakrishnan, Continuous Univariate Distributions 1, 2nd ed. 1994, 10.1).
    """
    sd = np.sqrt(np.maximum(covariance[..., i, i], 1e-300))
    a = mean[..., i] / sd
    L = np.sqrt(2.0 / np.pi) / erfcx(-a / np.sqrt(2.0))
    along = covariance[..., i] / sd[..., None]
    less = (L * (L + a))[..., None, None] * along[..., None] * along[..., None, : covariance.shape[-1]]
    return mean + L[..., None] * along, covariance - less


def mixture(weights: Array, means: Array, covariances: Array) -> tuple[Array, Array]:
    """Mean and covariance of a mixture of Gaussians."""
    mean = weights @ means
    spread = means - mean
    within = np.einsum("i,ijk->jk", weights, covariances)
    return mean, within + np.einsum("i,ij,ik->jk", weights, spread, spread)
