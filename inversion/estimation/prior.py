"""The prior of the parameters: normal on the fractions of their ranges, cut off at the ends of these."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import truncnorm

from birdstrike.data.formatting import plain
from birdstrike.data.histories import Array
from birdstrike.doe.designs.space import ParameterSpace
from birdstrike.solver.case.settings import Prior

NEWS = 0.5  # of the prior's 95 % width: a narrower interval counts as identified
UNIFORM_SD = 1.0 / np.sqrt(12.0)  # of a uniform distribution over 0..1
CONFLICT = 3.0
"""Standard deviations of its distribution before the record, by which a posterior mean lies off where prior and record
contradict each other: once in 370 times by chance (Evans & Moshonov, Bayesian Anal. 1 (2006) 893)."""
SILENT = 1e-3
"""Share of the prior's standard deviation. Where that distribution is narrower, the record says nothing of the
parameter, and the mean is off by the tolerance of the fit or by a region without runs."""


@dataclass(frozen=True)
class NormalPrior:
    """mean, sd: (k,) in fractions of the ranges; stated: (k,) True where the case states it, beside the range."""

    mean: Array
    sd: Array
    stated: NDArray[np.bool_]

    @classmethod
    def of_ranges(cls, k: int) -> NormalPrior:
        """Of k parameters of which the ranges alone are known: their middles and range/sqrt(12)."""
        return cls(np.full(k, 0.5), np.full(k, UNIFORM_SD), np.zeros(k, dtype=bool))

    @classmethod
    def of(cls, stated: Mapping[str, Prior], space: ParameterSpace) -> NormalPrior:
        """With what a case states of some parameters of the space, in fractions of its ranges, each in its scale.

        In a logarithmic scale the standard deviation is that of the logarithm: sd / mean.
        """
        found = cls.of_ranges(len(space.names))
        known = np.array([name in stated for name in space.names], dtype=bool)
        middle = 0.5 * (space.lows + space.highs)
        at = np.array([stated[n].mean if n in stated else m for n, m in zip(space.names, middle, strict=True)])
        sd = np.array([stated[name].sd if name in stated else 0.0 for name in space.names])
        return cls(
            np.where(known, space.to_unit(at[None])[0], found.mean),
            np.where(known, space.slopes(at) * sd, found.sd),
            known,
        )

    def place(self, deviations: Array) -> Array:
        """(..., k) fractions of the ranges at deviations (..., k) from the means, in standard deviations."""
        return self.mean + self.sd * deviations

    def deviations(self, z: Array) -> Array:
        """(..., k) how far fractions z (..., k) lie from the means, in standard deviations."""
        return (z - self.mean) / self.sd

    def truncated_sd(self) -> Array:
        """(k,) standard deviation, the ends of 0..1 cut off."""
        return np.asarray(truncnorm.std(*self._ends)) * self.sd

    def width(self) -> Array:
        """(k,) width of the central 95 % interval on 0..1."""
        return np.asarray(truncnorm.ppf(0.975, *self._ends) - truncnorm.ppf(0.025, *self._ends)) * self.sd

    def draw(self, rng: np.random.Generator, limits: Array, shape: tuple[int, ...]) -> Array:
        """(shape) draws between the limits (2, k); the last axis of the shape has k."""
        ends = self.deviations(limits)
        return self.place(np.asarray(truncnorm.rvs(*ends, size=shape, random_state=rng)))

    @property
    def _ends(self) -> tuple[Array, Array]:
        return self.deviations(np.zeros_like(self.mean)), self.deviations(np.ones_like(self.mean))


def identified(width: Array | float, before: Array | float) -> NDArray[np.bool_]:
    """Whether a record identifies a quantity: the one rule of calibration, diagnosis and what parameters make together.

    width: of its 95 % interval, any shape and unit; before: of its prior's central 95 % interval (of a parameter
    `NormalPrior.width`, the ends of the range cut off), alike.
    """
    return np.asarray(width) < NEWS * np.asarray(before)


def conflicts(
    prior: NormalPrior, names: Sequence[str], mean: Array, sd: Array, shown: Callable[[int, float], str]
) -> list[str]:
    """A warning for each stated prior that the record contradicts.

    mean, sd: (k,) of the posterior, fractions of the ranges; shown: fraction of parameter i in words. Before the record
    is known its mean is expected at the prior's, with the variance by which the record narrows the prior.
    """
    found, expected = list[str](), np.sqrt(np.maximum(prior.sd**2 - sd**2, 0.0))
    off = np.abs(mean - prior.mean)
    for i in np.flatnonzero(prior.stated & (expected > SILENT * prior.sd) & (off > CONFLICT * expected)):
        side = "above" if mean[i] > prior.mean[i] else "below"
        found.append(
            f"{plain(names[int(i)], names)}: the record contradicts the stated prior about "
            f"{shown(int(i), float(prior.mean[i]))}: with it the answer lies {off[i] / prior.sd[i]:.2g} of its "
            f"standard deviations {side}, {off[i] / expected[i]:.1f} times what is expected; check the prior, or leave "
            "it out"
        )
    return found
