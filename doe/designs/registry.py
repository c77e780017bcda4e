"""Designs: which strikes a campaign runs. `make_design` gives one by its name or reads the user's own."""

from __future__ import annotations

import warnings as python_warnings
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from birdstrike.data.errors import UserError
from birdstrike.data.histories import Array
from birdstrike.doe.designs.design_file import read_design
from birdstrike.doe.designs.orthogonal import orthogonal_design
from birdstrike.doe.designs.quality import Quality, design_quality
from birdstrike.doe.designs.space import ParameterSpace
from birdstrike.doe.designs.uniform import uniform_design

Progress = Callable[[float], None]
"""Takes the share done, 0..1, of a design that is searched for."""

KINDS = ("uniform", "orthogonal", "lhs", "sobol")


@dataclass(frozen=True)
class Design:
    """n strikes in k parameters.

    kind: one of KINDS or "file"; seed: None for a file; numbers: (n,) run numbers; values: (n, k) SI; unit: (n, k) in
    fractions of the ranges; source: the file; warnings: what the user should know before running.
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
        """Rank, condition, correlation, discrepancies with their percentiles, smallest distance."""
        return self._quality

    @cached_property
    def _quality(self) -> Quality:
        return design_quality(self.unit, self.names, ranked=True)


def make_design(
    kind: str | Path, space: ParameterSpace, runs: int = 25, seed: int = 0, progress: Progress = lambda _: None
) -> Design:
    """The design `kind` of `runs` runs (the same for the same seed), or all rows of the CSV file `kind`.

    Raises UserError: an unknown kind, a count of runs for which no such design exists, every error of a file.
    """
    if kind not in KINDS:
        return _from_file(kind, space)
    if runs < 2:
        raise UserError(f"--runs = {runs} is below 2; a design needs at least two runs")
    if seed < 0:
        raise UserError(f"--seed = {seed} is below 0; use 0, 1, 2, ...")
    unit, warnings = _generated(str(kind), space, runs, seed, progress)
    return Design(str(kind), seed, space, np.arange(1, runs + 1), space.to_physical(unit), unit, warnings=warnings)


def _generated(
    kind: str, space: ParameterSpace, runs: int, seed: int, progress: Progress
) -> tuple[Array, tuple[str, ...]]:
    k = len(space.names)
    if kind == "uniform":
        return uniform_design(runs, k, seed, progress), ()
    if kind == "orthogonal":
        return orthogonal_design(runs, k, seed), ()
    if kind == "lhs":
        return qmc.LatinHypercube(k, rng=seed).random(runs), ()
    return _sobol(runs, k, seed)


def _sobol(runs: int, columns: int, seed: int) -> tuple[Array, tuple[str, ...]]:
    """A scrambled Sobol sequence; balanced only when the number of runs is a power of two."""
    with python_warnings.catch_warnings():
        python_warnings.simplefilter("ignore", UserWarning)  # said below, with the remedy
        unit = qmc.Sobol(columns, rng=seed).random(runs)
    if runs & (runs - 1) == 0:
        return unit, ()
    fuller = 1 << runs.bit_length()
    return unit, (f"a Sobol design is balanced for powers of two only; {runs} runs are not: {fuller} would be",)


def _from_file(path: str | Path, space: ParameterSpace) -> Design:
    if not Path(path).is_file():
        raise UserError(f"--design = {path} is neither a file nor one of {', '.join(KINDS)}")
    numbers, values = read_design(path, space)
    return Design(
        "file", None, space, numbers, values, space.to_unit(values), str(path), _outside(numbers, values, space)
    )


def _outside(numbers: NDArray[np.int64], values: Array, space: ParameterSpace) -> tuple[str, ...]:
    """One warning a parameter whose range some runs leave: the user's own design is run all the same."""
    outside = space.outside(values)
    return tuple(
        f"{name}: {outside[:, j].sum()} of {len(numbers)} runs are outside the case's range "
        f"(first: run {numbers[outside[:, j]][0]}); they are run as the file says"
        for j, name in enumerate(space.names)
        if outside[:, j].any()
    )
