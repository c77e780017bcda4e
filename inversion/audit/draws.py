"""Answers over many draws of the noise: every model's linearised refit to each draw, its p-value, its unknowns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.signal import lfilter

from birdstrike.data.histories import Array
from birdstrike.inversion.diagnosis.choice import silent, visible
from birdstrike.inversion.diagnosis.judge import Judge, Judged
from birdstrike.inversion.diagnosis.record import Trace, averaged
from birdstrike.inversion.diagnosis.refit import bounds
from birdstrike.inversion.diagnosis.verdict import NONE, confidence_set

OUTLIER = 8.0  # standard deviations


@dataclass(frozen=True)
class Draws:
    """Answers over draws of the noise.

    sets: confidence set of each; named: the effect that each names, "" where it names none; unknowns: model ->
    (draws, q) refitted.
    """

    sets: tuple[tuple[str, ...], ...]
    named: tuple[str, ...]
    unknowns: Mapping[str, Array] = field(default_factory=dict)

    def holds(self, name: str) -> Array:
        """(draws,) whether a model is in the set."""
        return np.array([float(name in one) for one in self.sets])

    def names(self, name: str) -> Array:
        """(draws,) whether this effect is named."""
        return np.array([float(one == name) for one in self.named])

    def names_other(self, names: Sequence[str]) -> Array:
        """(draws,) whether an effect is named that is none of `names`."""
        return np.array([float(one != "" and one not in names) for one in self.named])


@dataclass(frozen=True)
class Noises:
    """How the noise is drawn: white of the stated level, or otherwise.

    level: factor on the stated one; rho: AR(1) correlation between raw samples; outliers: share of raw samples off by
    8 standard deviations.
    """

    level: float = 1.0
    rho: float = 0.0
    outliers: float = 0.0
    name: str = "as stated"

    def raw(self, shape: tuple[int, int], rng: np.random.Generator) -> Array:
        """(draws, raw) samples in units of the stated level."""
        noise = rng.standard_normal(shape)
        if self.rho:
            noise = np.asarray(lfilter([np.sqrt(1.0 - self.rho**2)], [1.0, -self.rho], noise, axis=1), dtype=np.float64)
        hit = rng.random(shape) < self.outliers
        return self.level * (noise + OUTLIER * hit * rng.choice([-1.0, 1.0], shape))

    def draw(self, traces: Sequence[Trace], draws: int, seed: int) -> Array:
        """(draws, n) on a record's points."""
        rng = np.random.default_rng(seed)
        raw = [self.raw((draws, len(trace.times)), rng) for trace in traces]
        return np.hstack(
            [averaged(trace.noise.level * one, trace.block) for trace, one in zip(traces, raw, strict=True)]
        )


def answer(judge: Judge, models: Mapping[str, Judged], noise: Array, alpha: float) -> Draws:
    """Confidence sets of draws (draws, n) of the noise added to the record that the models were fitted to."""
    answered = {name: _answered(judge, one, noise) for name, one in models.items()}
    p = {name: np.where(_as_none(models, name, x), answered[NONE][0], own) for name, (own, x) in answered.items()}
    unknowns = {name: x for name, (_, x) in answered.items()}
    sets = tuple(confidence_set({n: float(v[i]) for n, v in p.items()}, alpha) for i in range(len(noise)))
    return Draws(sets, tuple(_named(models, one, unknowns, i) for i, one in enumerate(sets)), unknowns)


def _as_none(models: Mapping[str, Judged], name: str, unknowns: Array) -> np.ndarray:
    """(draws,) whether a model is the one without effects at its refitted unknowns (draws, q): see `choice.level`."""
    fit = models[name].fit
    own = unknowns[:, len(fit.x) - len(fit.own) :]
    return np.full(len(unknowns), silent(models, name)) | ~own.any(axis=1)


def _named(models: Mapping[str, Judged], allowed: tuple[str, ...], unknowns: Mapping[str, Array], i: int) -> str:
    """The effect that a confidence set names at the refitted unknowns (draws, q) of draw i, else "".

    One that is alone, stands out of the others and is not held by the largest magnitude that is looked at.
    """
    if len(allowed) != 1 or allowed == (NONE,):
        return ""
    one = models[allowed[0]]
    held = replace(one.fit, x=unknowns[allowed[0]][i]).at_limit
    return allowed[0] if visible(one) and not held else ""


def _answered(judge: Judge, one: Judged, noise: Array) -> tuple[Array, Array]:
    """p (draws,) and unknowns (draws, q) of one model; a draw that leads out of its bounds is refitted on them."""
    rows = _rows(one, noise)
    p, x = _linear(one, rows)
    least, most = bounds(one.fit.problem, one.fit.own, one.fit.box)
    side = np.where(one.fit.at_bound, 0, (x > most).astype(int) - (x < least))
    for pattern in np.unique(side[side.any(axis=1)], axis=0):
        here = (side == pattern).all(axis=1)
        place = np.where(pattern > 0, most, np.where(pattern < 0, least, one.fit.x))
        p[here], x[here] = _linear(judge.judged(one.name, replace(one.fit, x=place)), rows[here])
    return p, np.clip(x, least, most)


def _rows(one: Judged, noise: Array) -> Array:
    """(draws, rows) whitened noise; priors have none."""
    whitened = one.fit.problem.whitener.apply(noise)
    priors = np.zeros((len(noise), len(one.fit.linear.residual) - whitened.shape[1]))
    return np.hstack([whitened, priors])


def _linear(one: Judged, rows: Array) -> tuple[Array, Array]:
    """p and unknowns by the linearisation where the model stands; unknowns at a bound stay there."""
    linear, fit = one.fit.linear, one.fit
    remainders = _bounded(one, linear.remainder + linear.project(rows.T).T)
    x = np.tile(fit.x, (len(rows), 1))
    x[:, ~fit.at_bound] += (linear.residual + rows) @ np.linalg.pinv(linear.design).T
    return one.reference.p_values(remainders), x


def _bounded(one: Judged, remainders: Array) -> Array:
    """Of an effect held at b = 0: what b > 0 explains in a draw is gone."""
    held = one.fit.linear.held
    if held is None:
        return remainders
    own = one.fit.linear.signatures[:, held]
    return remainders - np.maximum(remainders @ own, 0.0)[:, None] * own
