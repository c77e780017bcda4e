"""The forward model of an inversion: parameters in, histories out; by default our solver behind the run store."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

from data.errors import RunFailed
from data.histories import Histories
from data.store import RunStore, run_key
from solver.case import Case
from solver.simulate import simulate
from solver.version import SOLVER_VERSION

Forward = Callable[[Mapping[str, float]], Histories]
"""forward({dotted case key: SI value}) -> Histories; may raise RunFailed."""

SAFER_STEP = 0.5


@dataclass(frozen=True)
class StoredSolver:
    """The solver at given parameters, each run paid once; read: further stores in which a run may already lie."""

    case: Case
    store: RunStore
    read: tuple[RunStore, ...] = ()
    progress: Callable[[float], None] | None = None

    def key(self, theta: Mapping[str, float], step_factor: float = 1.0) -> str:
        """Name of the run in the store."""
        return run_key(self.case.with_values(theta).canonical(), SOLVER_VERSION, step_factor)

    def __call__(self, theta: Mapping[str, float]) -> Histories:
        """A stored run or a new one; an unstable run is tried once more at half the step. Raises RunFailed."""
        for step_factor in (1.0, SAFER_STEP):
            key = self.key(theta, step_factor)
            for store in (self.store, *self.read):
                if (found := store.load(key)) is not None:
                    return _named(found, key)
            try:
                return _named(self._run(theta, key, step_factor), key)
            except RunFailed as error:
                self.store.save_failure(key, error.reason, {"parameters": dict(theta), "step_factor": step_factor})
                failure = error
        raise failure

    def _run(self, theta: Mapping[str, float], key: str, step_factor: float) -> Histories:
        histories = simulate(self.case.with_values(theta), step_factor=step_factor, progress=self.progress)
        self.store.save(key, histories, {"parameters": dict(theta), "step_factor": step_factor})
        return histories


def _named(histories: Histories, key: str) -> Histories:
    """The histories with the key under which the store keeps them."""
    return replace(histories, summary={**histories.summary, "run_key": key})
