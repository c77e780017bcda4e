"""Refit of one model: parameters, nuisances and the magnitude of its effect together, by bounded least squares."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import qmc

from birdstrike.data.histories import Array
from birdstrike.inversion.diagnosis.calibrated import Columns
from birdstrike.inversion.diagnosis.covariance import Whitener
from birdstrike.inversion.diagnosis.linear import Linear
from birdstrike.inversion.diagnosis.model import Model, Place
from birdstrike.inversion.estimation.coordinates import Box

CANDIDATES = 64
STARTS = 3
STEP_Z, STEP_B = 5e-3, 2e-2  # of a range, of a plausible size: central differences of the emulated model
AT_BOUND = 1e-4
FARTHEST_NUISANCE = 5.0


@dataclass(frozen=True)
class Problem:
    """What every model is fitted to.

    model: f(z, b); whitener: of y - f; nuisances: (index of the effect, sigma in plausible sizes) of what is known
    with a stated uncertainty.
    """

    model: Model
    whitener: Whitener
    nuisances: tuple[tuple[int, float], ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Effects in the order of b."""
        return tuple(known.name for known in self.model.known)

    def index(self, name: str) -> int:
        """Place of an effect in b."""
        return self.names.index(name)


@dataclass(frozen=True)
class Fit:
    """A minimum: z (r,) in its box, nuisances v (in sigmas), own magnitudes b of the effects `own` (indices).

    cost: |r|^2 with priors; linear: the model there.
    """

    problem: Problem
    own: tuple[int, ...]
    box: Box
    x: Array
    cost: float

    @property
    def z(self) -> Array:
        """(r,) parameters in 0..1."""
        return self.x[: len(self.box.lows)]

    @property
    def theta(self) -> Array:
        """(k,) parameters, SI."""
        return self.problem.model.coordinates.theta(self.z, self.box)

    @property
    def v(self) -> Array:
        """Nuisances in sigmas."""
        r = len(self.box.lows)
        return self.x[r : r + len(self.problem.nuisances)]

    @property
    def magnitudes(self) -> Array:
        """b of the model's own effects."""
        return self.x[len(self.box.lows) + len(self.problem.nuisances) :]

    @property
    def b(self) -> Array:
        """(m,) all effects: own ones and nuisances."""
        return _effects(self.problem, self.own, self.v[None], self.magnitudes[None])[0]

    @property
    def place(self) -> Place:
        """Where the fit stands, as one row."""
        return Place(self.z[None], self.b[None])

    @property
    def curve(self) -> Array:
        """(n,) the model on the record's points."""
        return self.problem.model.points(self.place, self.box)[0]

    @property
    def mesh(self) -> Array:
        """(n,) the part of the curve that finer meshes add, on average, to the declared one."""
        model = self.problem.model
        return self.curve - model.recorded(model.grid(self.place, self.box), self.place.b)[0]

    @cached_property
    def linear(self) -> Linear:
        """The model linearised at this fit; unknowns at their bounds leave the design."""
        return linearise(self)

    @property
    def at_bound(self) -> np.ndarray:
        """(q,) unknowns held by a bound."""
        low, high = bounds(self.problem, self.own, self.box)
        near = AT_BOUND * np.maximum(high - low, 1e-12)
        return (self.x <= low + near) | (self.x >= high - near)

    @property
    def at_limit(self) -> bool:
        """Whether an effect of its own is held by the largest magnitude that is looked at, no bound of physics."""
        known = [self.problem.model.known[i] for i in self.own]
        held = self.at_bound[len(self.x) - len(self.own) :]
        return any(
            hit and (b > 0.0 or (b < 0.0 and one.least == -one.most))
            for one, hit, b in zip(known, held, self.magnitudes, strict=True)
        )

    @cached_property
    def slopes(self) -> Array:
        """(rows, shared + m) change of the model by every shared unknown and every effect, at this fit."""
        return _slopes(self)

    @property
    def whole_design(self) -> Array:
        """(rows, q) of all unknowns of the model, those at a bound too."""
        shared = _shared(self)
        return self.slopes[:, [*range(shared), *(shared + i for i in self.own)]]

    def covariance(self) -> Array:
        """(q, q) of all unknowns at the fit; a bound cuts intervals off, it does not make an unknown known."""
        return np.linalg.pinv(self.whole_design.T @ self.whole_design)


def columns_of(fit: Fit) -> Columns:
    """What the record is read for, at a fit: derivatives on its points, not whitened."""
    plain = replace(fit.problem, whitener=Whitener.of(np.eye(len(fit.problem.model.record.values))))
    slopes, n, shared = _slopes(replace(fit, problem=plain)), len(fit.problem.model.record.values), _shared(fit)
    return Columns(slopes[:n, :shared], slopes[n:, :shared], slopes[:n, shared:])


def _effects(problem: Problem, own: Sequence[int], v: Array, magnitudes: Array) -> Array:
    """(q, m) magnitudes of all effects from nuisances v (q, p) and own magnitudes (q, o)."""
    b = np.zeros((len(v), len(problem.model.known)))
    for column, (index, sigma) in enumerate(problem.nuisances):
        b[:, index] += sigma * v[:, column]
    for column, index in enumerate(own):
        b[:, index] += magnitudes[:, column]
    return b


def bounds(problem: Problem, own: Sequence[int], box: Box) -> tuple[Array, Array]:
    """Physical bounds of the unknowns: the box, nuisances within 5 sigma, effects within theirs."""
    far = np.full(len(problem.nuisances), FARTHEST_NUISANCE)
    effects = [problem.model.known[i] for i in own]
    low = np.concatenate([box.lows, -far, [known.least for known in effects]])
    high = np.concatenate([box.highs, far, [known.most for known in effects]])
    return low, np.maximum(high, low + 1e-9)


