"""Exact marginal likelihoods of the linear-Gaussian models, the amplitude of the discrepancy marginalised on nodes.

log p(y | M, a) = -1/2 (r^T C^-1 r + log det C + p log 2 pi), C = error + J J^T + sum_j (S^2 g_j g_j^T + h_j^2 R_j), with
r the residual less what the places' own prior moves (MacKay, Neural Comput. 4 (1992) 415; O'Hagan & Forster, Bayesian
Inference, 2004, ch. 11). One-sided magnitudes have a half-normal prior: times 2 Phi(mean / sd) of the posterior.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.special import logsumexp
from scipy.stats import norm

from birdstrike.data.histories import Array
from birdstrike.inversion.diagnosis.discrepancy import Amplitudes
from birdstrike.inversion.diagnosis.hypotheses import SOMETHING_ELSE, Hypothesis, Suspect
from birdstrike.inversion.diagnosis.system import Block, System

MAGNITUDE_SD = 1.0
"""In plausible sizes: standard deviation of a magnitude's Gaussian prior. The library states a size as what a laboratory
meets; a half-Cauchy of the same scale differs by a tenth of a nat at one size (Gelman, Bayesian Anal. 1 (2006) 515)."""


@dataclass(frozen=True)
class Evidence:
    """One model, amplitudes marginalised. weights: (nodes,) posterior of the nodes; amplitudes: kind -> posterior mean."""

    hypothesis: Hypothesis
    log_evidence: float
    h: Array
    h_cov: Array
    z: Array
    z_cov: Array
    weights: Array
    amplitudes: Mapping[str, float]


NEGLIGIBLE = 1e-3  # weight of a node of amplitudes, of the best one's, that moves no answer


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

    def at(self, nodes: Array, columns: Sequence[int]) -> Array:
        """(nodes, q, q) of some columns."""
        whole = np.zeros((len(nodes), len(columns), len(columns)))
        for x, weights, index in zip(self.x, self.weights, self.index, strict=True):
            own = x[:, np.asarray(columns)]
            used, back = np.unique(index[nodes], return_inverse=True)
            whole += np.array([own.T @ (weights[i][:, None] * own) for i in used])[back]
        return whole

    def node(self, number: int) -> Array:
        """(m, m) of one combination, all columns."""
        return self.at(np.array([number]), range(self.x[0].shape[1]))[0]


class Judge:
    """Evaluates models on one system.

    places: h where the system stands, by label (its residual is without them); scale: of the magnitudes' prior.
    """

    def __init__(
        self,
        system: System,
        known: Amplitudes,
        places: Mapping[str, float] | None = None,
        scale: float = MAGNITUDE_SD,
        combinations: Array | None = None,
    ) -> None:
        self.system, self.known, self.places, self.scale = system, known, dict(places or {}), scale
        self.combinations = known.combinations() if combinations is None else combinations
        self.kinds = tuple(known.nodes)
        flat = np.full(len(self.combinations), -np.log(len(self.combinations)))
        self.log_weights = known.log_weights() if combinations is None else flat
        columns = system.columns.copy()
        columns[:, 0] += columns[:, system.at["J"]] @ system.dz
        for label, h in self.places.items():
            columns[:, 0] += h * columns[:, system.at[label].start]
        self.columns = columns
        self.grams = Grams.of(system.blocks, columns, self.combinations)

    @cached_property
    def other_grams(self) -> Grams:
        """With something else in the error: of the residual and the parameters alone."""
        few = self.columns[:, : self.system.at["J"].stop]
        return Grams.of(self.system.other, few, self.combinations)

    def model(
        self, hypothesis: Hypothesis, sizes: Sequence[float] | None = None, only: Array | None = None
    ) -> Evidence:
        """One model; sizes: h at which its effects' signatures are doubted, by default those fitted without doubt.

        only: nodes that are evaluated; the others' posterior weight is taken as 0.
        """
        count = len(hypothesis.members)
        first = self._evaluate(hypothesis, np.zeros(count), only)
        if not count:
            return first
        kept = np.flatnonzero(first.weights > NEGLIGIBLE * first.weights.max())
        return self._evaluate(hypothesis, np.asarray(first.h if sizes is None else sizes), kept)

    def _evaluate(self, hypothesis: Hypothesis, sizes: Array, only: Array | None) -> Evidence:
        """Marginal likelihood at every node, with what is not known of the signatures as further columns."""
        at, members = self.system.at, hypothesis.members
        labels = [one.label for one in members]
        index, factor = list(range(at["J"].start, at["J"].stop)), [1.0] * (at["J"].stop - at["J"].start)
        for label in labels:
            index.append(at[label].start)
            factor.append(self.scale)
        for label, size in zip(labels, sizes, strict=True):
            further = ("changed", self.system.moved.get(label, 0.0))
            for name, sd in ((f"doubt of {label}", 1.0), further):
                if size and sd and name in at:
                    index += list(range(at[name].start, at[name].stop))
                    factor += [abs(size) * sd] * (at[name].stop - at[name].start)
        different = hypothesis.label == SOMETHING_ELSE
        grams = self.other_grams if different else self.grams
        kept = np.arange(len(self.combinations)) if only is None else np.asarray(only)
        f = np.concatenate([[1.0], factor])
        whole = f[:, None] * grams.at(kept, [0, *index]) * f
        A = np.eye(len(factor)) + whole[:, 1:, 1:]
        b = whole[:, 1:, 0]
        covariance = np.linalg.inv(A)
        best = np.einsum("nij,nj->ni", covariance, b)
        quadratic = whole[:, 0, 0] - np.einsum("ni,ni->n", b, best)
        logs = -0.5 * (quadratic + grams.logdet[kept] + np.linalg.slogdet(A)[1])
        r, q = at["J"].stop - at["J"].start, len(labels)
        own = slice(r, r + q)
        logs = logs + _one_sided(members, best[:, own], covariance[:, own, own])
        return self._summed(hypothesis, kept, logs + self.log_weights[kept], best, covariance, r, q)

    def _summed(
        self, hypothesis: Hypothesis, kept: Array, logs: Array, best: Array, covariance: Array, r: int, q: int
    ) -> Evidence:
        """The nodes together."""
        total = float(logsumexp(logs))
        w = np.exp(logs - logsumexp(logs))
        own = slice(r, r + q)
        h, h_cov = _mixture(w, self.scale * best[:, own], self.scale**2 * covariance[:, own, own])
        z, z_cov = _mixture(w, best[:, :r], covariance[:, :r, :r])
        weights = np.zeros(len(self.combinations))
        weights[kept] = w
        mean = {k: float(np.exp(weights @ np.log(self.combinations[:, i]))) for i, k in enumerate(self.kinds)}
        return Evidence(hypothesis, total, h, h_cov, z, z_cov, weights, mean)


def _one_sided(members: Sequence[Suspect], best: Array, covariance: Array) -> Array:
    """(nodes,) log of 2 Phi(mean/sd) for each magnitude that cannot be negative; best (nodes, q)."""
    total = np.zeros(len(best))
    for i, one in enumerate(members):
        if one.one_sided:
            total += np.log(2.0) + norm.logcdf(best[:, i] / np.sqrt(covariance[:, i, i]))
    return total


def _mixture(weights: Array, means: Array, covariances: Array) -> tuple[Array, Array]:
    """Mean and covariance of a mixture of Gaussians."""
    mean = weights @ means
    spread = means - mean
    within = np.einsum("i,ijk->jk", weights, covariances)
    return mean, within + np.einsum("i,ij,ik->jk", weights, spread, spread)


def probabilities(found: Mapping[str, Evidence]) -> dict[str, float]:
    """Posterior probability of every model, from evidence and prior."""
    logs = np.array([one.log_evidence + np.log(one.hypothesis.prior) for one in found.values()])
    shares = np.exp(logs - logsumexp(logs))
    return dict(zip(found, map(float, shares), strict=True))


def credible_set(shares: Mapping[str, float], level: float = 0.95) -> tuple[str, ...]:
    """The likeliest models that together hold `level`."""
    chosen, held = [], 0.0
    for name in sorted(shares, key=lambda n: -shares[n]):
        chosen.append(name)
        held += shares[name]
        if held >= level:
            break
    return tuple(chosen)
