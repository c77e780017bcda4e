"""One strike of a campaign: its names in the run store, what the store knows of it, and its second chance."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from birdstrike.data.errors import CaseError, RunFailed
from birdstrike.data.histories import Histories
from birdstrike.data.store import RunStore, run_key
from birdstrike.doe.designs.registry import Design
from birdstrike.doe.solvers import Solver
from birdstrike.solver.case.case import Case

BOOKS = ("eroded_mass_fraction", "energy_error", "momentum_error", "wall_s")


@dataclass(frozen=True)
class Strike:
    """Run number, SI values by dotted key, the run's key in the store by step factor, in the order of the attempts.

    version: the solver's; case: if not the campaign's.
    """

    number: int
    values: Mapping[str, float]
    keys: Mapping[float, str]
    version: str
    case: Case | None = None

    @classmethod
    def of(cls, number: int, values: Mapping[str, float], case: Case, solver: Solver) -> Strike:
        """The strike of `case`, in which `values` already stand."""
        canonical = case.canonical()
        keys = {factor: run_key(canonical, solver.version, factor) for factor in solver.step_factors}
        return cls(number, values, keys, solver.version)


@dataclass(frozen=True)
class Finished:
    """A strike that can be used: where it lies, how it was reached, and its BOOKS; a campaign holds thousands."""

    store: RunStore
    key: str
    step_factor: float
    books: Mapping[str, Any]

    @property
    def histories(self) -> Histories:
        """The histories, read from the store whenever they are asked for. RunFailed where they have gone."""
        found = self.store.load(self.key)
        if found is None:
            raise RunFailed(f"{self.store.path(self.key)} has gone or is damaged", "run the same command again")
        return found


@dataclass(frozen=True)
class Failed:
    """A strike that failed at every step factor; reason: the last one."""

    reason: str


def plan(case: Case, design: Design, solver: Solver) -> list[Strike]:
    """The strikes of a design; raises CaseError with every run that the case refuses."""
    strikes, errors = [], []
    for number, row in zip(design.numbers, design.values, strict=True):
        values = dict(zip(design.names, map(float, row), strict=True))
        try:
            strikes.append(Strike.of(int(number), values, case.with_values(values), solver))
        except CaseError as error:
            errors += [f"run {number}: {line}" for line in error.errors]
    if errors:
        raise CaseError(errors, "the case refuses runs of the design")
    return strikes


def consult(stores: Sequence[RunStore], strike: Strike) -> Finished | Failed | float:
    """What the stores say of a strike, the first that knows: finished, failed for good, or the step factor due."""
    reason = ""
    for factor, key in strike.keys.items():
        failure = None
        for store in stores:
            if (histories := store.load(key)) is not None:
                return _finished(store, key, factor, histories)
            failure = failure or store.failure(key)
        if failure is None:
            return factor
        reason = failure
    return Failed(reason)


def record(
    stores: Sequence[RunStore], strike: Strike, step_factor: float, result: Histories | str
) -> Finished | Failed | float:
    """Put an attempt's end into the first store, whole or not at all, and say how the strike stands then."""
    key, store = strike.keys[step_factor], stores[0]
    meta = {"values": dict(strike.values), "step_factor": step_factor, "solver_version": strike.version}
    if isinstance(result, str):
        store.save_failure(key, result, meta)
        return consult(stores, strike)
    store.save(key, result, meta)
    return _finished(store, key, step_factor, result)


def _finished(store: RunStore, key: str, step_factor: float, histories: Histories) -> Finished:
    return Finished(store, key, step_factor, {name: histories.summary.get(name) for name in BOOKS})
