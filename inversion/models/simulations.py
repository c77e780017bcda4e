"""Simulations that calibrations of models ask for, several at a time, each kept; the processes start when needed."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor, Future
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from typing import Any

from birdstrike.data.errors import CaseError, RunFailed
from birdstrike.data.histories import Histories
from birdstrike.data.storage.store import RunStore
from birdstrike.doe.campaign.run import PlannedRun
from birdstrike.doe.campaign.runner import Runner
from birdstrike.doe.campaign.worker import process_pool, worker_count
from birdstrike.doe.solvers import solver_for
from birdstrike.inversion import forward
from birdstrike.inversion.forward import StoredSolver
from birdstrike.solver.case.case import Case


class LatePool(Executor):
    """A pool of processes for several campaigns, started at the first run that is not at hand."""

    def __init__(self, workers: int | None = None) -> None:
        self.workers = worker_count(workers)
        self._stack = ExitStack()
        self._pool: Executor | None = None

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        if self._pool is None:
            self._pool = self._stack.enter_context(process_pool(self.workers))
        return self._pool.submit(fn, *args, **kwargs)

    def __exit__(self, *error: Any) -> bool | None:
        return self._stack.__exit__(*error)


def simulate_all(
    jobs: Sequence[tuple[Case, Mapping[str, float]]],
    store: RunStore,
    pool: LatePool,
    retry: float = 0.0,
) -> None:
    """Run each case at these SI values into the store, where the reason of one that fails is kept too.

    Values that a case refuses are left out: `PlacedSolver` gives their reason.
    """
    placed: list[Case] = []
    for case, values in jobs:
        with suppress(CaseError):
            placed.append(case.with_values(values) if values else case)
    if not placed:
        return
    solvers = [solver_for(case, forward.simulate) for case in placed]
    planned = [PlannedRun.alone(i, case, solvers[i]) for i, case in enumerate(placed)]
    runner = Runner(store, planned, lambda _: None, retry)
    if runner.due:
        runner.run(pool, solvers[0].simulate, placed[0], pool.workers)


@dataclass(frozen=True)
class PlacedSolver(StoredSolver):
    """The solver at values inside ranges whose combination the case may refuse: such a run fails, as any other."""

    def __call__(self, theta: Mapping[str, float]) -> Histories:
        """A stored run or a new one; raises RunFailed."""
        try:
            return super().__call__(theta)
        except CaseError as error:
            raise RunFailed("; ".join(error.errors), "narrow the ranges: inversion.models") from error
