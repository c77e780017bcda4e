"""Exact marginal likelihoods of the linear-Gaussian models, the amplitude of the discrepancy marginalised on nodes.

log p(y | M, a) = -1/2 (r^T C^-1 r + log det C + p log 2 pi), C = error + J J^T + sum_j (S^2 g_j g_j^T + h_j^2 R_j), with
r the residual less what the places' own prior moves (MacKay, Neural Comput. 4 (1992) 415; O'Hagan & Forster, Bayesian
Inference, 2004, ch. 11). One-sided magnitudes have a half-normal prior: times 2 Phi(mean / sd) of the posterior.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp
from scipy.stats import norm

from data.histories import Array
from inversion.diagnosis_v2.discrepancy import Amplitudes
from inversion.diagnosis_v2.hypotheses import SOMETHING_ELSE, Hypothesis, Suspect
from inversion.diagnosis_v2.system import Block, System

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
        self.gram, self.logdet = self._grams(system.blocks, columns)
        few = columns[:, : system.at["J"].stop]
        self.other_gram, self.other_logdet = self._grams(system.other, few)

    def _grams(self, blocks: Sequence[Block], columns: Array) -> tuple[Array, Array]:
        """(nodes, m, m) X^T C^-1 X and (nodes,) log det C of the error, for every combination of amplitudes."""
        gram: Array | float = 0.0
        logdet: Array | float = 0.0
        for i, block in enumerate(blocks):
            x = block.T @ columns[block.rows]
            values, index = np.unique(self.combinations[:, i], return_inverse=True)
            weights = 1.0 / (1.0 + values[:, None] ** 2 * block.lam)
            gram = gram + np.array([x.T @ (w[:, None] * x) for w in weights])[index]
            logdet = logdet + (block.logdet - np.log(weights).sum(axis=1))[index]
        return np.asarray(gram), np.asarray(logdet)

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
            for name, sd in ((f"doubt of {label}", 1.0), ("scatter", self.system.scatter.get(label, 0.0))):
                if size and sd and name in at:
                    index += list(range(at[name].start, at[name].stop))
                    factor += [abs(size) * sd] * (at[name].stop - at[name].start)
        different = hypothesis.label == SOMETHING_ELSE
        gram, logdet = (self.other_gram, self.other_logdet) if different else (self.gram, self.logdet)
        kept = np.arange(len(gram)) if only is None else np.asarray(only)
        f = np.array(factor)
        A = np.eye(len(f)) + f[:, None] * gram[np.ix_(kept, index, index)] * f
        b = f * gram[kept][:, index, 0]
        covariance = np.linalg.inv(A)
        best = np.einsum("nij,nj->ni", covariance, b)
        quadratic = gram[kept, 0, 0] - np.einsum("ni,ni->n", b, best)
        logs = -0.5 * (quadratic + logdet[kept] + np.linalg.slogdet(A)[1])
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
