"""A model's constants as its joint fit has them: one over a logarithmic range is the fraction 0..1 of that range.

The emulator interpolates, the prior is normal and intervals are central in that fraction, as they are in the logarithm
where `train-and-invert` or a diagnosis seeks such a parameter.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from birdstrike.data.dataset import Dataset
from birdstrike.data.errors import RunFailed
from birdstrike.data.histories import Array, Histories
from birdstrike.data.progress import Progress
from birdstrike.doe.designs.space import ParameterSpace
from birdstrike.inversion.estimation.prior import NormalPrior
from birdstrike.inversion.forward import Forward, watched
from birdstrike.solver.case.settings import Prior


@dataclass(frozen=True, eq=False)
class Scale:
    """Between SI values and what the estimation sees of them; space: ranges and their scales."""

    space: ParameterSpace

    def dataset(self, dataset: Dataset) -> Dataset:
        """The runs with every logarithmic parameter as its fraction of the range."""
        log = self.space.logarithmic
        fractions = self.space.to_unit(dataset.parameters)
        return replace(
            dataset,
            parameters=np.where(log, fractions, dataset.parameters),
            lows=np.where(log, 0.0, dataset.lows),
            highs=np.where(log, 1.0, dataset.highs),
            units=tuple("" if one else unit for one, unit in zip(log, dataset.units, strict=True)),
            decades={
                name: (float(low), float(high), unit)
                for name, low, high, unit, one in zip(
                    dataset.names, dataset.lows, dataset.highs, dataset.units, log, strict=True
                )
                if one
            },
            scales=(),
        )

    def priors(self, stated: Mapping[str, Prior]) -> dict[str, Prior]:
        """Priors as the estimation sees them."""
        seen, log = NormalPrior.of(stated, self.space), self.space.logarithmic
        return {
            name: Prior(mean=float(seen.mean[i]), sd=float(seen.sd[i])) if log[i] else stated[name]
            for i, name in enumerate(self.space.names)
            if name in stated
        }

    def physical(self, theta: Array) -> Array:
        """SI values (n, k) of what the estimation found (n, k)."""
        log = self.space.logarithmic
        fractions = np.where(log, theta, 0.0)
        return np.where(log, self.space.to_physical(fractions), theta)

    def value(self, name: str, found: float) -> float:
        """One SI value."""
        row = np.where(self.space.logarithmic, 0.5, self.space.lows)
        place = self.space.names.index(name)
        row[place] = found
        return float(self.physical(row[None])[0, place])

    def values(self, theta: Mapping[str, float]) -> dict[str, float]:
        """SI values by key; keys that are not sought (nuisances) stay."""
        return {name: self.value(name, v) if name in self.space.names else v for name, v in theta.items()}


@dataclass(frozen=True, eq=False)
class ScaledForward:
    """A forward model at parameters as the estimation sees them."""

    forward: Forward
    scale: Scale

    def __call__(self, theta: Mapping[str, float]) -> Histories:
        """Histories at these parameters; raises RunFailed."""
        return self.forward(self.scale.values(theta))

    def watched(self, progress: Progress) -> ScaledForward:
        """The same with its progress reported."""
        return replace(self, forward=watched(self.forward, progress))


@dataclass(frozen=True, eq=False)
class NearestFinished:
    """A forward model that answers with the nearest run of a campaign where its own simulation fails, and says so.

    A model whose best constants make the solver fail is still to be compared with the others.
    """

    forward: Forward
    dataset: Dataset
    say: Callable[[str], None]

    def __call__(self, theta: Mapping[str, float]) -> Histories:
        """Histories at these parameters, or at the nearest run's; raises RunFailed where that one fails too."""
        try:
            return self.forward(theta)
        except RunFailed as failure:
            place = np.array([theta[name] for name in self.dataset.names])
            nearest = self.dataset.nearest(place)
            number = int(self.dataset.runs[nearest])
            self.say(
                f"the simulation at an answer failed ({failure}): run {number} of the campaign, "
                "the nearest that finished, stands in for it, so that the errors are those of its constants; change "
                "what the solver asks for, or narrow the ranges: inversion.models"
            )
            return self.forward(self.dataset.named(self.dataset.parameters[nearest]))

    def watched(self, progress: Progress) -> NearestFinished:
        """The same with its progress reported."""
        return replace(self, forward=watched(self.forward, progress))
