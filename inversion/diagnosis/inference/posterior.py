"""Posterior of one model: the 95 % interval of an effect's size, and draws of parameters and sizes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid
from scipy.special import softmax
from scipy.stats import norm

from birdstrike.data.histories import Array
from birdstrike.inversion.diagnosis.inference.evidence import Evidence, ModelTester
from birdstrike.inversion.diagnosis.inference.gaussians import Indices, integrated
from birdstrike.inversion.diagnosis.inference.hypotheses import CandidateEffect
from birdstrike.surrogate.gaussian_process import NORMAL_95

QUADRATURE = 41  # sizes over the limits, and as many about the mean
REACH = 5.0  # standard deviations on each side of the mean
TAILS = (0.025, 0.5, 0.975)  # of a 95 % interval
REDRAWN = 50  # times at most: a draw with a negative one-sided magnitude


def quantiles(tester: ModelTester, evidence: Evidence) -> tuple[float, float, float]:
    """95 % interval of a single effect's size [plausible sizes], within its limits: begin, median and end.

    By quadrature over the size, with what is not known of the signature for each: it grows with the size, so that
    an effect of which little is seen is not held to be small because simulations have not shown it clearly. What
    another lattice moves is added to both sides (`ModelTester._covariances`). A signature that an unnamed error
    shares is the effect's as a whole.
    """
    (one,) = evidence.hypothesis.members
    nodes, (low, high) = np.flatnonzero(evidence.weights > 0.0), one.limits
    centre, sd = float(np.clip(evidence.h[0], low, high)), float(np.sqrt(evidence.h_cov[0, 0]))
    local = np.linspace(centre - REACH * sd, centre + REACH * sd, QUADRATURE)
    sizes = np.unique(np.clip([*np.linspace(low, high, QUADRATURE), *local], low, high))
    logs = _log_density(tester, one, nodes, sizes)
    density = np.exp(logs - logs.max())
    mass = cumulative_trapezoid(density, sizes, initial=0.0)
    ends = np.interp(TAILS, mass / mass[-1], sizes)
    by_lattice = NORMAL_95 * np.sqrt(evidence.h_lattice[0, 0])
    begin, middle, end = (float(x) for x in ends)
    return (
        max(middle - float(np.hypot(middle - begin, by_lattice)), low),
        middle,
        min(middle + float(np.hypot(end - middle, by_lattice)), high),
    )


def _log_density(tester: ModelTester, one: CandidateEffect, nodes: Indices, sizes: Array) -> Array:
    """(sizes,) log density of the records and of an effect's size, all else and the nodes integrated out."""
    at, unknown, first = tester.system.at, tester.directions([one.label], [1.0]), len(tester.free)
    d, own = tester.sizes(nodes), tester.deviations**2 + np.zeros((len(nodes), 1))
    free = np.arange(first)
    if one.label in tester.shared:
        shared = tester.unnamed_of(one.label) - at["J"].start
        free, own = np.delete(free, shared), own + d[:, shared, None] ** 2
    columns = [*tester.free[free], 0, at[one.label].start, *unknown.columns[first:]]
    S, _, logdet = integrated(tester.grams.at(nodes, columns), d[:, free])
    prior = norm.logpdf(sizes[:, None, None], scale=np.sqrt(own))  # (sizes, nodes, deviations)
    # the signature's errors, of variances that grow with the square of the size, in the axes of their information
    lam, V = np.linalg.eigh(unknown.errors[:, None] * S[:, 2:, 2:] * unknown.errors)
    pull = np.einsum("nrk,r,nrc->nck", V, unknown.errors, S[:, 2:, :2])  # (nodes, 2, errors): residual, signature
    square = sizes[:, None, None] ** 2
    rest = square * (pull[:, 0] - sizes[:, None, None] * pull[:, 1]) ** 2 / (1.0 + square * lam)
    quadratic = S[:, 0, 0] - sizes[:, None] * (2.0 * S[:, 0, 1] - sizes[:, None] * S[:, 1, 1]) - rest.sum(axis=2)
    logdet = tester.grams.logdet[nodes] + logdet + np.log1p(square * np.maximum(lam, 0.0)).sum(axis=2)
    logs = tester.log_weights[nodes] - 0.5 * (quadratic + logdet)
    return np.asarray(np.logaddexp.reduce(logs + np.logaddexp.reduce(prior, axis=2), axis=1))


