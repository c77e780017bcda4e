"""The emulator on the measured instants: stacked curves and their error for parameters and a time origin."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.inversion.estimation.whitening import Whitening
from birdstrike.inversion.observations.observations import Observations
from birdstrike.surrogate.emulator import CurveEmulator, Emulator


@dataclass(frozen=True)
class CurveModel:
    """f(theta, t0): the model at (measured instant - t0), all channels one after the other.

    known: (n, s) SI further errors common to many points, a column for one standard deviation of each: uncertain speed
    or thickness, mesh error, a stated discrepancy; none by default.
    """

    emulator: Emulator
    observations: Observations
    known: Array | None = None

    @property
    def end(self) -> float:
        """End of the simulated record [s]."""
        return float(next(iter(self.emulator.channels.values())).time[-1])

    def noise_at(self, t0: float) -> Array:
        """(n,) standard deviations of the points by themselves: measurement noise, and scatter common to no others."""
        parts = (emulator.outside_at(times) for emulator, times in self._channels(t0))
        return np.sqrt(self.observations.noise**2 + np.concatenate(list(parts)))

    def whitening(self, t0: float, factor: Array) -> Whitening:
        """Of the points' noise for time origin t0 [s] and errors common to many, factor (n, c) SI.

        The scatter that `noise_at` adds to a correlated noise is taken to be correlated alike.
        """
        return Whitening.of(self.noise_at(t0), factor, self.observations.correlation)

    def scores(self, theta: Array) -> list[Array]:
        """Component scores of every channel at theta (q, k) SI; the costly part, the same for every time origin."""
        u = self.emulator.inputs(theta)
        return [self.emulator.channels[c.name].scores(u) for c in self.observations.channels]

    def curves(self, scores: list[Array], t0: float) -> Array:
        """Stacked curves (q, n) SI for time origin t0 [s]."""
        parts: list[Array] = []
        for channel, score in zip(self.observations.channels, scores, strict=True):
            mean, basis = self.emulator.channels[channel.name].at(channel.times - t0)
            parts.append(mean + score @ basis[: score.shape[1]])
        return np.concatenate(parts, axis=1)

    def curve(self, theta: Array, t0: float) -> Array:
        """Stacked curve (n,) SI at one point theta (k,) SI, for time origin t0 [s]."""
        return self.curves(self.scores(theta[None]), t0)[0]

    def error_factor(self, theta: Array, t0: float) -> Array:
        """F (n, c): F F^T is the covariance of the model's error at theta (k,): the emulator's, and what is known
        besides.

        The emulator's columns are common to its channels.
        """
        u = self.emulator.inputs(theta[None])[0]
        return self._with_known([e.error_factor(u, times) for e, times in self._channels(t0)])

    def scatter_factor(self, theta: Array, t0: float) -> Array:
        """The same of an emulator of any number of runs: their scatter alone, and what is known besides."""
        u = self.emulator.inputs(theta[None])[0]
        return self._with_known([e.scatter_factor(u, times) for e, times in self._channels(t0)])

    def _channels(self, t0: float) -> list[tuple[CurveEmulator, Array]]:
        """Every channel's emulator with its instants on the model's clock."""
        return [(self.emulator.channels[c.name], c.times - t0) for c in self.observations.channels]

    def _with_known(self, factors: list[Array]) -> Array:
        own = np.vstack(factors)
        return own if self.known is None else np.hstack([own, self.known])
