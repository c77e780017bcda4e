"""One run of a campaign: its keys in the run store, what the stores hold of it, its second attempt and its retry.

A failure that is the run's own is stored and not run again, unless the user asks for a retry; what the machine ended
(memory, disk, a signal: doe.attempt) is never stored.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from birdstrike.data.errors import CaseError, RunFailed
from birdstrike.data.histories import Histories
from birdstrike.data.storage.store import RunStore, run_key
from birdstrike.doe.attempt import Solver, attempt
from birdstrike.doe.designs.design import Design
from birdstrike.solver.case.case import Case

FIGURES = ("eroded_mass_fraction", "energy_error", "momentum_error", "wall_s")
"""Of a run's summary, what the campaign's summary repeats."""


@dataclass(frozen=True)
class PlannedRun:
    """Run number, SI values by dotted key, the run's key in the store by step factor, in the order of the attempts.

    version: the solver's; case: if not the campaign's; inactive: dotted keys of the erosion limits that erode nothing
    at their values in this run.
    """

    number: int
    values: Mapping[str, float]
    keys: Mapping[float, str]
    version: str
    case: Case | None = None
    inactive: tuple[str, ...] = ()

    @classmethod
    def of(cls, number: int, values: Mapping[str, float], case: Case, solver: Solver) -> PlannedRun:
        """The run of `case`, in which `values` already stand."""
        canonical = case.canonical()
        keys = {factor: run_key(canonical, solver.version, factor) for factor in solver.step_factors}
        inactive = tuple(f"bird.material.{name}" for name in case.bird.material.inactive)
        return cls(number, values, keys, solver.version, inactive=inactive)

    @classmethod
    def alone(cls, number: int, case: Case, solver: Solver) -> PlannedRun:
        """The run of a case of its own, whatever the case of the runs beside it."""
        return replace(cls.of(number, {}, case, solver), case=case)


@dataclass(frozen=True)
class Finished:
    """A run that can be used: where it lies, how it was reached, and its FIGURES; a campaign holds thousands."""

    store: RunStore
    key: str
    step_factor: float
    figures: Mapping[str, Any]

    @property
    def histories(self) -> Histories:
        """The histories, read from the store whenever they are asked for. RunFailed where they have gone."""
        found = self.store.load(self.key)
        if found is None:
            raise RunFailed(f"{self.store.path(self.key)} has gone or is damaged", "run the same command again")
        return found


@dataclass(frozen=True)
class Failed:
    """A run that failed at every step factor; reason: the last one.

    due: the machine ended it, nothing is stored, and the next call tries it again.
    """

    reason: str
    due: bool = False


State = Finished | Failed | float
"""How a run stands: it has finished, it has failed for good, or an attempt with this step factor is due."""


def plan(case: Case, design: Design, solver: Solver) -> list[PlannedRun]:
    """The runs of a design; raises CaseError with every run that the case refuses."""
    runs, errors = [], []
    for number, row in zip(design.numbers, design.values, strict=True):
        values = dict(zip(design.names, map(float, row), strict=True))
        try:
            runs.append(PlannedRun.of(int(number), values, case.with_values(values), solver))
        except CaseError as error:
            errors += [f"run {number}: {line}" for line in error.errors]
    if errors:
        raise CaseError(errors, "the case refuses runs of the design")
    return runs


def retry_before(retry_failed: bool) -> float:
    """The time [s, Unix] before which stored failures do not count: now where a retry is asked for, else none do.

    A command takes it once at its start and hands it to all its parts and processes, so that each failed run is tried
    again once.
    """
    return time.time() if retry_failed else 0.0


def state_of(stores: Sequence[RunStore], run: PlannedRun, retry: float = 0.0) -> State:
    """How a run stands by the stores, the first that knows; failures stored before `retry` do not count.

    New runs go to the first store, where a damaged file is set aside; the others are only read.
    """
    for factor, key in run.keys.items():
        for i, store in enumerate(stores):
            histories = store.look_up(key) if i else store.load(key)
            if histories is not None:
                return _finished(store, key, factor, histories)
    reason = ""
    for factor, key in run.keys.items():
        failures = (store.failure(key, since=retry) for store in stores)
        failure = next((found for found in failures if found is not None), None)
        if failure is None:
            return factor
        reason = failure
    return Failed(reason)


def failed_runs(store: RunStore, read: Sequence[RunStore], version: str) -> list[str]:
    """Keys of the store's failures under the solver's version whose run no store holds at any step factor."""
    found = []
    for key in store.failed_keys():
        if store.failure(key) is None:  # gone or damaged: the run counts as not tried
            continue
        record = store.failure_record(key) or {}
        attempts = record.get("attempts", [key])
        finished = any(one.path(attempt).exists() for attempt in attempts for one in (store, *read))
        if record.get("solver_version") == version and not finished:
            found.append(key)
    return found


def keep(
    stores: Sequence[RunStore], run: PlannedRun, step_factor: float, result: Histories | str, retry: float = 0.0
) -> State:
    """Put an attempt's end into the first store, whole or not at all, and say how the run stands then.

    Failures of this step factor and of smaller ones are forgotten where it succeeds; why it took a smaller one stays.
    """
    key, store = run.keys[step_factor], stores[0]
    meta = {"values": dict(run.values), "step_factor": step_factor, "solver_version": run.version}
    if isinstance(result, str):
        store.save_failure(key, result, meta | {"attempts": list(run.keys.values())})
        return state_of(stores, run, retry)
    store.save(key, result, meta)
    for other in [other for factor, other in run.keys.items() if factor <= step_factor]:
        store.forget_failure(other)
    return _finished(store, key, step_factor, result)


def carried_out(
    stores: Sequence[RunStore], run: PlannedRun, solver: Solver, case: Case, retry: float = 0.0, **options: Any
) -> Finished | Failed:
    """A run taken from the stores or made in this process, with its second attempt; the machine's fault is raised.

    options: further arguments of the solver's `simulate`.
    """
    state = state_of(stores, run, retry)
    while not isinstance(state, Finished | Failed):
        result = attempt(solver.simulate, case, run.values, state, **options)
        state = keep(stores, run, state, result, retry)
    return state


def _finished(store: RunStore, key: str, step_factor: float, histories: Histories) -> Finished:
    return Finished(store, key, step_factor, {name: histories.summary.get(name) for name in FIGURES})
