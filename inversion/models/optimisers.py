"""The usual way beside the emulator's: an optimiser with the solver in the loop, its simulations counted.

The objective is that of the ranking: the root mean square over shots and channels of the residual over its noise. Both
optimisers start in the middle of the ranges, each in its scale, as one must who knows nothing else.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from importlib import import_module
from typing import Any

import numpy as np
from scipy.optimize import OptimizeResult, least_squares

from birdstrike.data.errors import RunFailed, UserError
from birdstrike.data.histories import Array
from birdstrike.inversion.models.results import Optimised

STEP = 0.05  # of a range, for derivatives: a smaller one would differentiate the scatter of the simulations
SPREAD = 0.25  # of a range: the first population's standard deviation
FAILED = 1e3  # times the noise: residual of a simulation that failed


class _Spent(Exception):
    """The simulations that were allowed are used up."""


Residuals = Callable[[Mapping[str, float]], Array]
"""residuals({dotted key: SI}) -> (n,) whose sum of squares is the objective's square; may raise RunFailed."""


@dataclass
class Problem:
    """What an optimiser sees. physical: (q, k) fractions of the ranges -> SI; together: makes simulations of several
    points beforehand, in parallel; budget: points, each one simulation a shot."""

    names: Sequence[str]
    physical: Callable[[Array], Array]
    residuals: Residuals
    together: Callable[[Sequence[Mapping[str, float]]], None]
    budget: int
    seed: int = 0
    points: int = 0
    best: tuple[float, Array] | None = None
    size: int = field(default=1)
    known: dict[bytes, Array] = field(default_factory=dict)
    failure: RunFailed | None = None

    def values(self, unit: Array) -> dict[str, float]:
        """SI values at a point in 0..1."""
        row = self.physical(np.clip(unit, 0.0, 1.0)[None])[0]
        return dict(zip(self.names, map(float, row), strict=True))

    def at(self, unit: Array) -> Array:
        """Residuals at a point in 0..1; a point counts once, and the best of those that finished is kept."""
        place = np.clip(unit, 0.0, 1.0)
        key = place.tobytes()
        if key in self.known:
            return self.known[key]
        if self.points >= self.budget:
            raise _Spent
        self.points += 1
        try:
            found = self.residuals(self.values(place))
            self.size = len(found)
            error = float(np.sqrt(found @ found))
            if not np.isfinite(error):
                raise RunFailed("the simulation has readings that are no numbers")
            if self.best is None or error < self.best[0]:
                self.best = (error, place)
        except RunFailed as failure:
            self.failure = failure
            found = np.full(self.size, FAILED / np.sqrt(self.size))
        self.known[key] = found
        return found


def by_least_squares(problem: Problem) -> str:
    """Trust-region least squares (scipy), derivatives by differences."""
    start = np.full(len(problem.names), 0.5)
    problem.at(start)
    if problem.failure is not None:
        raise RunFailed(
            "least_squares: the simulation in the middle of the ranges, where least_squares begins, failed "
            f"({problem.failure})"
        )
    return str(from_the_middle(problem.at, len(start)).message)


def from_the_middle(residuals: Callable[[Array], Array], many: int, most: int | None = None) -> OptimizeResult:
    """Trust-region least squares (scipy) over ranges 0..1 from their middles; every point is evaluated once.

    residuals: (k,) fractions of the ranges -> (n,); many: k; most: steps of the search, each with k points beside it.
    """
    known: dict[bytes, Array] = {}

    def at(unit: Array) -> Array:
        key = unit.tobytes()
        if key not in known:
            known[key] = residuals(unit)
        return known[key]

    derivatives: Any = partial(differences, at)
    return least_squares(at, np.full(many, 0.5), derivatives, bounds=(0.0, 1.0), xtol=1e-3, max_nfev=most)


def differences(residuals: Callable[[Array], Array], unit: Array) -> Array:
    """(n, k) derivatives at unit (k,) in 0..1 by differences over `STEP`, backwards where this would leave the range.

    scipy's own step is a share of the variable, and so of no size at the lower end of a range.
    """
    here = residuals(unit)
    steps = np.where(unit + STEP <= 1.0, STEP, -STEP)
    return np.stack([(residuals(unit + step) - here) / step[i] for i, step in enumerate(np.diag(steps))], axis=1)


def by_cma(problem: Problem) -> str:
    """CMA-ES (N. Hansen's library cma): a population at a time, all its simulations in parallel."""
    cma: Any = import_module("cma")
    options = {"bounds": [0.0, 1.0], "seed": problem.seed + 1, "verbose": -9, "maxfevals": problem.budget}
    search = cma.CMAEvolutionStrategy([0.5] * len(problem.names), SPREAD, options)
    while not search.stop():
        points = [np.asarray(point) for point in search.ask()]
        problem.together([problem.values(point) for point in points[: problem.budget - problem.points]])
        search.tell([list(map(float, point)) for point in points], [float(np.sum(problem.at(p) ** 2)) for p in points])
    return ", ".join(search.stop())


OPTIMISERS: Mapping[str, Callable[[Problem], str]] = {"least_squares": by_least_squares, "cma": by_cma}


def refuse_unknown(names: Sequence[str]) -> None:
    """Raises UserError for a name that is no optimiser or stands there twice, or whose library is not installed."""
    if (together := next((name for name in names if "," in name), None)) is not None:
        parts = [part.strip() for part in together.split(",")]
        raise UserError(f'--optimisers: "{together}" is one text with several names; give a list: {parts}')
    if (twice := next((name for name in names if names.count(name) > 1), None)) is not None:
        raise UserError(f"--optimisers names {twice} more than once: name it once")
    unknown = [name for name in names if name not in OPTIMISERS]
    if unknown:
        raise UserError(f'--optimisers: "{unknown[0]}" is unknown; use one or more of {", ".join(OPTIMISERS)}')
    if "cma" in names:
        try:
            import_module("cma")
        except ImportError as error:
            raise UserError("--optimisers cma needs the library cma: pip install 'birdstrike[optimise]'") from error


def optimised(name: str, problem: Problem) -> Optimised:
    """The best point that an optimiser finds with the simulations that it may spend; raises RunFailed for none."""
    try:
        ended = OPTIMISERS[name](problem)
    except _Spent:
        ended = f"all {problem.budget} simulations a shot were spent"
    if problem.best is None:
        raise RunFailed(f"{name}: no simulation finished ({problem.failure})")
    error, place = problem.best
    return Optimised(problem.values(place), error, problem.points, ended)
