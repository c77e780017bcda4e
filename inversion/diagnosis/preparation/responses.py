"""Responses of the curves to effects of the solver, learnt from the two-level design, with what is not known of them.

change(b) = h(b) S on the grid, b the magnitude in plausible sizes. S is the slope of the half differences of
folded-over pairs, shrunk by what it shows beyond scatter; what the regression leaves, spread by its covariance, is the
uncertainty of S (Box, Hunter & Hunter, Statistics for Experimenters, 2nd ed. 2005, ch. 6 and 10). h(b) = b until
simulations elsewhere show that the response bends. Of an effect of two senses each has its own S and h then: a faster
bird moves the curves otherwise than a slower one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import reduce

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.inversion.diagnosis.preparation.plan import WIDEST, Block, Known, Plan

LINEAR = ((-WIDEST, -WIDEST), (WIDEST, WIDEST))
FEWEST_LEFT = 3  # pairs beyond the number of effects
CHANGES = (0.0, 0.25, 0.5, 1.0, 2.0)
"""Of a signature, for one range of a parameter: standard deviations of its change that are tried; the likeliest is
taken.
"""
LEFT = np.geomspace(0.02, 1.0, 25)  # of the half differences' mean square: what the regression may leave
DIRECTIONS = 5  # of what the regression leaves: its slow part, which the parameters or another effect could imitate
BEYOND_CHANCE = 2.35  # ratio of variances: F of 10 instants that are independent, and 20, at 95 %
FAINTEST = 0.1
"""Of the variance that the scatter of the runs gives a signature: the least variance of its prior, for a response that
is nothing but scatter may still be a small one."""


@dataclass(frozen=True)
class Uncertainty:
    """One source of a response's error.

    directions: (q, grid) one standard deviation each; spread: (k + 1, k + 1, channels) covariance of signature and
    slopes in units of them.
    """

    directions: Array
    spread: Array

    @property
    def covariance(self) -> Array:
        """(k + 1, k + 1, channels) of signature and slopes, SI, mean over each channel."""
        return self.spread * _by_channel((self.directions**2).sum(axis=0), self.spread.shape[-1])

    def at(self, a: Array) -> Array:
        """(q, grid) directions of the signature's error where signature and slopes weigh a (k + 1,)."""
        size = np.sqrt(np.maximum(np.einsum("i,ijc,j->c", a, self.spread, a), 0.0))
        return self.directions * _on_grid(size, self.directions.shape[1])

    def left(self, kept: Array) -> Uncertainty:
        """Of coefficients that are replaced by `kept` (k + 1, k + 1, channels) times them."""
        return replace(self, spread=_left(self.spread, kept))


@dataclass(frozen=True)
class Response:
    """One effect's response.

    signature: (grid,) SI for h = 1 at the place `centre` (k,); slopes: (k, grid) its change with the parameters, over
    one range; uncertainties: what is not known of them, by source; scatter: (k + 1, k + 1, channels) covariance, SI,
    of signature and slopes by the scatter of simulations of the effect alone; knots: magnitude in plausible sizes ->
    size h of the response, both increasing, linear between; simulated: magnitudes at which it was simulated by itself,
    in plausible sizes; senses: of negative and of positive magnitudes alone, once it was.
    """

    known: Known
    signature: Array
    slopes: Array
    centre: Array
    uncertainties: tuple[Uncertainty, ...]
    scatter: Array
    knots: tuple[tuple[float, float], ...] = LINEAR
    simulated: tuple[float, ...] = ()
    senses: tuple[Response, Response] | None = None

    def sided(self, h: float) -> Response:
        """As simulations of the sense of h alone show it; of h = 0, as all do."""
        return self if self.senses is None or not h else self.senses[int(h > 0.0)]

    def at(self, z: Array) -> Array:
        """(grid,) SI for h = 1 at parameters z (k,), fractions of the ranges."""
        return self.signature + (z - self.centre) @ self.slopes

    def weights(self, z: Array) -> Array:
        """(k + 1,) of signature and slopes at parameters z (k,)."""
        return np.append(1.0, z - self.centre)

    def error_at(self, z: Array) -> Array:
        """(q, grid) directions of the signature's error at z (k,), one standard deviation each."""
        return np.vstack([one.at(self.weights(z)) for one in self.uncertainties])

    def scatter_at(self, z: Array) -> Array:
        """(channels,) standard deviation of the signature at z (k,) by the scatter of simulations of it alone."""
        a = self.weights(z)
        return np.sqrt(np.maximum(np.einsum("i,ijc,j->c", a, self.scatter, a), 0.0))

    @property
    def covariance(self) -> Array:
        """(k + 1, k + 1, channels) of signature and slopes, SI, mean over each channel."""
        return np.sum([self.scatter, *(one.covariance for one in self.uncertainties)], axis=0)

    def h(self, b: float) -> float:
        """Size of the response of a magnitude in plausible sizes."""
        return _through(b, *zip(*self.knots, strict=True))

    def b(self, h: float) -> float:
        """The magnitude in plausible sizes of a response of size h."""
        magnitudes, sizes = zip(*self.knots, strict=True)
        return _through(h, sizes, magnitudes)

    @property
    def limits(self) -> tuple[float, float]:
        """h of the smallest and the largest magnitude that are looked for."""
        return (0.0 if self.known.one_sided else self.h(self.known.least)), self.knots[-1][1]


