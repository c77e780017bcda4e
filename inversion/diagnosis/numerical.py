"""What the discretisation does to the curves, as a covariance of the model's error.

Two parts. *Draws*: at several places of the parameters' box the strike is made twice, as declared and on a finer mesh
with another lattice lying otherwise in the bird's outline; the changes are draws of what a finer strike will differ by.
*Choices* that the draws leave alone (artificial viscosity, smoothing length; the contact's gap goes with the particle
spacing) are changed once each, and the change d of the curves enters as d d^T.

Much of a draw is a gain and a shift in time of the strike's own curve (the lattice moves the bird's front and spreads
its mass), so these two go with the curve at which the error is asked for. What remains spans little; its second moment
is widened by a stationary process under its envelope, whose share and length, and the weight of gain and shift, are
those that predict each draw best from the others.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.linalg import LinAlgError, block_diag, cholesky, solve_triangular
from scipy.ndimage import uniform_filter1d

from data.histories import Array

LENGTHS = tuple(2.0**-k for k in range(2, 9))  # of the record: correlation lengths that are tried
SHARES = (0.01, 0.03, 0.1, 0.3, 1.0, 3.0)  # of the rest's variance: shares of the process that are tried
WEIGHTS = (1.0, 1.5, 2.5)  # of gain and shift: few draws may show too little of them
ENVELOPE = 0.05  # of the record: over which the envelope is smoothed
FLOOR = 1e-3  # of the largest rest: no instant is free of error
POINTS = 100  # means over neighbours, on which the process is chosen
FEWEST = 3  # draws that can predict one another


@dataclass(frozen=True)
class Numerical:
    """Numerical error on the model's clock, `channels` stacked (grid,).

    shapes, changes: (k, grid) the declared curves at the draws' parameters, and what a finer strike adds to them;
    directions: name of a choice -> its change d (grid,); step [s] of the clock.
    """

    shapes: Array
    changes: Array
    directions: Mapping[str, Array]
    channels: int
    step: float

    @property
    def sizes(self) -> dict[str, Array]:
        """Name -> (grid,) typical change of the curves, for the user."""
        if not len(self.changes):
            return dict(self.directions)
        name = f"finer meshes on other lattices ({len(self.changes)} draws)"
        return {name: np.sqrt(np.mean(self.changes**2, axis=0)), **self.directions}

    @property
    def correlation(self) -> tuple[float, ...]:
        """Per channel, the time [s] over which what is rough in the draws hangs together."""
        return tuple(_correlation_time(rest, self.step) for rest in np.split(self._split[1], self.channels, axis=1))

    def on(
        self, sample: Callable[[Array], Array], times: Array, channel: np.ndarray, measurement: Array
    ) -> Callable[[Array], Array]:
        """The covariance (n, n) on the record's points as a function of unit gain and shift there, see `frame`.

        sample: curves (q, grid) to points (q, n); times [s], channel: of every point; measurement: (n, n) of the
        noise, beside which the process is judged.
        """
        fixed = np.zeros((len(times), len(times)))
        if self.directions:
            d = sample(np.stack(list(self.directions.values())))
            fixed += d.T @ d
        if len(self.changes) < FEWEST:
            d = sample(self.changes) if len(self.changes) else np.zeros((1, len(times)))
            return lambda _: fixed + d.T @ d
        moments, rest = self._split
        changes, left = sample(self.changes), sample(rest)
        fixed += left.T @ left / len(left)
        weights = np.ones(self.channels)
        for number in np.unique(channel):
            here = np.flatnonzero(channel == number)
            block, own = np.ix_(here, here), slice(2 * number, 2 * number + 2)
            frames = np.stack([sample(self.frame(shape)[own])[:, here] for shape in self.shapes])
            draws = Draws(changes[:, here], left[:, here], moments[:, own], frames, times[here], measurement[block])
            length, share, weights[number] = draws.best()
            fixed[block] += process(left[:, here], times[here], length, share)
        spread = moments * np.repeat(np.sqrt(weights), 2) / np.sqrt(len(moments))

        def at(frame: Array) -> Array:
            moved = spread @ frame
            return fixed + moved.T @ moved

        return at

    def frame(self, curve: Array) -> Array:
        """(2 channels, grid) unit gain and shift in time of every channel of a curve (grid,), the others zero."""
        parts = np.split(curve, self.channels)
        return np.asarray(block_diag(*(np.stack([part, np.gradient(part, self.step)]) for part in parts)))

    @property
    def _split(self) -> tuple[Array, Array]:
        """(k, 2 channels) gains and shifts of the draws, and (k, grid) what they leave."""
        if not len(self.changes):
            return np.zeros((0, 2 * self.channels)), self.changes
        frames = [self.frame(shape) for shape in self.shapes]
        moments = [np.linalg.lstsq(f.T, d, rcond=1e-10)[0] for f, d in zip(frames, self.changes, strict=True)]
        rest = [d - m @ f for f, d, m in zip(frames, self.changes, moments, strict=True)]
        return np.stack(moments), np.stack(rest)


@dataclass(frozen=True)
class Draws:
    """One channel's draws on its points.

    changes, rest: (k, n); moments: (k, 2) gains and shifts; frames: (k, 2, n) unit gain and shift of each draw's curve;
    times (n,) [s]; noise: (n, n).
    """

    changes: Array
    rest: Array
    moments: Array
    frames: Array
    times: Array
    noise: Array

    def best(self) -> tuple[float, float, float]:
        """Length [s] and share of the process, and weight of gain and shift, that predict each draw from the others.

        Score: expected log density of a draw with noise on it.
        """
        mean = _means(len(self.times))
        few = Draws(
            self.changes @ mean.T,
            self.rest @ mean.T,
            self.moments,
            self.frames @ mean.T,
            mean @ self.times,
            mean @ self.noise @ mean.T,
        )
        span = self.times[-1] - self.times[0]
        tried = list(product((share * span for share in LENGTHS), SHARES))
        length, share = tried[int(np.argmax([few.score(*one, WEIGHTS[0]) for one in tried]))]
        weight = WEIGHTS[int(np.argmax([few.score(length, share, one) for one in WEIGHTS]))]
        return length, share, weight

    def score(self, length: float, share: float, weight: float) -> float:
        """Sum over draws of the expected log density given the others."""
        kernel, total = matern(self.times, length), 0.0
        for i, own in enumerate(self.changes):
            others = np.arange(len(self.changes)) != i
            left, moved = self.rest[others], self.moments[others] @ self.frames[i]
            size = envelope(left)
            second = left.T @ left + weight * moved.T @ moved
            covariance = second / others.sum() + share * size[:, None] * kernel * size + self.noise
            try:
                lower = cholesky(covariance, lower=True, check_finite=False)
            except LinAlgError:
                return -np.inf
            inverse = solve_triangular(lower, np.eye(len(lower)), lower=True, check_finite=False)
            whitened = inverse @ own
            noisy = float(((inverse @ self.noise) * inverse).sum())
            total += -0.5 * (whitened @ whitened + noisy) - float(np.log(np.diag(lower)).sum())
        return total


def process(rest: Array, times: Array, length: float, share: float) -> Array:
    """(n, n) covariance under the envelope of draws (k, n), of a correlation length [s]."""
    size = envelope(rest)
    return share * size[:, None] * matern(times, length) * size


def envelope(rest: Array) -> Array:
    """(n,) smoothed root mean square of draws (k, n)."""
    width = max(3, round(ENVELOPE * rest.shape[1]))
    mean = uniform_filter1d((rest**2).mean(axis=0), width, mode="nearest")
    return np.sqrt(mean + (FLOOR * np.abs(rest).max()) ** 2)


def _means(n: int) -> Array:
    """(m, n) of means over neighbours, at most POINTS of them."""
    block = -(-n // POINTS)
    rows = np.repeat(np.arange(-(-n // block)), block)[:n]
    mean = (rows == np.arange(rows[-1] + 1)[:, None]).astype(float)
    return mean / mean.sum(axis=1, keepdims=True)


def matern(times: Array, length: float) -> Array:
    """Matern correlation 3/2 (Rasmussen & Williams, Gaussian Processes for Machine Learning, 2006, eq. 4.17)."""
    r = np.sqrt(3.0) * np.abs(times[:, None] - times) / length
    return (1.0 + r) * np.exp(-r)


def _correlation_time(rest: Array, step: float) -> float:
    """Length l [s] of exp(-lag^2 / 2 l^2) that has the rest's correlation at a lag of 2."""
    total = float((rest**2).sum())
    if total == 0.0:
        return step
    rho = max(float((rest[:, 2:] * rest[:, :-2]).sum()) / total, 0.05)
    return 2.0 * step / np.sqrt(-2.0 * np.log(min(rho, 0.995)))
