"""Responses of the curves to effects: learnt from strikes at a few magnitudes, quadratic in the magnitude.

At the campaign's centre twice; and once at either of two other places, on lattices of their own, which tells by how
much a response changes with the parameters and with how the particles happen to lie.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from birdstrike.data.histories import Array, Histories
from birdstrike.doe.external.deck import unsupported_by_deck
from birdstrike.inversion.diagnosis.following import by_channel, followed
from birdstrike.solver.case.case import Case
from birdstrike.solver.effects.effect import Effect
from birdstrike.solver.effects.registry import effects

TWO_SIDED, ONE_SIDED = (-2.5, 2.5), (1.2, 3.0)
"""Magnitudes in plausible sizes: large, because what the particle lattice adds to a difference is of fixed size."""
OF_RECORD = ("time_offset", "sensor_gain", "sensor_bandwidth", "sensor_drift")
"""Effects that act on the record alone: exact, without a strike, unless the case declares instruments of its own."""
PLACES = 3  # at which an effect is struck
WIDEST, FARTHEST = 5.0, 10.0  # plausible sizes up to which a magnitude is sought: learnt, and exact on the record


@dataclass(frozen=True)
class Known:
    """An effect that the case can carry; size: b = 1 in SI; least, most: bounds of b; of_record: the instrument's."""

    effect: Effect
    size: float
    least: float
    most: float
    of_record: bool

    @property
    def name(self) -> str:
        """Its name in a case."""
        return self.effect.name

    @property
    def one_sided(self) -> bool:
        """Whether b = 0 is a bound."""
        return self.least == 0.0

    def magnitude(self, b: float) -> float:
        """SI magnitude, exactly on the bound where b is."""
        return b * self.size

    def learnt_at(self) -> tuple[float, ...]:
        """b of the strikes from which the response is learnt, inside the bounds."""
        if self.one_sided:
            return ONE_SIDED
        low = max(TWO_SIDED[0], 0.5 * self.least)
        return (low, TWO_SIDED[1])

    def checked_at(self) -> tuple[float, float]:
        """b of the strikes at the two other places."""
        return (ONE_SIDED[1], ONE_SIDED[1]) if self.one_sided else (TWO_SIDED[1], self.learnt_at()[0])


def library(case: Case) -> tuple[tuple[Known, ...], dict[str, str]]:
    """Effects that the case can carry, and why it cannot carry the others."""
    known, refused = [], {}
    for name, effect in effects().items():
        if reason := effect.refuses(case) or _declared(case, name) or unsupported_by_deck(case, name):
            refused[name] = reason
            continue
        size, least = effect.size(case), effect.least(case)
        of_record = name in OF_RECORD and not case.instrument
        most = FARTHEST if of_record else WIDEST
        known.append(Known(effect, size, max(least / size, -most) + 0.0, most, of_record))
    return tuple(known), refused


def _declared(case: Case, name: str) -> str:
    return "the case states it already" if name in case.effects else ""


def cases_of(base: Case, others: Sequence[Case], known: tuple[Known, ...]) -> dict[str, Case]:
    """The strikes that teach the responses, by "effect at b": from the centre's case and from two others."""
    cases: dict[str, Case] = {}
    for one in known:
        if one.of_record:
            continue
        for b in one.learnt_at():
            cases[label(one.name, b)] = _with(base, one, b)
        for i, (other, b) in enumerate(zip(others, one.checked_at(), strict=True)):
            cases[label(one.name, b, i + 1)] = _with(other, one, b)
    return cases


def _with(base: Case, one: Known, b: float) -> Case:
    return base.with_effects({**base.effects, one.name: one.magnitude(b)})


def label(name: str, b: float, place: int = 0) -> str:
    """Name of a strike of an effect; place: 0 for the campaign's centre."""
    return f"{name} at {b:g} sizes{f', place {place}' if place else ''}"


@dataclass(frozen=True)
class Response:
    """Change of all curves on the model's clock: b slope + b^2 curvature; (grid,) SI each.

    spread: (q, grid) directions in which the slope may be off elsewhere, one standard deviation each; pair: (grid,)
    variance by which two strikes differ beside the effect; at_size: b at the places that tell the spread.
    """

    slope: Array
    curvature: Array
    spread: Array
    pair: Array
    at_size: float

    def at(self, b: Array) -> Array:
        """(q, grid) at b (q,)."""
        return np.outer(b, self.slope) + np.outer(b**2, self.curvature)

    @property
    def doubt(self) -> Array:
        """(grid,) variance of the slope."""
        return (self.spread**2).sum(axis=0)

    def told(self, slope: Array, size: float, channels: int) -> Response:
        """After two strikes, without the effect and with `size` of it, which want the slope (grid,) added.

        They are followed as far as the slope is known worse than they scatter: the spread less one place's own scatter,
        but at least the scatter of the mean. What is left is what of theirs was followed. No effect's strikes scatter
        by more than the spread shows.
        """
        doubt = by_channel(self.doubt, channels)
        own = np.minimum(self.pair / self.at_size**2, doubt)
        scatter = own * (self.at_size / size) ** 2
        weight = followed(np.maximum(doubt - own, own / PLACES), scatter, slope, channels)
        left = np.sqrt(weight * scatter / np.maximum(doubt, 1e-300))
        return replace(self, slope=self.slope + weight * slope, spread=left * self.spread)