def _through(x: float, xs: tuple[float, ...], ys: tuple[float, ...]) -> float:
    """Piecewise linear through increasing knots, the last pieces continued."""
    i = int(np.clip(np.searchsorted(xs, x) - 1, 0, len(xs) - 2))
    return float(ys[i] + (x - xs[i]) * (ys[i + 1] - ys[i]) / (xs[i + 1] - xs[i]))


def learn_responses(
    plan: Plan, stacks: Mapping[str, Array], channels: int
) -> tuple[dict[str, Response], dict[str, str]]:
    """Every effect's response, and why the others have none; stacks: (grid,) curves by label.

    Half differences are regressed on the design and on its products with the parameters, both shrunk, channel by
    channel: an effect's signature changes with the bird's viscosity, friction's above all.
    """
    found, lost = dict[str, Response](), dict[str, str]()
    for block in plan.blocks:
        kept = block.finished(stacks)
        enough = len(kept) >= len(block.known) + FEWEST_LEFT
        if not enough or np.linalg.matrix_rank(block.codes(kept)) < len(block.known):
            lost |= {known.name: "its simulations failed" for known in block.known}
        else:
            found |= _learnt(plan, block, kept, stacks, channels)
    return found, lost


def _learnt(
    plan: Plan, block: Block, kept: Sequence[int], stacks: Mapping[str, Array], channels: int
) -> dict[str, Response]:
    """The responses of a block's effects, from those of its pairs that finished."""
    half = block.halves(kept, lambda label: stacks[label])
    x, count = block.codes(kept), len(block.known)
    z = plan.unit[[plan.pair_point(i) for i in kept]]
    centre = z.mean(axis=0)
    design = np.hstack([x, *(x * own[:, None] for own in (z - centre).T)])
    parts = [_regressed(design, part, count) for part in np.split(half, channels, axis=1)]
    mean = np.hstack([one[0] for one in parts])
    covariance = np.stack([one[1] for one in parts], axis=-1)
    left = np.hstack([one[2] for one in parts])
    found: dict[str, Response] = {}
    for j, known in enumerate(block.known):
        own = np.arange(j, len(mean), count)
        spread = covariance[np.ix_(own, own)]
        error, unseen = Uncertainty(left, spread), np.zeros_like(spread)
        found[known.name] = Response(known, mean[j], mean[own[1:]], centre, (error,), unseen)
    return found


