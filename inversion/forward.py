"""The forward model of an inversion: parameters in, histories out; by default our solver behind the run store."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Protocol, runtime_checkable

from birdstrike.data.errors import RunFailed
from birdstrike.data.histories import Histories
from birdstrike.data.progress import Progress, silent
from birdstrike.data.storage.store import RunStore
from birdstrike.doe.campaign.run import Failed, PlannedRun, carried_out
from birdstrike.doe.solvers import solver_for
from birdstrike.solver.case.case import Case
from birdstrike.solver.simulate import simulate

Forward = Callable[[Mapping[str, float]], Histories]
"""forward({dotted case key: SI value}) -> Histories; may raise RunFailed."""


@dataclass(frozen=True)
class StoredSolver:
    """The solver at given parameters, each run paid once; read: further stores in which a run may already lie.

    retry: runs whose failure was stored before this time [s, Unix] are tried again.
    """

    case: Case
    store: RunStore
    read: tuple[RunStore, ...] = ()
    progress: Progress = silent
    retry: float = 0.0

    def __call__(self, theta: Mapping[str, float]) -> Histories:
        """A stored run or a new one, its key in the summary as `run_key`.

        A run that fails gets its second chance as in a campaign. Raises RunFailed.
        """
        solver = solver_for(self.case, simulate)
        run = PlannedRun.of(0, theta, self.case.with_values(theta), solver)
        stores = (self.store, *self.read)
        state = carried_out(stores, run, solver, self.case, self.retry, progress=self.progress)
        if isinstance(state, Failed):
            raise RunFailed(state.reason, "see the case and the parameters' ranges")
        found = state.histories
        return replace(found, summary={**found.summary, "run_key": state.key})

    def watched(self, progress: Progress) -> StoredSolver:
        """The same with its progress reported, 0..1 for each run."""
        return replace(self, progress=progress)


@runtime_checkable
class Watchable(Protocol):
    """A forward model that can report how far a run has come."""

    def watched(self, progress: Progress) -> Forward:
        """The same with its progress reported."""
        ...


def watched(forward: Forward, progress: Progress) -> Forward:
    """The forward model with its progress reported, where it can."""
    return forward.watched(progress) if isinstance(forward, Watchable) else forward
