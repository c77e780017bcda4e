"""How well the parameters are known: posterior, directions of the data, profiles, Sobol indices. SI units."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Direction:
    """A singular direction of the whitened Jacobian whose columns are scaled by the prior's standard deviations.

    strength: the singular value; the data narrow the prior along it by 1/sqrt(1 + strength^2), so that below 1 they say
    less than the prior. parts: dotted key -> share, of norm 1. words: the direction in the parameters' names.
    """

    strength: float
    parts: dict[str, float]
    words: str

    @property
    def null(self) -> bool:
        """Whether the data say less along it than the prior does."""
        return self.strength < 1.0


@dataclass(frozen=True)
class PosteriorFigures:
    """The emulator's posterior, draws in `draws` (CSV, SI). name -> figure; `time_offset` [s] among the names.

    contraction: 1 - (posterior sd / prior sd)^2 of the parameters; correlation: rows in the order of `names`;
    rhat, effective: of the parameters; acceptance, steps: of the chains; converged: R-hat <= 1.01, 400 effective draws.
    """

    names: tuple[str, ...]
    most_probable: Mapping[str, float]
    mean: Mapping[str, float]
    sd: Mapping[str, float]
    interval_95: Mapping[str, tuple[float, float]]
    contraction: Mapping[str, float]
    correlation: tuple[tuple[float, ...], ...]
    rhat: Mapping[str, float | None]
    effective: Mapping[str, float]
    acceptance: float
    steps: int
    converged: bool
    draws: str


@dataclass(frozen=True)
class ProfileFigures:
    """values: SI; rise: of minus twice the log posterior; at_bound: other parameters at an end; sentence: in words."""

    values: tuple[float, ...]
    rise: tuple[float, ...]
    at_bound: tuple[tuple[str, ...], ...]
    sentence: str


@dataclass(frozen=True)
class SobolFigures:
    """One channel over time [s]: sd SI over the ranges; name -> first-order and total index, null where sd is 0."""

    times: tuple[float, ...]
    sd: tuple[float, ...]
    first: Mapping[str, tuple[float | None, ...]]
    total: Mapping[str, tuple[float | None, ...]]


@dataclass(frozen=True)
class IdentifiabilityFigures:
    """Singular directions (the best determined first), profile likelihood by parameter, Sobol indices by channel."""

    directions: tuple[Direction, ...]
    profiles: Mapping[str, ProfileFigures]
    sobol: Mapping[str, SobolFigures]
