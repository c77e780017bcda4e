"""The forward model of an inversion: parameters in, histories out; by default our solver behind the run store."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Protocol, runtime_checkable

from data.errors import RunFailed
from data.histories import Histories
from data.store import RunStore, run_key
from doe.strike import STEP_FACTORS
from solver.case import Case
from solver.simulate import simulate
from solver.version import SOLVER_VERSION

Forward = Callable[[Mapping[str, float]], Histories]
"""forward({dotted case key: SI value}) -> Histories; may raise RunFailed."""


@dataclass(frozen=True)
class StoredSolver:
    """The solver at given parameters, each run paid once; read: further stores in which a run may already lie."""

    case: Case
    store: RunStore
    read: tuple[RunStore, ...] = ()
    progress: Callable[[float], None] | None = None

    def __call__(self, theta: Mapping[str, float]) -> Histories:
        """A stored run or a new one, its key in the summary as `run_key`.

        A run that fails is tried once more with half the time step, as in a campaign. Raises RunFailed.
        """
        case, reason = self.case.with_values(theta), ""
        for step_factor in STEP_FACTORS:
            key = run_key(case.canonical(), SOLVER_VERSION, step_factor)
            found, reason = self._stored(key)
            if found is None and not reason:
                found, reason = self._run(case, theta, key, step_factor)
            if found is not None:
                return replace(found, summary={**found.summary, "run_key": key})
        raise RunFailed(reason, "see the case and the parameters' ranges")

    def watched(self, progress: Callable[[float], None]) -> StoredSolver:
        """The same with its progress reported, 0..1 for each run."""
        return replace(self, progress=progress)

    def _stored(self, key: str) -> tuple[Histories | None, str]:
        """A finished run, or the reason of a failed one, from the first store that has either."""
        for store in (self.store, *self.read):
            found, reason = store.load(key), store.failure(key) or ""
            if found is not None or reason:
                return found, reason
        return None, ""

    def _run(
        self, case: Case, theta: Mapping[str, float], key: str, step_factor: float
    ) -> tuple[Histories | None, str]:
        """Strike once and keep what came of it."""
        meta = {"values": dict(theta), "step_factor": step_factor}
        try:
            found = simulate(case, step_factor=step_factor, progress=self.progress)
        except RunFailed as failure:
            self.store.save_failure(key, str(failure), meta)
            return None, str(failure)
        self.store.save(key, found, meta)
        return found, ""


@runtime_checkable
class Watchable(Protocol):
    """A forward model that can report how far a run has come."""

    def watched(self, progress: Callable[[float], None]) -> Forward:
        """The same with its progress reported."""
        ...


def watched(forward: Forward, progress: Callable[[float], None]) -> Forward:
    """The forward model with its progress reported, where it can."""
    return forward.watched(progress) if isinstance(forward, Watchable) else forward
