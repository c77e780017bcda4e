"""Ranking of models by the error of what they were not calibrated to, with a moving-block bootstrap of its residuals.

A shot's error is the root mean square over its channels of each channel's mean square residual, over its noise.
Residuals of one channel are correlated in time, so that blocks of them are drawn (Kuensch, Ann. Statist. 17 (1989)
1217), the same of every model: what all models have in common, such as the noise, does not blur their difference. They
are the same stretches of time in all channels and shots: what is wrong with a model shows in all of them at once. The
channel is a circle, so that its ends, where residuals grow, are drawn as often as its middle (Politis & Romano, in
Exploring the Limits of Bootstrap, Wiley 1992, 263).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.inversion.misfit import rms
from birdstrike.inversion.models.results import ModelAnswer

REPLICATES = 2000
BLOCKS = 8  # of a channel: long against the correlation of a residual, and enough to resample
CERTAIN = 0.95
MATTERS = 0.02
"""Of an error: a smaller difference of two models is a tie whatever the bootstrap says, since it takes the calibrated
constants as given, and these are no more exact."""

MISSES = 2.0
"""Held-out error over the noise beyond which even the best model is wrong, by the lower end of its 95 % interval.

A true model leaves 1, and the square root of 2 where the simulation errs by as much as the record's noise; at 2 half of
the mean square is neither, which a chi-square test refuses from 20 independent points on (p = 0.005)."""
Residuals = Mapping[str, Mapping[str, Sequence[float]]]
"""shot -> channel -> residuals over their noise."""


def shot_error(residuals: Mapping[str, Sequence[float]]) -> float:
    """Whitened root mean square of one shot's channels, each counted once."""
    return float(np.sqrt(np.mean([np.mean(np.square(own)) for own in residuals.values()])))


def misses(interval_95: Sequence[float] | None) -> bool:
    """Whether a held-out error over the noise is more than noise and a numerical error can be, by its interval."""
    return interval_95 is not None and interval_95[0] > MISSES


@dataclass(frozen=True)
class Ranked:
    """answers: with intervals and probabilities; ranking, tied: as in models.json, overall and by shot."""

    answers: Mapping[str, ModelAnswer]
    ranking: tuple[str, ...]
    tied: tuple[str, ...]
    per_shot: Mapping[str, tuple[str, ...]]
    tied_per_shot: Mapping[str, tuple[str, ...]]


def ranked(answers: Mapping[str, ModelAnswer], seed: int = 0) -> Ranked:
    """All models that have an answer, by expected held-out error; raises ValueError where they have other points."""
    taking_part = {name: one for name, one in answers.items() if one.failure is None}
    if not taking_part:
        return Ranked(answers, (), (), {}, {})
    _refuse_other_points(taking_part)
    shots = list(next(iter(taking_part.values())).residuals)
    draws = {name: {shot: bootstrap(one.residuals[shot], seed) for shot in shots} for name, one in taking_part.items()}
    overall = {name: np.sqrt(np.mean([own[shot] ** 2 for shot in shots], axis=0)) for name, own in draws.items()}
    least = np.min(list(overall.values()), axis=0)
    found = dict(answers)
    for name, one in taking_part.items():
        errors = {shot: shot_error(one.residuals[shot]) for shot in shots}
        found[name] = replace(
            one,
            heldout=errors,
            heldout_95={shot: _interval(draws[name][shot], errors[shot]) for shot in shots},
            expected=(expected := rms(list(errors.values()))),
            expected_95=_interval(overall[name], expected),
            probability_best=float(np.mean(overall[name] <= least)),
        )
    ranking, tied = _order({name: found[name].expected or 0.0 for name in taking_part}, overall)
    by_shot = {
        shot: _order({n: found[n].heldout[shot] for n in taking_part}, {n: draws[n][shot] for n in taking_part})
        for shot in shots
    }
    order = {shot: names for shot, (names, _) in by_shot.items()}
    return Ranked(found, ranking, tied, order, {shot: ties for shot, (_, ties) in by_shot.items()})


def _refuse_other_points(answers: Mapping[str, ModelAnswer]) -> None:
    """Raises ValueError where models have residuals at other points: blocks of them would not be pairs."""
    points = {
        name: {shot: {c: len(own) for c, own in channels.items()} for shot, channels in one.residuals.items()}
        for name, one in answers.items()
    }
    first, *others = points
    for name in others:
        if points[name] != points[first]:
            raise ValueError(f"held-out residuals of {first} and {name} differ: {points[first]}, {points[name]} points")


def bootstrap(residuals: Mapping[str, Sequence[float]], seed: int) -> Array:
    """(REPLICATES,) errors of a shot from blocks drawn anew; where they begin depends on the seed alone."""
    begins = np.random.default_rng(seed).random((REPLICATES, 2 * BLOCKS))
    means = [_block_means(np.square(np.asarray(own, dtype=float)), begins) for own in residuals.values()]
    return np.sqrt(np.mean(means, axis=0))


def _block_means(values: Array, begins: Array) -> Array:
    """(REPLICATES,) means of a channel made of moving blocks of its values (n,), which close to a circle.

    begins: (REPLICATES, ...) of the blocks, as shares of the channel.
    """
    n = len(values)
    length = max(1, n // BLOCKS)
    sums = np.cumsum(np.concatenate([[0.0], values, values[: length - 1]]))
    means = (sums[length:] - sums[:-length]) / length
    return means[(begins[:, : max(1, round(n / length))] * n).astype(int)].mean(axis=1)


def _order(errors: Mapping[str, float], draws: Mapping[str, Array]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names by error, and those that the bootstrap cannot tell from the first (paired, 95 % two-sided), or that differ
    from it by too little to matter."""
    ranking = tuple(sorted(errors, key=lambda name: errors[name]))
    first = ranking[0]
    beaten = {name: float(np.mean(draws[name] > draws[first])) for name in ranking[1:]}
    close = (1.0 + MATTERS) * errors[first]
    share = [name for name, part in beaten.items() if part < (1.0 + CERTAIN) / 2.0 or errors[name] < close]
    return ranking, (first, *share) if share else ()


def _interval(draws: Array, value: float) -> tuple[float, float]:
    """Central 95 % of the draws, widened to hold the value."""
    low, high = np.quantile(draws, [(1.0 - CERTAIN) / 2.0, (1.0 + CERTAIN) / 2.0])
    return min(float(low), value), max(float(high), value)
