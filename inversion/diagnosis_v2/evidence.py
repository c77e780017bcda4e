"""Exact marginal likelihoods of the linear-Gaussian models, the amplitude of the discrepancy marginalised on nodes.

log p(y | M, a) = -1/2 (r^T C^-1 r + log det C + p log 2 pi), C = error + J J^T + sum_j (S^2 g_j g_j^T + h_j^2 R_j), with
r the residual less what the places' own prior moves (MacKay, Neural Comput. 4 (1992) 415; O'Hagan & Forster, Bayesian
Inference, 2004, ch. 11). One-sided magnitudes have a half-normal prior: times 2 Phi(mean / sd) of the posterior.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.special import logsumexp
from scipy.stats import norm

from data.histories import Array
from inversion.diagnosis_v2.discrepancy import Amplitudes
from inversion.diagnosis_v2.hypotheses import SOMETHING_ELSE, Hypothesis
from inversion.diagnosis_v2.system import System

MAGNITUDE_SD = 1.0
"""In plausible sizes: standard deviation of a magnitude's Gaussian prior. The library states a size as what a laboratory
meets; a half-Cauchy of the same scale differs by a tenth of a nat at one size (Gelman, Bayesian Anal. 1 (2006) 515)."""
IGNORED = 30.0  # nats below the best node: it adds nothing


@dataclass(frozen=True)
class Node:
    """One model at one set of amplitudes. log_evidence: without prior; h, h_sd: (q,) posterior of its effects' sizes
    about the places; z, z_covariance: posterior of the parameters, in prior standard deviations; chi2: of the residual.
    """

    log_evidence: float
    h: Array
    h_cov: Array
    z: Array
    z_cov: Array


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


class Judge:
    """Evaluates models on one system; decompositions of the amplitudes' nodes are kept.

    places: h where the system stands, by label (its residual is without them); scale: of the magnitudes' prior.
    """

    def __init__(
        self,
        system: System,
        known: Amplitudes,
        places: Mapping[str, float] | None = None,
        scale: float = MAGNITUDE_SD,
    ) -> None:
        self.system, self.known, self.places, self.scale = system, known, dict(places or {}), scale
        self.combinations = known.combinations()
        self.kinds = tuple(known.nodes)
        self.errors = [
            system.covariance(dict(zip(self.kinds, row, strict=True)), known.own) for row in self.combinations
        ]

    def residual(self, members: Sequence[str]) -> Array:
        """(p,) with the prior's middle of the parameters and without any effect: what the model must explain."""
        y = self.system.y + self.system.J @ self.system.dz
        for label, h in self.places.items():
            y = y + h * self.system.G[label]
        return y

    def model(self, hypothesis: Hypothesis, sizes: Sequence[float] | None = None, only: Sequence[int] | None = None) -> Evidence:
        """One model; sizes: at which its effects' signatures are doubted, by default those fitted without doubt."""
        labels = [one.label for one in hypothesis.members]
        if sizes is None and any(label in self.system.doubt for label in labels):
            first = self._over_nodes(hypothesis, np.zeros(len(labels)), only)
            sizes = [float(x) for x in first.h]
        return self._over_nodes(hypothesis, np.asarray(sizes if sizes is not None else np.zeros(len(labels))), only)

    def _over_nodes(self, hypothesis: Hypothesis, sizes: Array, only: Sequence[int] | None) -> Evidence:
        indices = range(len(self.errors)) if only is None else only
        nodes = [self._node(hypothesis, sizes, i) for i in indices]
        logs = np.array([one.log_evidence for one in nodes])
        total = float(logsumexp(logs)) - np.log(len(self.errors))
        w = np.exp(logs - logsumexp(logs))
        h, h_cov = _mixture(w, [one.h for one in nodes], [one.h_cov for one in nodes])
        z, z_cov = _mixture(w, [one.z for one in nodes], [one.z_cov for one in nodes])
        weights = np.zeros(len(self.errors))
        weights[list(indices)] = w
        mean = {k: float(np.exp(weights @ np.log(self.combinations[:, i]))) for i, k in enumerate(self.kinds)}
        return Evidence(hypothesis, total, h, h_cov, z, z_cov, weights, mean)

    def _node(self, hypothesis: Hypothesis, sizes: Array, index: int) -> Node:
        system, members = self.system, hypothesis.members
        labels = [one.label for one in members]
        error = self.errors[index]
        for label, size in zip(labels, sizes, strict=True):
            if label in system.doubt and size:
                error = error + size**2 * system.doubt[label]
        if hypothesis.label == SOMETHING_ELSE:
            error = error + sum(system.smooth.values())
        columns = np.column_stack([system.J, *(self.scale * system.G[label] for label in labels)])
        r = self.residual(labels)
        factor = cho_factor(error, lower=True)
        solved = cho_solve(factor, np.column_stack([r, columns]))
        inner = np.eye(columns.shape[1]) + columns.T @ solved[:, 1:]
        pull = columns.T @ solved[:, 0]
        covariance = np.linalg.inv(inner)
        best = covariance @ pull
        logdet = 2.0 * float(np.log(np.diag(factor[0])).sum()) + float(np.linalg.slogdet(inner)[1])
        log_evidence = -0.5 * (float(r @ solved[:, 0]) - float(pull @ best) + logdet)
        k = system.J.shape[1]
        log_evidence += _one_sided(members, best[k:], covariance[k:, k:])
        h, h_cov = self.scale * best[k:], self.scale**2 * covariance[k:, k:]
        return Node(log_evidence, h, h_cov, best[:k], covariance[:k, :k])


def _one_sided(members: Sequence[object], best: Array, covariance: Array) -> float:
    """log of 2 Phi(mean/sd) for each magnitude that cannot be negative."""
    total = 0.0
    for i, one in enumerate(members):
        if getattr(one, "one_sided", False):
            total += float(np.log(2.0) + norm.logcdf(best[i] / np.sqrt(covariance[i, i])))
    return total


def _mixture(weights: Array, means: Sequence[Array], covariances: Sequence[Array]) -> tuple[Array, Array]:
    """Mean and covariance of a mixture of Gaussians."""
    mean = np.einsum("i,ij->j", weights, np.array(means))
    spread = np.array(means) - mean
    within = np.einsum("i,ijk->jk", weights, np.array(covariances))
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
