"""A design: the runs of a campaign as points of the parameter space, and the interface of the kinds of design."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.histories import Array
from birdstrike.data.progress import Progress
from birdstrike.doe.designs.quality import Quality, weakest_quality
from birdstrike.doe.designs.space import ParameterSpace

Generate = Callable[[int, int, int, Progress], Array]
"""generate(runs, columns, seed, progress) -> (runs, columns) in 0..1, the same for the same seed; raises UserError."""


@dataclass(frozen=True)
class DesignKind:
    """A kind of design, one file each, entered in doe.designs.registry.

    generate: its points; note: from the number of runs to what the user should know of it, "" for nothing; nested:
    whether a longer design begins with the rows of a shorter one of the same seed; extended: what is lost when rows
    are added to it, in words, "" for nothing ({runs}: the number of its own rows).
    """

    name: str
    generate: Generate
    note: Callable[[int], str] = lambda _: ""
    nested: bool = False
    extended: str = ""


@dataclass(frozen=True)
class Design:
    """n runs in k parameters.

    kind: a name of doe.designs.registry or "file"; seed: None for a file; numbers: (n,) run numbers; values: (n, k) SI;
    unit: (n, k) in fractions of the ranges; source: the file; warnings: what the user should know before running.
    """

    kind: str
    seed: int | None
    space: ParameterSpace
    numbers: NDArray[np.int64]
    values: Array
    unit: Array
    source: str | None = None
    warnings: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """Dotted case keys of the columns."""
        return self.space.names

    @property
    def units(self) -> tuple[str, ...]:
        """SI unit of each column."""
        return self.space.units

    def quality(self) -> Quality:
        """Rank, condition, correlation, discrepancies with their percentiles, smallest distance.

        Of the SI values, so that a design read back from its file has the same figures to the last digit.
        """
        return self._quality

    @cached_property
    def _quality(self) -> Quality:
        return weakest_quality(self.space.to_unit(self.values), self.space, ranked=True)[0]
