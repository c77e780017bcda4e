"""Model-form discrepancy: by how much any model of this kind may leave a test, as a Gaussian process per channel.

d(t, theta) = a peak s(t) w(t, theta), with w of unit variance, Matern 5/2 in time and in the parameters (Kennedy &
O'Hagan, J. R. Statist. Soc. B 63 (2001) 425), conditioned on w = 0 at contact: before it no model of an impact errs.
s(t) >= 1 grows where curves are sensitive. Two shots of one rig share d as far as their parameters are alike; beside
it each has an independent part.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import f as fdist

from birdstrike.data.formatting import many
from birdstrike.data.histories import Array

LEAST, MOST = 0.002, 0.10
"""Of the peak: range of the amplitude where nobody states it. Two verified codes of one physics hardly agree better
than 0.2 %; beyond 10 % nobody would calibrate the model (Oberkampf & Roy, Verification and Validation, 2010,
ch. 12)."""
STATED, UNKNOWN = "stated in the case", f"unknown: marginalised over {100 * LEAST:g} to {100 * MOST:g} % of the peak"
NODES = 10  # a factor of 1.5 apart
REPEATABILITY = {"displacement": 0.005, "strain": 0.01}
OTHER_REPEATABILITY = 0.03
"""Of the peak: independent part of a shot beside a baseline. A repeated shot of one rig scatters by about 0.5 % in
displacement and 3 % in force; a strain is a derivative, hence between."""
SPREAD_OWN = 2.0
"""Factor, one standard deviation, within which the independent part is known, which is marginalised: single runs of one
strike scatter by 0.3 % of the peak of the displacement where the bird is viscous and by 1.6 % where it is not."""
OWN_SHARE = 0.5
"""Of the variance of a model error that no baseline shows: what the shot has for itself, as runs scatter and shells
ring. Nothing tells which it is, so that both are as likely; without it an effect is named that turns one ringing into
another."""
SHARED_FACTOR = 2.0  # on the baselines' amplitude: one record gives it within a factor; too large costs little
FEWER = 6  # nodes where there are more than two kinds of sensors
PARAMETER_LENGTH = 1.0
"""Factor on the lengths over which the discrepancy changes with the parameters: see `Linearisation.roughness`."""
GROWTH_WINDOW = 0.15  # of the record: over which the growth in time is averaged
SLOPE_WINDOW = 0.02  # of the record: over which curves are averaged before their slopes are taken
CHANCE = 0.95  # quantile of the ratio of two windows' variances that no growth would exceed
UNCLEAN = 0.05
"""Share of the peak: a baseline whose discrepancy is larger is hardly one in which nothing is amiss, and of a sensor
that errs so by itself it shows no more than the record does."""
UNSEEN = 0.1  # of the record: correlation time where there is nothing to read it from
FASTEST, SLOWEST = 0.02, 0.25  # of the record: bounds of a correlation time


@dataclass(frozen=True)
class Shape:
    """A channel's discrepancy in time. growth: (m,) s(t) >= 1 on the setup's clock; length: correlation time [s]."""

    growth: Array
    length: float


def matern52(r: Array) -> Array:
    """Correlation at distances r in lengths."""
    x = np.sqrt(5.0) * r
    return (1.0 + x + x * x / 3.0) * np.exp(-x)


def started(t: Array, other: Array, contact: float, length: float) -> Array:
    """(n, m) correlation of instants [s] of a process that is 0 at contact and before it."""
    own, theirs = np.maximum(t - contact, 0.0) / length, np.maximum(other - contact, 0.0) / length
    joint = matern52(np.abs(own[:, None] - theirs[None]))
    return joint - np.outer(matern52(own), matern52(theirs))


def process_modes(t: Array, contact: float, length: float, count: int) -> Array:
    """(n, q) largest directions, one standard deviation each, of a process `started` of variance 1, at most `count`.

    Each ends above 0, whatever the record's sampling, so that shots can share them.
    """
    values, vectors = np.linalg.eigh(started(t, t, contact, length))
    kept = np.argsort(-values)[:count]
    return vectors[:, kept] * np.copysign(np.sqrt(np.maximum(values[kept], 0.0)), vectors[-1, kept])


def alike(z: Array, other: Array, weight: Array, length: float = PARAMETER_LENGTH) -> float:
    """Correlation of the discrepancy at two places (k,), fractions of the ranges.

    weight: (k,) inverse lengths in ranges. A parameter that moves nothing has next to none: it is not identified, and
    where it happens to lie says nothing of the discrepancy.
    """
    return float(matern52(np.asarray(np.linalg.norm(weight * (z - other)) / length)))


def shape_of(draws: Array, curve: Array, time: Array) -> Shape:
    """From draws (n, m) of what models of this kind differ by (meshes; a baseline's residual), and the curve (m,).

    Growth: their RMS over a window against that about the curve's peak, as far as it is beyond chance, never below 1.
    Length: of the Matern 5/2 process with the draws' ratio of variance to variance of slope, 3 length^2 / 5 (Rasmussen
    & Williams 2006, eq. 4.17).
    """
    span = float(time[-1] - time[0])
    if not len(draws) or not np.any(draws):
        return Shape(np.ones(len(time)), UNSEEN * span)
    smooth = np.array([_over_window(row, SLOPE_WINDOW) for row in draws])
    slope = np.gradient(smooth, time, axis=1)
    length = float(np.sqrt(5.0 / 3.0 * (smooth**2).mean() / max((slope**2).mean(), 1e-300)))
    length = float(np.clip(length, FASTEST * span, SLOWEST * span))
    freedom = max(GROWTH_WINDOW * span / length, 1.0) * np.linalg.matrix_rank(draws)
    power = _over_window((draws**2).mean(axis=0), GROWTH_WINDOW)
    ratio = power / max(float(power[int(np.argmax(np.abs(curve)))]), 1e-300) / fdist.ppf(CHANCE, freedom, freedom)
    return Shape(np.sqrt(np.maximum.accumulate(np.maximum(ratio, 1.0))), length)


def _over_window(values: Array, share: float) -> Array:
    """(m,) running mean over a share of the record."""
    return running_mean(values, max(int(share * len(values)), 1))


def running_mean(values: Array, width: int) -> Array:
    """(m,) mean over `width` points about each of (m,); near an end over those that there are."""
    kernel = np.ones(width)
    return np.convolve(values, kernel, "same") / np.convolve(np.ones(len(values)), kernel, "same")


@dataclass(frozen=True)
class Amplitudes:
    """What is known of the amplitudes, by kind of sensor, as shares of the peak.

    nodes: of the part that is marginalised; log_prior: of the nodes, normalised; fixed: of the other part. Of the kinds
    in `learnt` baselines show the part that shots share: it is fixed, because the shots' difference hardly holds it,
    and each shot's own part is marginalised. Of the others a mixture of both is marginalised (`OWN_SHARE`), and a
    shot's own part is fixed. source: where they come from, for the user.
    kept: numbers of the combinations of nodes that are worth computing, where there are many; None: all.
    """

    nodes: Mapping[str, Array]
    log_prior: Mapping[str, Array]
    fixed: Mapping[str, float]
    source: str
    learnt: frozenset[str] = frozenset()
    kept: tuple[int, ...] | None = None

    def combinations(self) -> Array:
        """(q, kinds) the combinations of the kinds' nodes: every one, or those that are kept."""
        mesh = np.meshgrid(*self.nodes.values(), indexing="ij")
        return self._of_kept(np.stack([one.ravel() for one in mesh], axis=1))

    def log_weights(self) -> Array:
        """(q,) prior of the combinations."""
        mesh = np.meshgrid(*self.log_prior.values(), indexing="ij")
        return self._of_kept(np.sum([one.ravel() for one in mesh], axis=0))

    def thinned(self) -> Amplitudes:
        """With every other node of each kind, from the second on, where it has several."""
        numbers = np.arange(int(np.prod([len(own) for own in self.nodes.values()])))
        places = np.unravel_index(numbers, [len(own) for own in self.nodes.values()])
        odd = [(own % 2 == 1) | (len(nodes) == 1) for own, nodes in zip(places, self.nodes.values(), strict=True)]
        return replace(self, kept=tuple(np.flatnonzero(np.all(odd, axis=0)).tolist()))

    def _of_kept(self, values: Array) -> Array:
        return values if self.kept is None else values[list(self.kept)]

    def only(self, kinds: set[str]) -> Amplitudes:
        """Of some kinds of sensors; of the combinations that are kept, what they have of these kinds."""
        nodes = {k: v for k, v in self.nodes.items() if k in kinds}
        kept = None if self.kept is None else self._numbers_among(nodes)
        return replace(self, nodes=nodes, log_prior={k: self.log_prior[k] for k in nodes}, kept=kept)

    def _numbers_among(self, nodes: Mapping[str, Array]) -> tuple[int, ...]:
        """Numbers, among the combinations of some kinds' nodes, of those that the kept ones have of these kinds."""
        places = np.unravel_index(list(self.kept or ()), [len(own) for own in self.nodes.values()])
        own = [place for kind, place in zip(self.nodes, places, strict=True) if kind in nodes]
        numbers = np.ravel_multi_index(own, [len(one) for one in nodes.values()])
        return tuple(np.unique(numbers).tolist())


