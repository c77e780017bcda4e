"""One strike of a campaign: its names in the run store, and what the store knows of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from data.errors import CaseError
from data.histories import Histories
from data.store import RunStore, run_key
from doe.designs import Design
from solver.case import Case

STEP_FACTORS = (1.0, 0.5)
"""A strike that fails is tried once more with half the time step."""


@dataclass(frozen=True)
class Strike:
    """Run number, SI values by dotted key, the run's key in the store by step factor; case: if not the campaign's."""

    number: int
    values: Mapping[str, float]
    keys: Mapping[float, str]
    case: Case | None = None


@dataclass(frozen=True)
class Finished:
    """A strike that can be used: histories (without pictures, which stay in the store) and how it was reached."""

    histories: Histories
    step_factor: float
    key: str


@dataclass(frozen=True)
class Failed:
    """A strike that failed at every step factor; reason: the last one."""

    reason: str


def plan(case: Case, design: Design, solver_version: str) -> list[Strike]:
    """The strikes of a design; raises CaseError with every run that the case refuses."""
    strikes, errors = [], []
    for number, row in zip(design.numbers, design.values, strict=True):
        values = dict(zip(design.names, map(float, row), strict=True))
        try:
            canonical = case.with_values(values).canonical()
        except CaseError as error:
            errors += [f"run {number}: {line}" for line in error.errors]
            continue
        keys = {factor: run_key(canonical, solver_version, factor) for factor in STEP_FACTORS}
        strikes.append(Strike(int(number), values, keys))
    if errors:
        raise CaseError(errors, "the case refuses runs of the design")
    return strikes


def consult(store: RunStore, strike: Strike) -> Finished | Failed | float:
    """What the store says of a strike: finished, failed for good, or the step factor that is due."""
    reason = ""
    for factor in STEP_FACTORS:
        histories = store.load(strike.keys[factor])
        if histories is not None:
            return Finished(replace(histories, snapshots=()), factor, strike.keys[factor])
        failure = store.failure(strike.keys[factor])
        if failure is None:
            return factor
        reason = failure
    return Failed(reason)


def record(store: RunStore, strike: Strike, step_factor: float, result: Histories | str) -> Finished | Failed | float:
    """Put an attempt's end into the store, whole or not at all, and say how the strike stands then."""
    key, meta = strike.keys[step_factor], {"values": dict(strike.values), "step_factor": step_factor}
    if isinstance(result, str):
        store.save_failure(key, result, meta)
        return consult(store, strike)
    store.save(key, result, meta)
    return Finished(replace(result, snapshots=()), step_factor, key)