def learn(
    known: Known,
    base: Array,
    others: Sequence[Array | None],
    runs: Mapping[str, Histories],
    stack: Callable[[Histories], Array],
    jitter: tuple[float, ...],
) -> Response | None:
    """The response through the effect's strikes; None where none of them finished.

    base, others: (grid,) curves without the effect at the centre and at the other places, None for a strike that
    failed; stack: a strike's (grid,) curves; jitter: by how much a strike leaves what is smooth in its inputs, RMS per
    channel. Of what is not linear in the magnitude, curvature is what exceeds that; the rest is scatter, by whose power
    the slope is shrunk too (it would otherwise be taken for a signature).
    """
    found: list[tuple[float, Array]] = [
        (b, stack(runs[name]) - base) for b in known.learnt_at() if (name := label(known.name, b)) in runs
    ]
    if not found:
        return None
    parts = [_learn(list(zip(bs, ys, strict=True)), scatter) for bs, ys, scatter in _channels(found, jitter)]
    slope, curvature = (np.concatenate([part[i] for part in parts]) for i in range(2))
    pair = np.repeat([2.0 * one**2 for one in jitter], len(slope) // len(jitter))
    centre = Response(slope, curvature, np.zeros((0, len(slope))), pair, abs(known.checked_at()[0]))
    off = [
        (stack(runs[name]) - other - centre.at(np.array([b]))[0]) / b
        for i, (b, other) in enumerate(zip(known.checked_at(), others, strict=True))
        if other is not None and (name := label(known.name, b, i + 1)) in runs
    ]
    return _widened(centre, np.array([np.zeros_like(slope), *off], dtype=np.float64))


def _widened(centre: Response, off: Array) -> Response:
    """The mean slope of k places, off (k, grid) from the centre's, and its spread at yet another place."""
    k = len(off)
    if k < 2:
        return centre
    mean = off.mean(axis=0)
    spread = np.sqrt((1.0 + 1.0 / k) / (k - 1.0)) * (off - mean)
    return replace(centre, slope=centre.slope + mean, spread=spread)


def pooled(responses: Mapping[str, Response], channels: int) -> dict[str, Response]:
    """The responses, half of the variance of each one's spread spread over the directions that all of them have.

    What a response is off by is mostly how the particles happen to lie when it acts, which is alike for all effects;
    two other places tell its size, but hardly its directions.
    """
    powers = {name: _power(one.spread, channels).sum(axis=0) for name, one in responses.items() if len(one.spread)}
    rows = [_scaled(responses[name].spread, 1.0 / np.sqrt(np.maximum(own, 1e-300))) for name, own in powers.items()]
    if not rows:
        return dict(responses)
    shape = np.vstack(rows) / np.sqrt(len(rows))
    found = dict(responses)
    for name, power in powers.items():
        one = responses[name]
        spread = np.vstack([one.spread, _scaled(shape, np.sqrt(power))]) * np.sqrt(0.5)
        found[name] = replace(one, spread=spread)
    return found


def _power(rows: Array, channels: int) -> Array:
    """(q, channels) mean squares of rows (q, grid)."""
    return np.stack([(part**2).mean(axis=1) for part in np.split(rows, channels, axis=1)], axis=1)


def _scaled(rows: Array, factors: Array) -> Array:
    """Rows (q, grid) times one factor a channel."""
    return rows * np.repeat(factors, rows.shape[1] // len(factors))


def _channels(found: list[tuple[float, Array]], jitter: tuple[float, ...]):
    """Per channel: magnitudes, changes, scatter."""
    split = [np.split(y, len(jitter)) for _, y in found]
    return [([b for b, _ in found], [ys[i] for ys in split], scatter) for i, scatter in enumerate(jitter)]


def _learn(found: list[tuple[float, Array]], scatter: float) -> tuple[Array, Array]:
    """Slope and curvature of one channel, either shrunk by what of its power is the strikes' own scatter."""
    b = np.array([one for one, _ in found])
    y = np.stack([change for _, change in found])
    if len(found) == 1:
        return y[0] / b[0], np.zeros_like(y[0])
    curving, sloping = _weights(b)
    curvature = curving @ y
    off = float(np.mean(curvature**2)) / _noise(curving)
    curvature = _share(scatter**2, off) * curvature
    slope = sloping @ (y - np.outer(b**2, curvature))
    return _share(min(scatter**2, off) * _noise(sloping), float(np.mean(slope**2))) * slope, curvature


def _weights(b: Array) -> tuple[Array, Array]:
    """(2,) weights of two changes in the curvature through both, and in the slope that fits them best."""
    return np.array([-1.0 / b[0], 1.0 / b[1]]) / (b[1] - b[0]), b / (b @ b)


def _noise(weights: Array) -> float:
    """Variance of a weighted sum of changes, each a strike less the same other one, all of which scatter by 1."""
    return float(weights @ weights + weights.sum() ** 2)


def _share(scatter: float, power: float) -> float:
    """Of an estimate of this mean square, what is more than scatter (James & Stein, Berkeley Symp. 4 (1961) 361)."""
    return max(0.0, 1.0 - scatter / power) if power else 0.0