def rows_of(problem: Problem, own: Sequence[int], box: Box, x: Array) -> Array:
    """(q, rows) whitened y - f, then prior minus value, for unknowns x (q, ...)."""
    r, p = len(box.lows), len(problem.nuisances)
    z, v = x[:, :r], x[:, r : r + p]
    curves = problem.model.points(Place(z, _effects(problem, own, v, x[:, r + p :])), box)
    coordinates = problem.model.coordinates
    prior = (coordinates.mean - z) / coordinates.sd
    return np.hstack([problem.whitener.apply(problem.model.record.values - curves), prior, -v])


def slopes_of(problem: Problem, own: Sequence[int], box: Box, x: Array) -> Array:
    """(rows, q) derivatives of the rows by central differences inside the bounds."""
    low, high = bounds(problem, own, box)
    step = np.concatenate([np.full(len(box.lows), STEP_Z), np.full(len(x) - len(box.lows), STEP_B)])
    up, down = np.minimum(x + step, high), np.maximum(x - step, low)
    moved = np.vstack([x + np.diag(up - x), x + np.diag(down - x)])
    rows = rows_of(problem, own, box, moved)
    q = len(x)
    return ((rows[:q] - rows[q:]) / np.maximum(up - down, 1e-12)[:, None]).T


def refine(problem: Problem, own: Sequence[int], box: Box, start: Array) -> Fit:
    """Least squares from a start."""
    low, high = bounds(problem, own, box)
    margin = 1e-6 * (high - low)

    def rows(x: Array) -> Array:
        return rows_of(problem, own, box, x[None])[0]

    slopes: Any = partial(slopes_of, problem, own, box)
    found = least_squares(
        rows, np.clip(start, low + margin, high - margin), slopes, (low, high), xtol=1e-6, ftol=1e-9, max_nfev=40
    )
    near = AT_BOUND * np.maximum(high - low, 1e-12)
    x = np.where(found.x <= low + near, low, np.where(found.x >= high - near, high, found.x))
    return Fit(problem, tuple(own), box, x, float((rows(x) ** 2).sum()))


def fit_none(problem: Problem, seed: int = 0) -> list[Fit]:
    """Minima of the model without effects, best first: the best few of many candidates in every box."""
    coordinates, fits = problem.model.coordinates, []
    for box in coordinates.boxes:
        draws = qmc.Sobol(len(box.lows), rng=seed).random(CANDIDATES)
        z = np.vstack([(box.lows + box.highs) / 2.0, box.lows + draws * (box.highs - box.lows)])
        x = np.hstack([z, np.zeros((len(z), len(problem.nuisances)))])
        cost = (rows_of(problem, (), box, x) ** 2).sum(axis=1)
        fits += [refine(problem, (), box, x[i]) for i in np.argsort(cost)[:STARTS]]
    fits.sort(key=lambda fit: fit.cost)
    return fits


def fit_effect(problem: Problem, own: Sequence[int], bases: Sequence[Fit]) -> Fit:
    """The best minimum with the effects `own` free: from fits without them and both signs, the best starts refined."""
    signs = [np.zeros(len(own)), np.ones(len(own)), -np.ones(len(own))]
    found: list[tuple[float, Box, Array]] = []
    for base in bases:
        low, high = bounds(problem, own, base.box)
        x = np.clip([np.append(base.x[: _shared(base)], sign) for sign in signs], low, high)
        found += [
            (cost, base.box, start)
            for cost, start in zip((rows_of(problem, own, base.box, x) ** 2).sum(1), x, strict=True)
        ]
    found.sort(key=lambda start: start[0])
    fits = [refine(problem, own, box, start) for _, box, start in found[:STARTS]]
    return min(fits, key=lambda fit: fit.cost)


def again(fit: Fit, problem: Problem) -> Fit:
    """The same model fitted anew from where it stood, to a changed problem."""
    return refine(problem, fit.own, fit.box, fit.x)


def _shared(fit: Fit) -> int:
    """Unknowns that every model has."""
    return len(fit.box.lows) + len(fit.problem.nuisances)


def _slopes(fit: Fit) -> Array:
    """Every effect gets a column of its own beside the nuisances, at the magnitude that the fit gives it."""
    known = fit.problem.model.known
    magnitudes = np.zeros(len(known))
    magnitudes[list(fit.own)] = fit.magnitudes
    everything = tuple(range(len(known)))
    return -slopes_of(fit.problem, everything, fit.box, np.append(fit.x[: _shared(fit)], magnitudes))


def linearise(fit: Fit) -> Linear:
    """Residual, design of the free unknowns and all effects' columns at a fit."""
    problem, known = fit.problem, fit.problem.model.known
    shared, slopes = _shared(fit), fit.slopes
    residual = rows_of(problem, fit.own, fit.box, fit.x[None])[0]
    free = ~fit.at_bound
    design = fit.whole_design[:, free]
    own_bound = [i for i, is_free in zip(fit.own, free[shared:], strict=True) if not is_free]
    held = own_bound[0] if len(fit.own) == 1 and own_bound and known[own_bound[0]].one_sided else None
    return Linear(
        problem.names,
        residual,
        design,
        slopes[:, shared:],
        np.array([one.one_sided and (i not in fit.own or i == held) for i, one in enumerate(known)]),
        held,
    )