def draws(
    tester: ModelTester, evidence: Evidence, count: int, rng: np.random.Generator
) -> tuple[Array, Array, Indices]:
    """(count, r) calibrated parameters, (count, q) sizes h of the members, (count,) nodes of a model's posterior.

    From the joint Gaussians of the nodes. The whole of a magnitude that an unnamed error shares is the member's, cut
    off at 0 where it cannot be negative, as in `ModelTester._magnitudes`. What another lattice moves is not in them:
    they are of the fit, which took it up, and predictions with these parameters need it.
    """
    hypothesis, weights = evidence.hypothesis, evidence.weights
    nodes = np.sort(rng.choice(len(weights), count, p=weights / weights.sum()))
    at, parts = tester.system.at["J"], _parts_of_sizes(tester, hypothesis.members)
    x = np.vstack([_drawn_at(tester, evidence, int(n), int((nodes == n).sum()), parts, rng) for n in np.unique(nodes)])
    return x[:, : at.stop - at.start] @ tester.rotation, _sizes(x, parts), nodes


def _parts_of_sizes(tester: ModelTester, members: Sequence[CandidateEffect]) -> list[list[int]]:
    """Of each member the columns of a draw that add up to its size: its own, and an unnamed error's that shares it."""
    first, own = tester.system.at["J"].start, range(len(tester.free), len(tester.free) + len(members))
    return [
        [column, tester.unnamed_of(one.label) - first] if one.label in tester.shared else [column]
        for column, one in zip(own, members, strict=True)
    ]


def _sizes(x: Array, parts: Sequence[Sequence[int]]) -> Array:
    """(n, q) sizes h of the members in draws x (n, r + q + ...)."""
    return np.array([x[:, own].sum(axis=1) for own in parts]).reshape(len(parts), len(x)).T


def _drawn_at(
    tester: ModelTester,
    evidence: Evidence,
    node: int,
    count: int,
    parts_of_sizes: Sequence[Sequence[int]],
    rng: np.random.Generator,
) -> Array:
    """(count, r + q + ...) free directions, magnitudes and what is not known of signatures, at one node."""
    hypothesis, number = evidence.hypothesis, np.array([node])
    members, grams = [one.label for one in hypothesis.members], tester.grams_of(hypothesis)
    columns, directions = tester.columns_of(members), tester.directions(members, evidence.h)
    logs, _, _ = tester.weighed(hypothesis, number, tester.reduced(grams, number, columns, directions), grams)
    gram = grams.at(number, [0, *tester.free, *columns[1:], *directions.columns[len(tester.free) :]])[0]
    parts, factors = [], tester.prior_deviations(len(members))
    for factor, due in zip(factors, rng.multinomial(count, softmax(logs[:, 0])), strict=True):
        d = np.concatenate([tester.sizes(number)[0], factor, directions.errors])
        inverse = np.linalg.inv(d[:, None] * gram[1:, 1:] * d + np.eye(len(d)))
        mean, chol = inverse @ (d * gram[1:, 0]), np.linalg.cholesky(0.5 * (inverse + inverse.T))
        parts.append(_possible(hypothesis.members, parts_of_sizes, d * mean, d[:, None] * chol, int(due), rng))
    return np.vstack(parts)


def _possible(
    members: Sequence[CandidateEffect],
    parts_of_sizes: Sequence[Sequence[int]],
    mean: Array,
    chol: Array,
    count: int,
    rng: np.random.Generator,
) -> Array:
    """(count, n) draws of a normal distribution; one with a magnitude that cannot be negative, but is, anew."""
    x, due = np.zeros((count, len(mean))), np.arange(count)
    for _ in range(REDRAWN):
        x[due] = mean + rng.standard_normal((len(due), len(mean))) @ chol.T
        due = due[_impossible(members, _sizes(x[due], parts_of_sizes))]
        if not len(due):
            break
    return x


def _impossible(members: Sequence[CandidateEffect], sizes: Array) -> NDArray[np.bool_]:
    """(n,) whether a one-sided magnitude of sizes (n, q) is negative."""
    sided = [i for i, one in enumerate(members) if one.one_sided]
    return np.asarray((sizes[:, sided] < 0.0).any(axis=1))
