"""The numerical error on a record's points: draws turned into a covariance, and how well they predict one another."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.inversion.diagnosis.widened import about, process


@dataclass(frozen=True)
class PointError:
    """Covariance of the numerical error on n points, as a function of unit gain and shift there.

    choices: (n, n) of the single numerical choices; changes, rest: (k, n) the draws and what gain and shift leave of
    them; moments: (k, 2 channels) these gains and shifts; frames: (k, 2 channels, n) what they act on; weights:
    (2 channels,) of them; processes: (length [s], share) per channel; times [s], channel: (n,) of the points; size: by
    which all that the draws differ by is multiplied.
    """

    choices: Array
    changes: Array
    rest: Array
    moments: Array
    frames: Array
    weights: Array
    processes: Sequence[tuple[float, float]]
    times: Array
    channel: np.ndarray
    size: float = 1.0

    def at(self, frame: Array) -> Array:
        """(n, n) where gain and shift by one unit are frame (2 channels, n)."""
        return self.fixed(frame) + self.size * self.drawn(frame)

    def fixed(self, frame: Array) -> Array:
        """(n, n) single choices, and what the draws have in common: a yet finer mesh may add as much again."""
        if not len(self.rest):
            return self.choices
        mean = self.mean(frame)
        return self.choices + np.outer(mean, mean)

    def drawn(self, frame: Array) -> Array:
        """(n, n) by what the draws differ, at size 1."""
        if not len(self.rest):
            return np.zeros_like(self.choices)
        moved = (about(self.moments)[1] * np.sqrt(self.weights)) @ frame
        return self.still + moved.T @ moved / len(self.rest)

    def mean(self, frame: Array) -> Array:
        """(n,) what the draws have in common, where gain and shift by one unit are frame (2 channels, n)."""
        return self.moments.mean(axis=0) @ frame + self.rest.mean(axis=0)

    @cached_property
    def still(self) -> Array:
        """(n, n) what of the draws' part does not go with the curve: asked for at every refit, and always the same."""
        rest = about(self.rest)[1]
        found = rest.T @ rest / len(rest)
        for number, (length, share) in enumerate(self.processes):
            here = np.flatnonzero(self.channel == number)
            found[np.ix_(here, here)] += process(rest[:, here], self.times[here], length, share)
        return found

    def without(self, draw: int) -> PointError:
        """As it would be known without one of the draws."""
        kept = np.arange(len(self.rest)) != draw
        parts = {name: getattr(self, name)[kept] for name in ("changes", "rest", "moments", "frames")}
        return replace(self, **parts)

    def sized(self, size: float) -> PointError:
        """With another size."""
        return replace(self, size=size)
