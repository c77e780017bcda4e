"""Exact marginal likelihoods of the linear-Gaussian models, the amplitude of the discrepancy marginalised on nodes.

log p(y | M, a, S) = -1/2 (r^T C^-1 r + log det C + p log 2 pi), C = error + J J^T + sum_j (S^2 g_j g_j^T + h_j^2 R_j),
with r the residual less what the places' own prior moves (MacKay, Neural Comput. 4 (1992) 415; O'Hagan & Forster,
Bayesian Inference, 2004, ch. 11), summed over the standard deviations S of the magnitudes. One-sided magnitudes have a
half-normal prior: times 2 Phi(mean / sd) of the posterior, which is then the normal cut off at 0; of two in a pair,
times 4 of their posterior's quadrant.

Posterior of one model: the 95 % interval of an effect's size, and draws of parameters and sizes.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.linalg import helmert
from scipy.special import softmax
from scipy.stats import chi2, norm

from birdstrike.data.histories import Array, Indices
from birdstrike.inversion.diagnosis.inference.gaussians import (
    Directions,
    Grams,
    Information,
    Reduced,
    covariance_of,
    cut_off_at_zero,
    drawn_above_zero,
    integrated,
    log_mass_above_zero,
    mixture,
)
from birdstrike.inversion.diagnosis.inference.hypotheses import BIRDS_APART, CandidateEffect, Hypothesis
from birdstrike.inversion.diagnosis.inference.system import System
from birdstrike.inversion.diagnosis.preparation.discrepancy import Amplitudes
from birdstrike.inversion.results.diagnosis import SOMETHING_ELSE
from birdstrike.surrogate.gaussian_process import NORMAL_95

MAGNITUDE_SCALE = 1.0
"""In plausible sizes: scale of a magnitude's prior. The library states a size as what a laboratory meets, and half of
the Cauchy distribution lies below its scale."""
PRIOR_NODES = 4
SIZES = 1.0 / np.sqrt(chi2.ppf(1.0 - (np.arange(PRIOR_NODES) + 0.5) / PRIOR_NODES, 1))
"""Standard deviations, each as likely, of the normal distributions that make a Cauchy of scale 1 (the variance is the
inverse of a chi-square of one degree of freedom: Zellner & Siow, Trabajos de Estadistica 31 (1980) 585), up to 6.4 of
it. Under a single normal prior a large magnitude would be shared out among two effects, because the square of
its size counts against it (Liang, Paulo, Molina, Clyde & Berger, J. Am. Stat. Assoc. 103 (2008) 410)."""
UNNAMED = (0.03, 0.1, 0.3, 1.0)
"""Plausible sizes by which the model's physics may err in every direction of the library, each as likely: from a model
of the very test to one that is as wrong as what a laboratory cannot measure."""
SAME = 1e-9  # relative difference of two signatures that are one
MOST_NUMBERS = 2e5  # in the matrices of the nodes that are reduced at once: what a core's cache holds, 1.6 MB
NEGLIGIBLE = 1e-3  # weight of a node of amplitudes, of the best one's, that moves no answer


@dataclass(frozen=True)
class Evidence:
    """One model, amplitudes marginalised. h: (members,) posterior means, never negative of one-sided members; weights:
    (nodes,) posterior of the nodes; amplitudes: kind -> posterior mean; unnamed: that of the unnamed errors' size; z:
    (free,) of the columns of the free directions; h_cov, z_cov: of the magnitudes and the calibrated parameters (these
    as if no magnitude were one-sided, never too small), with what another lattice moves in them; h_lattice: that alone;
    z_spread: of z_cov, how far the means at the nodes lie apart.
    """

    hypothesis: Hypothesis
    log_evidence: float
    h: Array
    h_cov: Array
    h_lattice: Array
    z: Array
    z_cov: Array
    weights: Array
    amplitudes: Mapping[str, float]
    unnamed: float
    z_spread: Array | float = 0.0


class ModelTester:
    """Evaluates models on one system.

    places: h where the system stands, by label (its residual is without them); scale: of the magnitudes' prior, whose
    standard deviations `deviations` has, one for all magnitudes of a model. A node is one amplitude of the discrepancy
    for each kind of sensor, one size of the unnamed errors, and one distance of the birds from each other, by which
    alone nodes differ that lie a multiple of `period` apart. The shots' parameters stand in `columns` as their mean and
    their differences (orthonormal: Helmert), which are independent at every such distance; what `Evidence` has is
    turned back.
    """

    def __init__(
        self,
        system: System,
        known: Amplitudes,
        places: Mapping[str, float] | None = None,
        scale: float = MAGNITUDE_SCALE,
        combinations: Array | None = None,
        unnamed: Sequence[float] = UNNAMED,
        apart: Sequence[float] = BIRDS_APART,
    ) -> None:
        self.system, self.known, self.places, self.scale = system, known, dict(places or {}), scale
        self.deviations = scale * SIZES
        apart = apart if len(system.names) > 1 else apart[-1:]
        amplitudes = known.combinations() if combinations is None else combinations
        weights = known.log_weights() if combinations is None else np.full(len(amplitudes), -np.log(len(amplitudes)))
        self.combinations = np.tile(amplitudes, (len(unnamed) * len(apart), 1))
        self.unnamed = np.tile(np.repeat(np.asarray(unnamed), len(amplitudes)), len(apart))
        self.apart = np.repeat(np.asarray(apart), len(unnamed) * len(amplitudes))
        self.log_weights = np.tile(weights, len(unnamed) * len(apart)) - np.log(len(unnamed) * len(apart))
        self.period = len(amplitudes) * len(unnamed)
        self.kinds = tuple(known.nodes)
        columns = system.columns.copy()
        columns[:, 0] += columns[:, system.at["J"]] @ system.dz
        columns[:, system.at["J"]] = columns[:, system.at["J"]] @ self.rotation.T
        for label, h in self.places.items():
            columns[:, 0] += h * columns[:, system.at[label].start]
        self.columns = columns
        self.grams = Grams.of(system.blocks, columns, self.combinations)

    @cached_property
    def rotation(self) -> Array:
        """(r, r) from the shots' parameters to their mean and their differences."""
        at, shots = self.system.at["J"], len(self.system.names)
        turned = helmert(shots, full=True) if shots > 1 else np.eye(1)
        return np.kron(turned, np.eye((at.stop - at.start) // shots))

    def by_bird(self, hypothesis: Hypothesis, sizes: Sequence[float] | Array) -> Array:
        """(3,) log marginal likelihood of the records under each of `BIRDS`; -inf where it is not among the nodes.

        sizes: h for the errors of its effects' signatures.
        """
        every = np.arange(len(self.combinations))
        quick = np.logaddexp.reduce(
            self.weighed(hypothesis, every, *self._without_errors(hypothesis, every))[0], axis=0
        )
        found = []
        for apart in BIRDS_APART:
            of = np.flatnonzero(np.isclose(self.apart, apart))
            if not len(of):
                found.append(-np.inf)
                continue
            kept = of[quick[of] > quick[of].max() + np.log(NEGLIGIBLE)]
            logs = self.at_nodes(hypothesis, sizes, kept)
            found.append(float(np.logaddexp.reduce(logs) - np.logaddexp.reduce(self.log_weights[of])))
        return np.array(found)

    @cached_property
    def other_grams(self) -> Grams:
        """With something else in the error: of the residual and the free directions alone."""
        few = self.columns[:, : self.system.at["nuisance"].stop]
        return Grams.of(self.system.other, few, self.combinations)

    @property
    def free(self) -> np.ndarray:
        """Columns of the parameters, then of the unnamed errors, then of the nuisances."""
        return np.arange(self.system.at["J"].start, self.system.at["nuisance"].stop)

    def sizes(self, nodes: Indices) -> Array:
        """(nodes, r) prior standard deviations of the free directions."""
        J, P, N = (self.system.at[name] for name in ("J", "unnamed", "nuisance"))
        shots, apart = len(self.system.names), self.apart[nodes, None] ** 2
        mean = np.sqrt(shots * (1.0 - apart) + apart)  # of parameters with unit variance and 1 - apart in common
        J_mean = np.repeat(mean, (J.stop - J.start) // shots, axis=1)
        J_rest = np.repeat(np.sqrt(apart), J.stop - J.start - J_mean.shape[1], axis=1)
        unnamed = np.repeat(self.unnamed[nodes, None], P.stop - P.start, axis=1)
        return np.hstack([J_mean, J_rest, unnamed, np.ones((len(nodes), N.stop - N.start))])

    def directions(self, members: Sequence[str] = (), sizes: Sequence[float] | Array = ()) -> Directions:
        """The free directions, and what is not known of the members' signatures at these sizes h."""
        columns, deviations = [self.free], [np.zeros(0)]
        for label, size in zip(members, sizes, strict=True):
            learnt, other = (f"error of {label}{ending}" for ending in ("", " in other models"))
            for name, sd in ((learnt, 1.0), (other, 1.0), ("changed", self.system.moved.get(label, 0.0))):
                if size and sd and name in self.system.at:
                    own = self.system.at[name]
                    columns.append(np.arange(own.start, own.stop))
                    deviations.append(np.full(own.stop - own.start, abs(float(size)) * sd))
        return Directions(np.concatenate(columns), np.concatenate(deviations))

    def deviations_of(self, directions: Directions, nodes: Indices) -> Array:
        """(nodes, r) prior standard deviations of directions."""
        return np.hstack([self.sizes(nodes), np.tile(directions.errors, (len(nodes), 1))])

    def information(
        self,
        grams: Grams,
        nodes: Indices,
        columns: Sequence[int],
        directions: Directions | None = None,
        held: Array | None = None,
    ) -> Information:
        """Columns, the residual first, with directions, by default the free ones, integrated out.

        held: (r,) of the calibrated parameters, in the coordinates of `columns`, where they are not integrated out.
        """
        J, c, d = len(self.rotation), len(columns), self.sizes(nodes)
        S, logdet = np.empty((len(nodes), c, c)), np.empty(len(nodes))
        kept = None if held is None else np.vstack([np.zeros((J, c)), np.eye(c)])
        if kept is not None:
            kept[:J, 0] = -np.asarray(held)
        for own, to, inner, _, volume in self._but_parameters(grams, nodes, columns, directions):
            if kept is not None:
                S[own], logdet[own] = (kept.T @ inner @ kept)[to], volume[to]
            else:
                S[own], _, logdet[own] = integrated(inner[to], d[own, :J])
                logdet[own] += volume[to]
        return Information(S, logdet)

    def reduced(
        self, grams: Grams, nodes: Indices, columns: Sequence[int], directions: Directions | None = None
    ) -> Reduced:
        """`information` with what the directions were: costlier."""
        out = directions or self.directions()
        J, c, d = len(self.rotation), len(columns), self.sizes(nodes)
        S, W = np.empty((len(nodes), c, c)), np.empty((len(nodes), len(out.columns), c))
        V, logdet = np.empty((len(nodes), J, J)), np.empty(len(nodes))
        for own, to, inner, taken, volume in self._but_parameters(grams, nodes, columns, out):
            S[own], W[own, :J], logdet[own] = integrated(inner[to], d[own, :J])
            V[own] = covariance_of(inner[to, :J, :J], d[own, :J])
            by_parameters = taken[to, :, :J] @ (d[own, :J, None] * W[own, :J])
            W[own, J:], logdet[own] = taken[to, :, J:] - by_parameters, logdet[own] + volume[to]
        return Reduced(S, logdet, W, V)

    def _but_parameters(
        self, grams: Grams, nodes: Indices, columns: Sequence[int], directions: Directions | None
    ) -> Iterator[tuple[Indices, Indices, Array, Array, Array]]:
        """`integrated` of parameters and columns, all other directions integrated out, for part after part of nodes.

        It is costly, and the same at every distance of the birds: places of the part's nodes among `nodes`, for each of
        them the place in what follows, then S, W, log det. A part of the matrices stays in the processor's cache.
        """
        out, J = directions or self.directions(), len(self.rotation)
        every = [*out.columns[J:], *out.columns[:J], *columns]
        alike, chosen, at = np.unique(nodes % self.period, return_index=True, return_inverse=True)
        d = self.deviations_of(out, nodes[chosen])[:, J:]
        for part, whole in grams.in_parts(alike, every, max(int(MOST_NUMBERS / len(every) ** 2), 1)):
            own = np.flatnonzero((at >= part.start) & (at < part.stop))
            yield own, at[own] - part.start, *integrated(whole, d[part])

    def likely_combinations(self, labels: Sequence[str], share: float) -> set[int]:
        """Numbers of the combinations of amplitudes whose posterior weight is `share` of the best one's or more.

        The signatures of `labels` are integrated out all together. Unnamed errors and the birds' distance at the ends
        of what they may be, the likelier of these.
        """
        ends = np.isin(self.unnamed, (self.unnamed.min(), self.unnamed.max()))
        ends &= np.isin(self.apart, (self.apart.min(), self.apart.max()))
        nodes, at = np.flatnonzero(ends), [self.system.at[label].start for label in labels]
        widest = np.full(len(at), self.deviations.max())
        directions = Directions(np.concatenate([self.free, np.array(at, dtype=int)]), widest)
        found = self.information(self.grams, nodes, [0], directions)
        logs = self.log_weights[nodes] - 0.5 * (found.S[:, 0, 0] + self.grams.logdet[nodes] + found.logdet)
        best = logs.reshape(-1, len(self.known.combinations())).max(axis=0)
        return set(np.flatnonzero(best > best.max() + np.log(share)).tolist())

    @cached_property
    def singles(self) -> tuple[dict[str, int], Information]:
        """The residual and every effect's signature at all nodes; label -> place among them, 0 the residual."""
        labels = [
            name
            for name in self.system.at
            if name not in ("y", "J", "unnamed", "nuisance", "changed", "lattice") and not name.startswith("error of ")
        ]
        columns = [0, *(self.system.at[name].start for name in labels)]
        return {name: i + 1 for i, name in enumerate(labels)}, self.information(
            self.grams, np.arange(len(self.combinations)), columns
        )

    def model(
        self, hypothesis: Hypothesis, sizes: Sequence[float] | None = None, only: Indices | None = None
    ) -> Evidence:
        """One model; sizes: h for the errors of its effects' signatures, by default those fitted without errors.

        only: nodes that are evaluated; the others' posterior weight is taken as 0.
        """
        members = [one.label for one in hypothesis.members]
        nodes = np.arange(len(self.combinations)) if only is None else np.asarray(only)
        lattice = self._lattice(hypothesis)
        if not members:
            grams = self.grams_of(hypothesis)
            return self._evaluated(hypothesis, nodes, self.reduced(grams, nodes, [0, *lattice]), grams)
        logs, best, covariance = self.weighed(hypothesis, nodes, *self._without_errors(hypothesis, nodes))
        w = softmax(logs)
        weights = w.sum(axis=0)
        kept = nodes[weights > NEGLIGIBLE * weights.max()]
        fitted = self._sizes(hypothesis, nodes, w, best, covariance)[0] if sizes is None else sizes
        columns, directions = [*self.columns_of(members), *lattice], self.directions(members, fitted)
        return self._evaluated(hypothesis, kept, self.reduced(self.grams, kept, columns, directions), self.grams)

    def likeliest(self, changes: Array, sizes: Array) -> float:
        """The likeliest of the sizes h (c,) of an effect whose exact changes (n, c) of the records are given, whitened.

        All else is integrated out. On a system that stands where the effect is not.
        """
        first, nodes = self.system.at["nuisance"].stop, np.arange(len(self.combinations))
        grams = Grams.of(self.system.blocks, np.hstack([self.columns[:, :first], changes]), self.combinations)
        reduced = self.information(grams, nodes, [0, *range(first, first + len(sizes))])
        quadratic = np.einsum("nii->ni", reduced.S)[:, 1:] - 2.0 * reduced.S[:, 0, 1:]
        quadratic += (reduced.S[:, 0, 0] + grams.logdet + reduced.logdet)[:, None]
        logs = np.logaddexp.reduce(self.log_weights[:, None] - 0.5 * quadratic, axis=0)
        prior = np.logaddexp.reduce(norm.logpdf(sizes[:, None], scale=self.deviations), axis=1)
        return float(sizes[(logs + prior).argmax()])

    def _without_errors(self, hypothesis: Hypothesis, nodes: Indices) -> tuple[Information, Grams]:
        """Residual and signatures at some nodes, the signatures taken for exact."""
        if hypothesis.label == SOMETHING_ELSE:
            return self.information(self.other_grams, nodes, [0]), self.other_grams
        index, quick = self.singles
        return quick.at(nodes, [0, *(index[one.label] for one in hypothesis.members)]), self.grams

    def columns_of(self, members: Sequence[str]) -> list[int]:
        """Of the residual and of effects' signatures."""
        return [0, *(self.system.at[label].start for label in members)]

    def prior_deviations(self, members: int) -> Array:
        """(sizes of the prior, members) prior deviations of magnitudes."""
        return np.repeat(self.deviations[:, None], members, axis=1) if members else np.zeros((1, 0))

    def grams_of(self, hypothesis: Hypothesis) -> Grams:
        """The products of the columns, whitened with something else in the errors where that is the model."""
        return self.other_grams if hypothesis.label == SOMETHING_ELSE else self.grams

    def at_nodes(self, hypothesis: Hypothesis, sizes: Sequence[float] | Array, only: Indices | None = None) -> Array:
        """(nodes,) log marginal likelihood at each node; sizes: h for the errors of its effects' signatures."""
        members = [one.label for one in hypothesis.members]
        nodes = np.arange(len(self.combinations)) if only is None else only
        grams = self.grams_of(hypothesis)
        reduced = self.information(grams, nodes, self.columns_of(members), self.directions(members, sizes))
        return np.logaddexp.reduce(self.weighed(hypothesis, nodes, reduced, grams)[0], axis=0)

    def at_best(self, evidence: Evidence) -> float:
        """A model's log marginal likelihood with the likeliest of the signatures that simulations leave possible.

        It counts how unlikely that one is, and not how many others there are: what more simulations could show at best.
        """
        members = [one.label for one in evidence.hypothesis.members]
        nodes = np.flatnonzero(evidence.weights > NEGLIGIBLE * evidence.weights.max())
        directions, columns = self.directions(members, evidence.h), self.columns_of(members)
        learnt = [self.system.at.get(f"error of {label}", slice(0, 0)) for label in members]
        stays = ~np.isin(directions.columns, [column for one in learnt for column in range(one.start, one.stop)])
        known = Directions(directions.columns[stays], directions.errors[stays[len(self.free) :]])
        free = self.information(self.grams, nodes, columns, directions)
        best = replace(free, logdet=self.information(self.grams, nodes, columns, known).logdet)
        return float(np.logaddexp.reduce(self.weighed(evidence.hypothesis, nodes, best, self.grams)[0], axis=None))

    def joint(self, hypothesis: Hypothesis, sizes: Sequence[float]) -> float:
        """Log density of the records and of the parameters at the places, all else integrated out.

        Nothing of it hangs on a linear course of the curves to other parameters, so that fits that ended at different
        places can be compared by it. sizes: h for the errors of the effects' signatures.
        """
        members, nodes = [one.label for one in hypothesis.members], np.arange(len(self.combinations))
        grams = self.grams_of(hypothesis)
        logs = self._joint(hypothesis, nodes, grams, self.directions())
        if members:
            kept = np.flatnonzero(logs > logs.max() + np.log(NEGLIGIBLE))
            logs = self._joint(hypothesis, kept, grams, self.directions(members, sizes))
        return float(np.logaddexp.reduce(logs))

    def _joint(self, hypothesis: Hypothesis, nodes: Indices, grams: Grams, directions: Directions) -> Array:
        """(nodes,) log density of records, parameters at the places, and nodes."""
        held = self.rotation @ self.system.dz
        columns = self.columns_of([one.label for one in hypothesis.members])
        logs = self.weighed(hypothesis, nodes, self.information(grams, nodes, columns, directions, held), grams)[0]
        prior = norm.logpdf(held, scale=self.sizes(nodes)[:, : len(held)]).sum(axis=1)
        return np.asarray(np.logaddexp.reduce(logs, axis=0) + prior)

    def weighed(
        self, hypothesis: Hypothesis, nodes: Indices, reduced: Information, grams: Grams
    ) -> tuple[Array, Array, Array]:
        """Log marginal likelihood, magnitudes and their covariance, in prior standard deviations.

        At each of the prior's deviations (first axis) and each node.
        """
        factor = self.prior_deviations(len(hypothesis.members))
        S = reduced.S[None, :, 1:, 1:] * factor[:, None, :, None] * factor[:, None, None, :]
        b = reduced.S[None, :, 1:, 0] * factor[:, None]
        A = S + np.eye(factor.shape[1])
        covariance = np.linalg.inv(A)
        best = np.einsum("snij,snj->sni", covariance, b)
        quadratic = reduced.S[:, 0, 0] - np.einsum("sni,sni->sn", b, best)
        logs = -0.5 * (quadratic + grams.logdet[nodes] + reduced.logdet + np.linalg.slogdet(A)[1])
        logs = logs + log_mass_above_zero(hypothesis.members, best, covariance)
        return logs + self.log_weights[nodes] - np.log(len(factor)), best, covariance

    def _evaluated(self, hypothesis: Hypothesis, nodes: Indices, whole: Reduced, grams: Grams) -> Evidence:
        """Marginal likelihood of all nodes together; whole: of residual, members, and what another lattice moves."""
        reduced = whole.of(range(1 + len(hypothesis.members)))
        logs, best, covariance = self.weighed(hypothesis, nodes, reduced, grams)
        evidence = float(np.logaddexp.reduce(logs, axis=None))
        w = np.exp(logs - evidence)
        h, h_cov, beside_unnamed = self._sizes(hypothesis, nodes, w, best, covariance)
        d = self.sizes(nodes)
        W, q = whole.W[:, : d.shape[1]], len(hypothesis.members)
        places = d * (W[:, :, 0] - np.einsum("nrc,snc->snr", W[:, :, 1 : 1 + q], beside_unnamed))
        z = np.einsum("sn,snr->r", w, places)
        count = len(self.rotation)
        z_cov, by_lattice = self._covariances(hypothesis, nodes, w, whole, covariance)
        apart = places[:, :, :count] - z[:count]
        z_spread = self.rotation.T @ np.einsum("sn,snr,snq->rq", w, apart, apart) @ self.rotation
        z_cov = self.rotation.T @ z_cov @ self.rotation + z_spread
        z[:count] = self.rotation.T @ z[:count]
        weights = np.zeros(len(self.combinations))
        weights[nodes] = w.sum(axis=0)
        mean = {k: float(np.exp(weights @ np.log(self.combinations[:, i]))) for i, k in enumerate(self.kinds)}
        unnamed = float(np.exp(weights @ np.log(self.unnamed)))
        return Evidence(
            hypothesis=hypothesis,
            log_evidence=evidence,
            h=h,
            h_cov=h_cov + by_lattice,
            h_lattice=by_lattice,
            z=z,
            z_cov=z_cov,
            weights=weights,
            amplitudes=mean,
            unnamed=unnamed,
            z_spread=z_spread,
        )

    def _sizes(
        self, hypothesis: Hypothesis, nodes: Indices, w: Array, best: Array, covariance: Array
    ) -> tuple[Array, Array, Array]:
        """Mean (q,) and covariance (q, q) of the members' sizes h by the weights w (deviations, nodes).

        And (deviations, nodes, q) the means by which they move the free directions (`Reduced.W`).
        """
        q = len(hypothesis.members)
        means, covariances = self._magnitudes(hypothesis.members, nodes, best, covariance)
        whole = mixture(w.ravel(), means[..., :q].reshape(w.size, q), covariances[..., :q, :].reshape(w.size, q, q))
        return *whole, means[..., q:]

    @cached_property
    def shared(self) -> frozenset[str]:
        """Effects with the signature of an unnamed error: where no baseline parts the two, they are one magnitude."""
        unnamed, at = self.columns[:, self.system.at["unnamed"]], self.system.at
        own = {label: self.columns[:, at[label].start, None] for label in self.singles[0]}
        return frozenset(
            label
            for label, column in own.items()
            if (np.abs(unnamed - column) <= SAME * np.abs(column)).all(axis=0).any()
        )

    def _magnitudes(
        self, members: Sequence[CandidateEffect], nodes: Indices, best: Array, covariance: Array
    ) -> tuple[Array, Array]:
        """Means (s, nodes, 2q) of members' sizes t, then of their own parts h; covariances (s, nodes, 2q, q) with t.

        s: deviations of the prior. They differ where an unnamed error shares the signature: of a sum t = h + u with
        prior variances s^2 and tau^2, h given t is normal with mean t s^2/(s^2 + tau^2) and variance
        s^2 tau^2/(s^2 + tau^2). A t that cannot be negative is cut off at 0, both together in a pair. Of h stands then
        what moves the parameters: data tell of t alone, so that parameters have the covariance with t that they
        have with h times (s^2 + tau^2)/s^2.
        """
        own = (self.deviations if members else np.ones(1))[:, None]
        mean, cov = own[..., None] * best, own[..., None, None] ** 2 * covariance
        tau, ratio = self.unnamed[nodes] ** 2, np.ones(best.shape)
        shared = [i for i, one in enumerate(members) if one.label in self.shared]
        ratio[..., shared] = (1.0 + tau / own**2)[..., None]
        with_own = cov * ratio[..., None, :]
        whole = with_own * ratio[..., None]
        for i in shared:
            whole[..., i, i] = np.maximum((cov[..., i, i] - tau / ratio[..., i]) * ratio[..., i] ** 2, 0.0)
        means = np.concatenate([ratio * mean, mean], axis=-1)
        covariances = np.concatenate([whole, with_own], axis=-2)
        return cut_off_at_zero(members, means, covariances)

    def unnamed_of(self, label: str) -> int:
        """Column of the unnamed error whose signature an effect has."""
        unnamed, at = self.system.at["unnamed"], self.system.at[label].start
        apart = np.abs(self.columns[:, unnamed] - self.columns[:, at, None]).sum(axis=0)
        return unnamed.start + int(apart.argmin())

    def _lattice(self, hypothesis: Hypothesis) -> Indices:
        """Columns of what another lattice moves; none beside something else, whose smooth error stands for it."""
        at = self.system.at["lattice"]
        return np.arange(at.start, at.start if hypothesis.label == SOMETHING_ELSE else at.stop)

    def _covariances(
        self, hypothesis: Hypothesis, nodes: Indices, w: Array, whole: Reduced, covariance: Array
    ) -> tuple[Array, Array]:
        """(r, r) of the calibrated parameters, and (q, q) what another lattice adds to that of the magnitudes.

        Means over the places by their weights w (deviations, nodes); covariance: of the magnitudes there. Parameters in
        prior standard deviations and turned (`rotation`), magnitudes in plausible sizes. A fit takes up what another
        lattice moves, and no residual shows it: with V the covariance of all that is fitted and X those columns, X
        alone would move the fit by V X^T C^-1 lattice. That belongs to the intervals and not to the likelihood, which
        would then leave to chaotic sensors what the displacements say (the covariance of an estimate by a likelihood
        that is not the true one: White, Econometrica 50 (1982) 1).
        """
        members, r = hypothesis.members, len(self.rotation)
        q, factor = len(members), self.prior_deviations(len(members))
        of_sizes = covariance * factor[:, None, :, None] * factor[:, None, None, :]
        W = self.sizes(nodes)[:, :r, None] * whole.W[:, :r]
        beside, by_lattice = W[:, :, 1 : 1 + q], W[:, :, 1 + q :]
        moved = np.einsum("snij,njl->snil", of_sizes, whole.S[:, 1 : 1 + q, 1 + q :])
        shifted = by_lattice - np.einsum("nri,snil->snrl", beside, moved)
        parameters = np.einsum("n,nrp->rp", w.sum(axis=0), whole.V)
        parameters += np.einsum("sn,nri,snij,npj->rp", w, beside, of_sizes, beside, optimize=True)
        parameters += np.einsum("sn,snrl,snpl->rp", w, shifted, shifted, optimize=True)
        for j, one in enumerate(members):
            if one.label in self.shared:  # the whole is the member's, as in `_magnitudes`
                moved[:, :, j] *= 1.0 + (self.unnamed[nodes] / factor[:, j, None])[..., None] ** 2
        return parameters, np.einsum("sn,snil,snjl->ij", w, moved, moved, optimize=True)


QUADRATURE = 41  # sizes over the limits, and as many about the mean
REACH = 5.0  # standard deviations on each side of the mean
TAILS = (0.025, 0.5, 0.975)  # of a 95 % interval


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
    members, grams = [one.label for one in hypothesis.members], tester.grams_of(hypothesis)
    columns, directions = tester.columns_of(members), tester.directions(members, evidence.h)
    used, counts = np.unique(nodes, return_counts=True)
    logs = tester.weighed(hypothesis, used, tester.information(grams, used, columns, directions), grams)[0]
    every = [0, *tester.free, *columns[1:], *directions.columns[len(tester.free) :]]
    factors, drawn = tester.prior_deviations(len(members)), list[Array]()
    for (_, gram), own, of_size, count in zip(
        grams.in_parts(used, every, 1), tester.sizes(used), softmax(logs, axis=0).T, counts, strict=True
    ):
        d = np.array([np.concatenate([own, factor, directions.errors]) for factor in factors])
        drawn.append(_drawn_at(hypothesis, d, gram[0], rng.multinomial(count, of_size), parts, rng))
    x = np.vstack(drawn)
    least = [0.0 if one.one_sided else -np.inf for one in hypothesis.members]  # 0 but for rounding
    return x[:, : at.stop - at.start] @ tester.rotation, np.maximum(_sizes(x, parts), least), nodes


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
    hypothesis: Hypothesis,
    deviations: Array,
    gram: Array,
    counts: Indices,
    parts_of_sizes: Sequence[Sequence[int]],
    rng: np.random.Generator,
) -> Array:
    """(count, r + q + ...) free directions, magnitudes and what is not known of signatures, at one node.

    deviations: (sizes of the prior, ...) of all these; counts: draws for each of the sizes; gram: of the residual and
    their columns at the node.
    """
    parts = []
    for d, due in zip(deviations, counts, strict=True):
        if not due:
            continue
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
    """(count, n) draws of a normal distribution, cut off where a magnitude that cannot be negative would be.

    Such magnitudes come from their own distribution, cut off at 0; all else follows them by its regression on them.
    """
    x = mean + rng.standard_normal((count, len(mean))) @ chol.T
    sided = [parts for one, parts in zip(members, parts_of_sizes, strict=True) if one.one_sided]
    if not sided:
        return x
    along = chol @ np.array([chol[parts].sum(axis=0) for parts in sided]).T  # (n, q) covariance with their sizes
    covariance = np.array([along[parts].sum(axis=0) for parts in sided])
    h = drawn_above_zero(_sizes(mean[None], sided)[0], covariance, count, rng)
    return x + np.linalg.solve(covariance, (h - _sizes(x, sided)).T).T @ along.T