def _regressed(design: Array, half: Array, count: int) -> tuple[Array, Array, Array]:
    """Coefficients (q, m), their covariance (q, q) in units of what is left, and its directions (pairs, m).

    Normal priors: for the first `count` coefficients of the size that they show beyond the scatter (positive-part
    James-Stein: Efron & Morris, J. Am. Stat. Assoc. 70 (1975) 311), without which the scatter of an effect that moves
    nothing would be its signature; a share of that for its changes with the parameters; share and scatter at their
    likeliest (MacKay, Neural Comput. 4 (1992) 415).
    """
    power = float((half**2).mean()) or 1.0
    u, size, _ = np.linalg.svd(half / np.sqrt(power), full_matrices=False)
    first = np.linalg.lstsq(design[:, :count], half, rcond=None)[0]
    shown = (first**2).mean(axis=1) / power
    chance = np.diag(np.linalg.inv(design[:, :count].T @ design[:, :count]))
    scores = u * size / np.sqrt(half.shape[1])
    best = max(
        (
            (_log_evidence(design, scores, _prior(shown, left * chance, change, design), left), change, left)
            for change in CHANGES
            for left in LEFT
        ),
        key=lambda one: one[0],
    )
    _, change, left = best
    prior = _prior(shown, left * chance, change, design)
    kept = prior > 0.0
    A = design[:, kept].T @ design[:, kept] / left + np.diag(1.0 / prior[kept])
    inverse = np.zeros((len(prior), len(prior)))
    inverse[np.ix_(kept, kept)] = np.linalg.inv(A)
    mean = inverse @ design.T @ half / left
    rest = half - design @ mean
    _, s, v = np.linalg.svd(rest, full_matrices=False)
    s, v = s[:DIRECTIONS], v[:DIRECTIONS]
    scale = np.sqrt(power * left * half.shape[1] / max(float((s**2).sum()), 1e-300))
    return mean, inverse / left, scale * s[:, None] * v


def _prior(shown: Array, chance: Array, change: float, design: Array) -> Array:
    """(q,) prior variances of the coefficients, the half differences' mean square as unit.

    shown, chance: mean square of each signature as it is seen, and of what scatter alone gives it.
    """
    times = design.shape[1] // len(shown) - 1
    own = np.maximum(shown - chance, FAINTEST * chance)
    return np.concatenate([own, *([change**2 * own] * times)])


def _log_evidence(design: Array, scores: Array, prior: Array, left: float) -> float:
    """Of the half differences' scores (pairs, components), each direction weighed as one observation; 0 of none."""
    if not scores.any():
        return 0.0
    K = design * prior @ design.T + left * np.eye(len(design))
    independent = float((scores**2).sum() ** 2 / ((scores**2).sum(axis=0) ** 2).sum())
    logdet = float(np.linalg.slogdet(K)[1])
    return -0.5 * independent * (logdet + float(np.trace(np.linalg.solve(K, scores @ scores.T))))


@dataclass(frozen=True)
class Change:
    """Simulations with and without b plausible sizes of an effect at parameters z (k,).

    pairs: (pairs, grid) changes.
    """

    name: str
    b: float
    z: Array
    pairs: Array

    @property
    def apart(self) -> Array:
        """(pairs, grid) from the mean of the pairs."""
        return self.pairs - self.pairs.mean(axis=0)


def scatter(changes: Sequence[Change], channels: int) -> Array:
    """(r, grid) by what simulations differ that lattices alone part: draws, of mean square 1 over each channel."""
    rows = []
    for one in changes:
        power = _by_channel((one.apart**2).mean(axis=0), channels)
        rows.append(one.apart / np.sqrt(_on_grid(power, one.apart.shape[1])))
    return np.vstack(rows)


def up_to_date(response: Response, changes: Sequence[Change]) -> Response:
    """The response as learnt after all changes, in their order, and each of its senses after its own."""
    whole = reduce(updated, changes, response)
    if response.known.one_sided or not changes:
        return whole
    negative, positive = (
        reduce(updated, [one for one in changes if one.b * sense > 0.0], response) for sense in (-1.0, 1.0)
    )
    below = [knot for knot in negative.knots if knot[0] < 0.0]
    above = [knot for knot in positive.knots if knot[0] > 0.0]
    return replace(whole, knots=(*below, (0.0, 0.0), *above), senses=(negative, positive))


