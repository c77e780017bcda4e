"""What the discretisation does to the curves, as a covariance of the model's error.

Two parts. *Draws*: at several places of the parameters' box the strike is made twice, as declared and on a finer mesh
with another lattice lying otherwise in the bird's outline; the changes are draws of what a finer strike will differ by.
What they have in common moves the models' curves, and a mesh finer still may add as much again: one direction more.
*Choices* that the draws leave alone (artificial viscosity, smoothing length; the contact's gap goes with the particle
spacing) are changed once each, and the change d of the curves enters as d d^T.

Much of a draw is a gain and a shift in time of the strike's own curve (the lattice moves the bird's front and spreads
its mass), so these two go with the curve at which the error is asked for. What remains spans little; its covariance
is widened by a stationary process under its envelope, whose share and length, and the weight of gain and shift, are
those that predict each draw best from the others.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import block_diag

from birdstrike.data.histories import Array
from birdstrike.inversion.diagnosis.point_error import PointError
from birdstrike.inversion.diagnosis.widened import Draws

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
    def scatter(self) -> Array:
        """(channels,) mean square of half of what a draw is about their mean: the other half is the finer strike's."""
        if len(self.changes) < FEWEST:
            return np.zeros(self.channels)
        powers = [(0.5 * part.var(axis=0, ddof=1)).mean() for part in np.split(self.changes, self.channels, axis=1)]
        return np.array(powers)

    @property
    def correlation(self) -> tuple[float, ...]:
        """Per channel, the time [s] over which what is rough in the draws hangs together."""
        return tuple(_correlation_time(rest, self.step) for rest in np.split(self._split[1], self.channels, axis=1))

    def on(self, sample: Callable[[Array], Array], times: Array, channel: np.ndarray, measurement: Array) -> PointError:
        """The error on a record's points.

        sample: curves (q, grid) to points (q, n); times [s], channel: of every point; measurement: (n, n) of the
        noise, beside which the process is judged.
        """
        d = sample(self._single)
        choices, weights, processes = d.T @ d, np.ones(2 * self.channels), []
        if len(self.changes) < FEWEST:
            none = np.zeros((0, 2 * self.channels))
            return PointError(choices, d[:0], d[:0], none, none[:, :, None], weights, (), times, channel)
        moments, rest = self._split
        changes, left = sample(self.changes), sample(rest)
        frames = np.stack([sample(self.frame(shape)) for shape in self.shapes])
        for number in range(self.channels):
            here = np.flatnonzero(channel == number)
            block, own = np.ix_(here, here), slice(2 * number, 2 * number + 2)
            one = frames[:, own][:, :, here]
            draws = Draws(changes[:, here], left[:, here], moments[:, own], one, times[here], measurement[block])
            length, share, weights[own] = draws.best()
            processes.append((length, share))
        return PointError(choices, changes, left, moments, frames, weights, processes, times, channel)

    def through(self, error: PointError, sample: Callable[[Array], Array]) -> PointError:
        """The error of a record whose instruments turn changes (q, grid) of the curves into sample (q, n)."""
        d = sample(self._single)
        rest = sample(self._split[1]) if len(error.rest) else error.rest
        return replace(error, choices=d.T @ d, rest=rest)

    @property
    def _single(self) -> Array:
        """(q, grid) changes that are a direction each: of single choices, and of draws too few to tell more."""
        few = self.changes if len(self.changes) < FEWEST else self.changes[:0]
        return np.vstack([few, *self.directions.values()])

    def finer(self, curves: Array) -> Array:
        """(q, grid) declared curves with what finer meshes add to them on average, once there are draws to tell."""
        if len(self.changes) < FEWEST:
            return curves
        moments, rest = self._mean
        parts = [
            (1.0 + gain) * part + shift * np.gradient(part, self.step, axis=1)
            for part, (gain, shift) in zip(np.split(curves, self.channels, axis=1), moments.reshape(-1, 2), strict=True)
        ]
        return np.concatenate(parts, axis=1) + rest

    def frame(self, curve: Array) -> Array:
        """(2 channels, grid) unit gain and shift in time of every channel of a curve (grid,), the others zero."""
        parts = np.split(curve, self.channels)
        return np.asarray(block_diag(*(np.stack([part, np.gradient(part, self.step)]) for part in parts)))

    @cached_property
    def _split(self) -> tuple[Array, Array]:
        """(k, 2 channels) gains and shifts of the draws, and (k, grid) what they leave."""
        if not len(self.changes):
            return np.zeros((0, 2 * self.channels)), self.changes
        frames = [self.frame(shape) for shape in self.shapes]
        moments = [_moments(frame, change) for frame, change in zip(frames, self.changes, strict=True)]
        rest = [d - m @ f for f, d, m in zip(frames, self.changes, moments, strict=True)]
        return np.stack(moments), np.stack(rest)

    @cached_property
    def _mean(self) -> tuple[Array, Array]:
        """(2 channels,) mean gains and shifts, and (grid,) mean rest: asked for with every curve of every refit."""
        moments, rest = self._split
        return moments.mean(axis=0), rest.mean(axis=0)


def _moments(frame: Array, change: Array) -> Array:
    """(q,) least-squares gains and shifts in a change (grid,); the rows of frame (q, grid) are in many units."""
    size = np.linalg.norm(frame, axis=1)
    size[size == 0.0] = 1.0
    return np.linalg.lstsq((frame / size[:, None]).T, change, rcond=1e-10)[0] / size


def _correlation_time(rest: Array, step: float) -> float:
    """Length l [s] of exp(-lag^2 / 2 l^2) that has the rest's correlation at a lag of 2."""
    total = float((rest**2).sum())
    if total == 0.0:
        return step
    rho = max(float((rest[:, 2:] * rest[:, :-2]).sum()) / total, 0.05)
    return 2.0 * step / np.sqrt(-2.0 * np.log(min(rho, 0.995)))