def node_count(kinds: Sequence[str]) -> int:
    """Nodes of each kind's amplitude: their combinations are computed."""
    return NODES if len(kinds) <= 2 else FEWER


def unknown_or_stated(kinds: Sequence[str], stated: Mapping[str, float], several: bool = False) -> Amplitudes:
    """Without a baseline.

    stated: kind -> share of the peak; several: whether there is more than one shot.
    """
    grid = np.geomspace(LEAST, MOST, node_count(kinds))
    found = {kind: np.array([stated[kind]]) if kind in stated else grid for kind in kinds}
    flat = {kind: np.full(len(v), -np.log(len(v))) for kind, v in found.items()}
    own = {kind: repeatability(kind) if several else 0.0 for kind in kinds}
    source = STATED if all(kind in stated for kind in kinds) else UNKNOWN
    return Amplitudes(found, flat, own, source)


def beside_baselines(
    kinds: Sequence[str],
    shown: Mapping[str, float],
    count: int,
    stated: Mapping[str, float],
    scale: float = 1.0,
) -> Amplitudes:
    """With baselines.

    A kind of which they show nothing, or an error in which any effect would be lost, is as unknown as without them.

    shown: kind -> amplitude that the baselines alone show, both parts; count: of the baselines; stated: as of
    `unknown_or_stated`; scale: for a sensitivity study.
    """
    unknown = unknown_or_stated(kinds, stated, True)
    learnt = frozenset(kind for kind, share in shown.items() if share <= UNCLEAN)
    factors = np.geomspace(1.0 / SPREAD_OWN**2, SPREAD_OWN**2, node_count(kinds))
    weights = -0.5 * (np.log(factors) / np.log(SPREAD_OWN)) ** 2
    weights = weights - np.log(np.exp(weights).sum())
    part = SHARED_FACTOR * float(np.sqrt(1.0 - OWN_SHARE))
    found = {**unknown.nodes, **{kind: scale * repeatability(kind) * factors for kind in learnt}}
    prior = {**unknown.log_prior, **dict.fromkeys(learnt, np.asarray(weights))}
    fixed = {**unknown.fixed, **{kind: part * shown[kind] for kind in learnt}}
    source = many(count, "baseline shot")
    for kind in kinds:
        if kind not in learnt:
            source += f"; {kind.replace('_', ' ')} {STATED if kind in stated else UNKNOWN}"
    return Amplitudes(found, prior, fixed, source, learnt)


def repeatability(kind: str) -> float:
    """Default share of the peak of a shot's own part."""
    return REPEATABILITY.get(kind, OTHER_REPEATABILITY)
