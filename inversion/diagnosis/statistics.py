"""Is a model consistent with the data? Directed and omnibus statistics, and their p-value by simulation.

Directed: S = max_j (g_j^T e)^2 / |P g_j|^2, the best that any other effect could still explain. Omnibus: Q = e^T e.
The p-value is that of min(p_S, p_Q), by draws of N(0, I) projected by P, so that looking at all effects at once, and
at two statistics, is paid for (reality check: White, Econometrica 68 (2000) 1097; Hansen et al., 79 (2011) 453).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.inversion.diagnosis.linear import Linear

DRAWS = 20_000


@dataclass(frozen=True)
class Consistency:
    """What the data say of one model: statistics, the p-value of both together, and the best other effect."""

    directed: float
    omnibus: float
    freedom: int
    p: float
    best: str | None


@dataclass(frozen=True)
class Reference:
    """Draws of both statistics under one model, sorted: the table in which observed ones are looked up.

    noise_freedom: degrees of freedom behind the noise level (inf: known); relative: the level is not known at all, so
    that only S / (Q/nu) is judged.
    """

    linear: Linear
    directed: Array
    omnibus: Array
    smaller: Array
    relative: bool

    @classmethod
    def of(
        cls, linear: Linear, noise_freedom: float = np.inf, relative: bool = False, draws: int = DRAWS, seed: int = 0
    ) -> Reference:
        """Simulate under the model."""
        rng = np.random.default_rng(seed)
        _, s, right = np.linalg.svd(linear.signatures, full_matrices=False)
        rank = int((s > 1e-9 * max(s.max(initial=0.0), 1e-300)).sum()) if linear.seen.any() else 0
        frame = s[:rank, None] * right[:rank]  # (rank, m): the signatures in the frame of their own span
        inside = rng.standard_normal((draws, rank))
        inside = _bounded(inside, frame, linear.held)
        scores = inside @ frame
        outside = rng.chisquare(linear.freedom - rank, draws) if linear.freedom > rank else np.zeros(draws)
        omnibus = (inside**2).sum(axis=1) + outside
        directed = squared(scores, linear).max(axis=1, initial=0.0)
        if np.isfinite(noise_freedom):
            level = rng.chisquare(noise_freedom, draws) / noise_freedom
            directed, omnibus = directed / level, omnibus / level
        if relative:
            directed = directed * linear.freedom / omnibus
        directed_sorted, omnibus_sorted = np.sort(directed), np.sort(omnibus)
        smaller = _smaller(directed, omnibus, directed_sorted, omnibus_sorted, relative)
        return cls(linear, directed_sorted, omnibus_sorted, np.sort(smaller), relative)

    def p_values(self, remainders: Array) -> Array:
        """p of remainders e (draws, rows)."""
        return self.p_of(*self.statistics(remainders))

    def statistics(self, remainders: Array) -> tuple[Array, Array]:
        """Directed and omnibus statistic of remainders e (draws, rows)."""
        directed = squared(remainders @ self.linear.signatures, self.linear).max(axis=1, initial=0.0)
        omnibus = (remainders**2).sum(axis=1)
        return (directed * self.linear.freedom / omnibus if self.relative else directed), omnibus

    def p_of(self, directed: Array, omnibus: Array) -> Array:
        """Calibrated p-values of observed statistics (n,)."""
        smaller = _smaller(directed, omnibus, self.directed, self.omnibus, self.relative)
        return (np.searchsorted(self.smaller, smaller, side="right") + 1.0) / (len(self.smaller) + 1.0)

    def judge(self) -> Consistency:
        """The model's own remainder."""
        remainder = self.linear.remainder[None]
        directed, omnibus = self.statistics(remainder)
        scores = squared(remainder @ self.linear.signatures, self.linear)[0]
        best = self.linear.names[int(scores.argmax())] if scores.max(initial=0.0) > 0.0 else None
        p = float(self.p_of(directed, omnibus)[0])
        return Consistency(float(directed[0]), float(omnibus[0]), self.linear.freedom, p, best)


def squared(scores: Array, linear: Linear) -> Array:
    """Squared scores (draws, m); of a one-sided effect only a score in its own direction counts."""
    return np.where(linear.one_sided, np.maximum(scores, 0.0), scores) ** 2


def _bounded(inside: Array, frame: Array, held: int | None) -> Array:
    """Draws after the bounded refit of the held effect: what it could explain with b > 0 is gone."""
    if held is None or not frame.size:
        return inside
    own = frame[:, held]
    return inside - np.maximum(inside @ own, 0.0)[:, None] * own


def _smaller(directed: Array, omnibus: Array, directed_sorted: Array, omnibus_sorted: Array, relative: bool) -> Array:
    """min(p_S, p_Q), the upper tails in sorted draws."""
    p_directed = _tail(directed, directed_sorted)
    return p_directed if relative else np.minimum(p_directed, _tail(omnibus, omnibus_sorted))


def _tail(values: Array, ordered: Array) -> Array:
    """Share of draws at or above each value."""
    return (len(ordered) - np.searchsorted(ordered, values, side="left")) / len(ordered)
