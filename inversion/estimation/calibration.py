"""Calibration: parameters and time origin that fit the measurement best, by least squares on the emulator.

Minimises |W (y - f(theta, t0))|^2 + |(z - mean) / sd|^2 + (t0 / sigma)^2: measurement, prior, nuisance. Several starts
in every box, because an activity limit or a time shift makes several minima; those that the data cannot
separate are kept.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import qmc
from threadpoolctl import threadpool_limits

from birdstrike.data.histories import Array
from birdstrike.inversion.estimation.coordinates import Box, Coordinates
from birdstrike.inversion.estimation.curve_model import CurveModel
from birdstrike.inversion.estimation.whitening import Whitening, residual_correlation, widened
from birdstrike.inversion.observations.expected import FARTHEST_ORIGIN
from birdstrike.inversion.results.fit import ResidualCorrelation

CANDIDATES = 128
STARTS = 3
INDISTINGUISHABLE = 3.84  # chi-square with one degree of freedom, 95 %
WORTH_REFINING = 30.0
SAME = 1e-2  # of a range: starts that meet here have found one minimum
STEP = 1e-4  # of a range, for derivatives of the emulator


@dataclass(frozen=True)
class Mode:
    """One minimum: z (r,), parameters theta (k,) SI, time origin t0 [s], covariance (r + 1, r + 1) of (z, t0).

    cost: minus twice the log posterior up to a constant; residual: (n,) whitened y - f; box: where z was sought.
    """

    z: Array
    theta: Array
    t0: float
    covariance: Array
    cost: float
    residual: Array
    box: Box

    @property
    def root(self) -> Array:
        """(r, r) Cholesky factor of the covariance of z."""
        return np.linalg.cholesky(self.covariance[:-1, :-1] + 1e-12 * np.eye(len(self.z)))


@dataclass(frozen=True)
class Calibrator:
    """The fitting problem; sigma: standard deviation of the time origin [s], 0 where it is known."""

    model: CurveModel
    coordinates: Coordinates
    sigma: float

    def with_known(self, columns: Array) -> Calibrator:
        """The problem with further directions (n, q) of known error, SI, one standard deviation each."""
        known = columns if self.model.known is None else np.hstack([self.model.known, columns])
        return replace(self, model=replace(self.model, known=known))

    def fit(self, seed: int = 0) -> tuple[Mode, ...]:
        """The best minimum first, then those whose cost is within 3.84 of it."""
        with threadpool_limits(limits=1, user_api="blas"):
            rough = [mode for box in self.coordinates.boxes for mode in self._search(box, seed)]
            modes = [self._again(mode) for mode in _worth_refining(rough)]
        modes.sort(key=lambda mode: mode.cost)
        return tuple(mode for mode in modes if mode.cost < modes[0].cost + INDISTINGUISHABLE)

    def best_fits(self, seed: int = 0) -> tuple[Mode, tuple[Mode, ...], ResidualCorrelation]:
        """The best fit to the noise as stated, the minima once the noise is as its residual shows, and the residual.

        With the noise raised everything follows: the intervals widen, and minima that no longer can be ruled out stay.
        """
        modes = self.fit(seed)
        residual = residual_correlation(self.model.observations, modes[0].residual)
        return modes[0], modes if residual.white else self.raised(residual).fit(seed), residual

    def raised(self, residual: ResidualCorrelation) -> Calibrator:
        """The problem with the noise as the residual of its best fit shows; as it is where that is white noise."""
        if residual.white:
            return self
        return replace(self, model=replace(self.model, observations=widened(self.model.observations, residual)))

    def tau(self, mode: Mode) -> float:
        """A mode's time origin in its standard deviations, 0 where it is known."""
        return mode.t0 / self.sigma if self.sigma else 0.0

    @property
    def offsets(self) -> tuple[float, float]:
        """Time origins allowed, in sigmas: no measured point may leave the simulated record at its end."""
        if not self.sigma:
            return 0.0, 0.0
        earliest = (self.model.observations.last - self.model.end) / self.sigma
        return max(-FARTHEST_ORIGIN, min(earliest, 0.0)), FARTHEST_ORIGIN

    def whitening(self, mode: Mode) -> Whitening:
        """Noise and the model's error where a fit stands."""
        return self._whitening(mode.theta, mode.t0)

    def held(self, mode: Mode, whitening: Whitening, i: int, value: float) -> Mode:
        """The best fit near `mode` with coordinate i held at `value`, inside its box, errors as in `whitening`."""
        lows, highs = mode.box.lows.copy(), mode.box.highs.copy()
        lows[i] = highs[i] = value
        z = mode.z.copy()
        z[i] = value
        box = replace(mode.box, lows=lows, highs=highs)
        return self._refine(z, self.tau(mode), whitening, box)

    def information(self, mode: Mode) -> Array:
        """Fisher information (r, r) of z at `mode`, of the data alone, the time origin marginalised by its prior."""
        return self.data_information(mode.z, self.tau(mode), self.whitening(mode), mode.box)

    def data_information(self, z: Array, tau: float, whitening: Whitening, box: Box) -> Array:
        """The same at any z (r,) of a box and time origin tau [sigmas], for residuals whitened so."""
        rows = self._derivatives(np.append(z, tau), whitening, box)
        data = rows[: len(self.model.observations.values)]
        slopes, shift = data[:, :-1], data[:, -1]
        lost = slopes.T @ shift
        return slopes.T @ slopes - np.outer(lost, lost) / (1.0 + shift @ shift)

    def _search(self, box: Box, seed: int) -> list[Mode]:
        """Fits from the best few of many candidates in a box."""
        draws = qmc.Sobol(len(box.lows), rng=seed).random(CANDIDATES)
        z = np.vstack([(box.lows + box.highs) / 2.0, box.lows + draws * (box.highs - box.lows)])
        taus = np.unique(np.clip(np.linspace(-2.0, 2.0, 9), *self.offsets))
        theta = self.coordinates.theta(z, box)
        whitening, scores = self._whitening(theta[0], 0.0), self.model.scores(theta)
        costs = np.stack([self._candidate_costs(whitening, scores, z, tau) for tau in taus])
        order = np.argsort(costs.min(axis=0))[:STARTS]
        return [self._refine(z[i], float(taus[costs[:, i].argmin()]), whitening, box) for i in order]

    def _candidate_costs(self, whitening: Whitening, scores: list[Array], z: Array, tau: float) -> Array:
        residual = whitening.apply(self.model.observations.values - self.model.curves(scores, tau * self.sigma))
        prior = self.coordinates.prior.deviations(z)
        return (residual**2).sum(axis=1) + (prior**2).sum(axis=1) + tau**2

    def _whitening(self, theta: Array, t0: float) -> Whitening:
        """Noise and the emulator's own error where the fit stands."""
        return self.model.whitening(t0, self.model.error_factor(theta, t0))

    def _again(self, mode: Mode) -> Mode:
        """A minimum with the emulator's error where it lies, no longer where the search began."""
        return self._refine(mode.z, self.tau(mode), self.whitening(mode), mode.box)

    def _refine(self, z: Array, tau: float, whitening: Whitening, box: Box) -> Mode:
        """Least squares from a start, with the emulator's error as it is in `whitening`."""
        r = len(z)
        low, high = np.append(box.lows, self.offsets[0]), np.append(box.highs, self.offsets[1])
        room = np.maximum(high - low, 1e-9)
        low, high = low - 1e-9 * room, low + room * (1.0 + 1e-9)
        p = np.clip(np.append(z, tau), low + 1e-6 * room, high - 1e-6 * room)
        slopes: Any = partial(self._derivatives, whitening=whitening, box=box)
        rows = partial(self._rows, whitening=whitening, box=box)
        found = least_squares(rows, p, slopes, (low, high), xtol=1e-7)
        z = np.clip(found.x[:r], box.lows, box.highs)
        units = np.append(np.ones(r), self.sigma)
        covariance = np.linalg.inv(found.jac.T @ found.jac) * np.outer(units, units)
        n = len(self.model.observations.values)
        t0 = float(np.clip(found.x[r], *self.offsets)) * self.sigma
        cost = 2.0 * found.cost + whitening.log_determinant
        return Mode(
            z=z,
            theta=self.coordinates.theta(z, box),
            t0=t0,
            covariance=covariance,
            cost=cost,
            residual=found.fun[:n],
            box=box,
        )

    def _rows(self, p: Array, whitening: Whitening, box: Box) -> Array:
        """Whitened data residuals, then prior, then time origin."""
        z, tau = p[:-1], p[-1]
        curve = self.model.curve(self.coordinates.theta(z[None], box)[0], tau * self.sigma)
        prior = self.coordinates.prior.deviations(z)
        return np.concatenate([whitening.apply(self.model.observations.values - curve), prior, [tau]])

    def _derivatives(self, p: Array, whitening: Whitening, box: Box) -> Array:
        """d rows / d p by differences inside the box, so that none is taken across an activity limit."""
        z, tau = p[:-1], p[-1]
        r = len(z)
        up, down = np.minimum(z + STEP, box.highs), np.maximum(z - STEP, box.lows)
        places = np.vstack([z, z + np.diag(up - z), z + np.diag(down - z)])
        scores = self.model.scores(self.coordinates.theta(places, box))
        curves = self.model.curves(scores, tau * self.sigma)
        width = np.where(up - down > 1e-3 * STEP, up - down, np.inf)  # no slope where a coordinate is held
        slopes = (curves[1 : r + 1] - curves[r + 1 :]) / width[:, None]
        shift = self._time_slope([s[:1] for s in scores], tau)
        data = -whitening.apply(np.vstack([slopes, shift]))
        return np.vstack([data.T, np.diag(np.append(1.0 / self.coordinates.prior.sd, 1.0))])

    def _time_slope(self, scores: list[Array], tau: float) -> Array:
        """d curve / d tau (1, n)."""
        if not self.sigma:
            return np.zeros((1, len(self.model.observations.values)))
        low, high = self.offsets
        up, down = min(tau + 1e-2, high), max(tau - 1e-2, low)
        return (self.model.curves(scores, up * self.sigma) - self.model.curves(scores, down * self.sigma)) / (up - down)


def _worth_refining(modes: list[Mode]) -> list[Mode]:
    """Minima not hopelessly above the best, each once."""
    kept: list[Mode] = []
    lowest = min(mode.cost for mode in modes)
    for mode in sorted(modes, key=lambda m: m.cost):
        new = not any(m.box is mode.box and np.allclose(m.z, mode.z, rtol=0.0, atol=SAME) for m in kept)
        if new and mode.cost < lowest + WORTH_REFINING:
            kept.append(mode)
    return kept