def updated(response: Response, change: Change) -> Response:
    """The response after simulations with and without the effect.

    Signature and slopes are conditioned on the simulations' mean, channel by channel (Kalman, J. Basic Eng. 82 (1960)
    35): what was learnt elsewhere of the change with the parameters stays, and so does its uncertainty. Where the two
    differ by more than chance allows, the difference is the old signature's error (DerSimonian & Laird, Control. Clin.
    Trials 7 (1986) 177).
    """
    mean, count, b = change.pairs.mean(axis=0), len(change.pairs), change.b
    a, covariance = response.weights(change.z), response.covariance
    channels = covariance.shape[-1]
    learnt = np.einsum("i,ijc,j->c", a, covariance, a)
    old = response.at(change.z)
    noise = _by_channel((change.apart**2).sum(axis=0), channels) / (max(count - 1.0, 1.0) * count)
    h = _size(old, mean, b, learnt, noise)
    if abs(h) < 1e-3 or np.sign(h) != np.sign(b):
        return response
    innovation, seen = mean / h - old, noise / h**2
    apart = _by_channel(innovation**2, channels)
    excess = np.where(apart > BEYOND_CHANCE * (learnt + seen), apart - learnt - seen, 0.0)
    covariance[0, 0] += excess
    gain = np.einsum("ijc,j->ic", covariance, a) / (learnt + excess + seen)
    kept = np.eye(len(a))[:, :, None] - gain[:, None] * a[None, :, None]
    moved = _on_grid(gain, len(old)) * innovation
    uncertainties = [one.left(kept) for one in response.uncertainties]
    if excess.any():
        first = np.zeros_like(covariance)
        first[0, 0] = 1.0
        direction = innovation * _on_grid(np.sqrt(excess / apart), len(old))
        uncertainties.append(Uncertainty(direction[None], first).left(kept))
    return replace(
        response,
        signature=response.signature + moved[0],
        slopes=response.slopes + moved[1:],
        uncertainties=tuple(uncertainties),
        scatter=_left(response.scatter, kept) + gain[:, None] * gain[None] * seen,
        knots=_with_knot(response, b, h),
        simulated=(*response.simulated, b),
    )


def _left(spread: Array, kept: Array) -> Array:
    """Of coefficients that are replaced by `kept` (k + 1, k + 1, channels) times them."""
    return np.einsum("ijc,jkc,lkc->ilc", kept, spread, kept)


def _size(old: Array, change: Array, b: float, learnt: Array, noise: Array) -> float:
    """Size h of a change (grid,) by b plausible sizes, in units of the old signature (grid,).

    As learnt, unless the change differs from that by more than chance allows: then the least-squares factor, the old
    signature's own error taken from its power, without which noise would pass for bending (Fuller, Measurement Error
    Models, 1987, sect. 1.2). learnt, noise: (channels,) variances of signature and change.
    """
    linear = _by_channel((change / b - old) ** 2, len(learnt)) / (learnt + noise / b**2)
    if linear.mean() <= BEYOND_CHANCE:
        return b
    weight = 1.0 / _on_grid(learnt, len(old))
    power = float((weight * old) @ old)
    return float((weight * old) @ change) / max(power - len(old), 0.5 * power) if power else 0.0


def _by_channel(values: Array, channels: int) -> Array:
    """(channels,) mean over each channel of values (grid,), never 0."""
    return np.maximum(values.reshape(channels, -1).mean(axis=1), 1e-300)


def _on_grid(values: Array, length: int) -> Array:
    """(..., length) of values by channel (..., channels)."""
    return np.repeat(values, length // values.shape[-1], axis=-1)


def _with_knot(response: Response, b: float, h: float) -> tuple[tuple[float, float], ...]:
    """The knots with what the simulations showed at b: those that were simulated, and the ends of what is looked for.

    Beyond the last one a response that has bent goes on as h = b / (1 + b / b0), whose slope is (h / b)^2: a support
    that lets go ever further tends to a free one.
    """
    known = {x: y for x, y in response.knots if x in response.simulated} | {0.0: 0.0, b: h}
    found = dict(known)
    for end, old in (response.knots[0], response.knots[-1]):
        last = max((x for x in known if x * end > 0.0), key=abs, default=0.0)
        if not last:
            found[end] = old
        elif abs(end) > abs(last):
            found[end] = known[last] + (end - last) * min((known[last] / last) ** 2, 1.0)
    ordered = sorted(found.items())
    kept = [ordered[0]]
    for x, y in ordered[1:]:
        if y > kept[-1][1] + 1e-6 and x > kept[-1][0] + 1e-9:
            kept.append((x, y))
    return tuple(kept)
