"""Simulations that calibrations of models ask for, several at a time, each kept; the processes start when needed."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor, Future
from contextlib import ExitStack, suppress
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from birdstrike.data.dataset import Dataset
from birdstrike.data.errors import CaseError, RunFailed
from birdstrike.data.histories import Histories
from birdstrike.data.progress import Progress
from birdstrike.data.storage.store import RunStore
from birdstrike.doe.campaign.run import PlannedRun
from birdstrike.doe.campaign.runner import Runner
from birdstrike.doe.campaign.worker import process_pool, worker_count
from birdstrike.doe.solvers import solver_for
from birdstrike.inversion import forward
from birdstrike.inversion.forward import Forward, StoredSolver, watched
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


@dataclass(frozen=True, eq=False)
class NearestFinished:
    """A forward model that answers with the nearest run of a campaign where its own simulation fails, and says so.

    A model whose best constants make the solver fail is still to be compared with the others.
    """

    forward: Forward
    dataset: Dataset
    say: Callable[[str], None]

    def __call__(self, theta: Mapping[str, float]) -> Histories:
        """Histories at these parameters, or at the nearest run's; raises RunFailed where that one fails too."""
        try:
            return self.forward(theta)
        except RunFailed as failure:
            place = np.array([theta[name] for name in self.dataset.names])
            nearest = self.dataset.nearest(place)
            number = int(self.dataset.runs[nearest])
            self.say(
                f"the simulation at an answer failed ({failure}): run {number} of the campaign, "
                "the nearest that finished, stands in for it, so that the errors are those of its constants; change "
                "what the solver asks for, or narrow the ranges: inversion.models"
            )
            return self.forward(self.dataset.named(self.dataset.parameters[nearest]))

    def watched(self, progress: Progress) -> NearestFinished:
        """The same with its progress reported."""
        return replace(self, forward=watched(self.forward, progress))
