"""Answers over many draws of the noise: every model's linearised refit to each draw, its p-value, its unknowns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from birdstrike.inversion.diagnosis.choice import silent, visible
from birdstrike.inversion.diagnosis.judge import Judge, Judged
from birdstrike.inversion.diagnosis.record import Trace, averaged
from birdstrike.inversion.diagnosis.verdict import NONE, confidence_set
from numpy.typing import NDArray
from scipy.optimize import lsq_linear
from scipy.signal import lfilter

from birdstrike.data.histories import Array
from birdstrike.inversion.diagnosis.ranking import Fit, bounds

OUTLIER = 8.0  # standard deviations
ROUNDS = 6  # of linearising where the active bounds of a draw hold
OFF_BOUND = 3e-4  # of a range: an unknown that far from a bound counts as free
CHANGES = 40  # of the active bounds of one linear problem
ROUNDING = 1e-12  # of a range


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
    """p (draws,) and unknowns (draws, q) of one model, every draw refitted within the bounds.

    A draw is solved by the model linearised where its active bounds hold, until the solution has just these active; the
    few that change for ever are solved once more with the last held.
    """
    rows, fit = _rows(one, noise), one.fit
    least, most = bounds(fit.problem, fit.own, fit.box)
    start = _side(fit)
    fits = {tuple(start): fit}
    sides, x = np.tile(start, (len(rows), 1)), np.tile(fit.x, (len(rows), 1))
    due = np.ones(len(rows), dtype=bool)
    for _ in range(ROUNDS):
        for pattern in np.unique(sides[due], axis=0):
            here = due & (sides == pattern).all(axis=1)
            there = fits.setdefault(tuple(pattern), _standing_on(fit, pattern))
            residuals = there.linear.residual + rows[here]
            x[here], found = bounded_least_squares(there.whole_design, residuals, there.x, least, most)
            found[:, _own_held(fit)] = pattern[_own_held(fit)]
            due[here] = (found != pattern).any(axis=1)
            sides[here] = found
        if not due.any():
            break
    p = np.zeros(len(rows))
    for pattern in np.unique(sides, axis=0):
        here = (sides == pattern).all(axis=1)
        there = fits.setdefault(tuple(pattern), _standing_on(fit, pattern))
        if (late := here & due).any():
            held = pattern != 0
            held[_own_held(fit)] = False
            low, high = np.where(held, there.x, least), np.where(held, there.x, most)
            residuals = there.linear.residual + rows[late]
            x[late], _ = bounded_least_squares(there.whole_design, residuals, there.x, low, high)
        p[here] = _p_values(one if there is fit else judge.judged(one.name, there), rows[here])
    return p, x


def _standing_on(fit: Fit, pattern: NDArray[np.int_]) -> Fit:
    """The model with these bounds active (-1 the lower, 1 the upper); what else stood at a bound is just off it."""
    least, most = bounds(fit.problem, fit.own, fit.box)
    off = OFF_BOUND * (most - least)
    inside = np.clip(fit.x, least + off, most - off)
    return replace(fit, x=np.where(pattern > 0, most, np.where(pattern < 0, least, inside)))


def _side(fit: Fit) -> NDArray[np.int_]:
    """(q,) where a fit stands: -1 at the lower bound, 1 at the upper, 0 between."""
    least, most = bounds(fit.problem, fit.own, fit.box)
    return np.where(fit.at_bound, np.where(fit.x - least < most - fit.x, -1, 1), 0)


def _own_held(fit: Fit) -> slice:
    """Place of an effect held at b = 0: whether a draw frees it is part of its reference already."""
    count = len(fit.x)
    return slice(count - len(fit.own) if fit.linear.held is not None else count, count)


def bounded_least_squares(
    design: Array, residuals: Array, start: Array, low: Array, high: Array
) -> tuple[Array, NDArray[np.int_]]:
    """Minimise |residual - design (x - start)|^2 for low <= x <= high, for many residuals of one design.

    Active sets by their optimality conditions: an unknown beyond a bound is held there, a held one whose gradient
    points inwards is freed, until nothing changes (Bergounioux, Ito and Kunisch, SIAM J. Control Optim. 37 (1999)
    1176). Draws that do not settle are solved one by one (Stark and Parker, Comput. Stat. 10 (1995) 129).

    Parameters
    ----------
    design : (rows, q) array
        Change of the model by every unknown.
    residuals : (draws, rows) array
        Data minus model at `start`.
    start, low, high : (q,) arrays
        Where the model is linearised, and the bounds; equal ones fix an unknown.

    Returns
    -------
    tuple
        x (draws, q), and its active bounds (draws, q): -1 the lower (and a fixed unknown), 1 the upper, 0 none.
    """
    if (fixed := low >= high).any():
        x, sides = np.tile(low, (len(residuals), 1)), np.full((len(residuals), len(start)), -1)
        if not fixed.all():
            left = residuals - design[:, fixed] @ (low - start)[fixed]
            x[:, ~fixed], sides[:, ~fixed] = bounded_least_squares(
                design[:, ~fixed], left, start[~fixed], low[~fixed], high[~fixed]
            )
        return x, sides
    sides = np.zeros((len(residuals), len(start)), dtype=int)
    x = np.tile(start, (len(residuals), 1))
    room = ROUNDING * np.maximum(high - low, 1e-300)
    due = np.ones(len(residuals), dtype=bool)
    for _ in range(CHANGES):
        for pattern in np.unique(sides[due], axis=0):
            here = due & (sides == pattern).all(axis=1)
            free = pattern == 0
            x[here] = np.where(pattern > 0, high, np.where(pattern < 0, low, start))
            left = residuals[here] - design @ (x[here][0] - start)
            step = left @ np.linalg.pinv(design[:, free]).T
            x[np.ix_(here, free)] += step
            inwards = -pattern * ((left - step @ design[:, free].T) @ design)
            held = ~free & (inwards <= 0.0)
            found = np.where(held, pattern, 0)
            found = np.where(free & (x[here] < low - room), -1, np.where(free & (x[here] > high + room), 1, found))
            due[here] = (found != pattern).any(axis=1)
            sides[here] = found
        if not due.any():
            break
    for i in np.flatnonzero(due):
        solved = lsq_linear(design, residuals[i], (low - start, high - start), method="bvls")
        x[i], sides[i] = start + solved.x, solved.active_mask
    return np.clip(x, low, high), sides


def _rows(one: Judged, noise: Array) -> Array:
    """(draws, rows) whitened noise; priors have none."""
    whitened = one.fit.problem.whitener.apply(noise)
    priors = np.zeros((len(noise), len(one.fit.linear.residual) - whitened.shape[1]))
    return np.hstack([whitened, priors])


def _p_values(one: Judged, rows: Array) -> Array:
    """p (draws,) by the linearisation where the model stands; unknowns at a bound stay there."""
    linear = one.fit.linear
    return one.reference.p_values(_bounded(one, linear.remainder + linear.project(rows.T).T))


def _bounded(one: Judged, remainders: Array) -> Array:
    """Of an effect held at b = 0: what b > 0 explains in a draw is gone."""
    held = one.fit.linear.held
    if held is None:
        return remainders
    own = one.fit.linear.signatures[:, held]
    return remainders - np.maximum(remainders @ own, 0.0)[:, None] * own
