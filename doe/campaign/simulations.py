"""Simulations of any set of cases, in parallel, each run once through the run store."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from contextlib import AbstractContextManager, ExitStack, nullcontext
from dataclasses import replace
from pathlib import Path

from birdstrike.data.errors import MachineFailure
from birdstrike.data.histories import Histories
from birdstrike.data.storage.store import RunStore
from birdstrike.doe.campaign.run import Finished, PlannedRun
from birdstrike.doe.campaign.runner import RunCounts, Runner
from birdstrike.doe.campaign.worker import process_pool, worker_count
from birdstrike.doe.solvers import solver_for
from birdstrike.solver.case.case import Case
from birdstrike.solver.simulate import simulate

Shown = Callable[[RunCounts], None]
Counter = Callable[[], AbstractContextManager[Shown]]
"""Makes the bar that is shown the counts of the runs."""


def uncounted() -> AbstractContextManager[Shown]:
    """No bar of simulations."""
    return nullcontext(lambda _: None)


class Simulations:
    """Runs cases; a context, because its workers live as long as it does.

    store: where new runs go; read: further stores in which a run may already lie. paid, reused: simulations so far.
    """

    def __init__(
        self,
        store: str | Path,
        read: tuple[Path, ...] = (),
        workers: int | None = None,
        shown: Shown = lambda _: None,
        retry: float = 0.0,
    ) -> None:
        self.store, self.read = RunStore(store), tuple(RunStore(path) for path in read)
        self.workers, self.shown = worker_count(workers), shown
        self.paid, self.reused, self.failures = 0, 0, dict[str, str]()
        self.retry = retry
        self._stack, self._pool = ExitStack(), None

    def __enter__(self) -> Simulations:
        return self

    def __exit__(self, *error: object) -> None:
        self._stack.__exit__(*error)  # pyright: ignore[reportArgumentType]

    def run(self, cases: Mapping[str, Case]) -> dict[str, Histories]:
        """Histories of the cases by their labels; those that fail are left out and noted in `failures`.

        Raises MachineFailure where memory, the disk or a signal ended a run.
        """
        planned = {label: _planned(i, case) for i, (label, case) in enumerate(cases.items())}
        for run in planned.values():
            self._fetch(run)
        runner = Runner(self.store, list(planned.values()), self.shown, self.retry)
        self.paid += len(runner.due)
        self.reused += runner.finished
        if runner.due:
            case = next(iter(cases.values()))
            runner.run(self._executor(), solver_for(case, simulate).simulate, case, self.workers)
        found: dict[str, Histories] = {}
        for label, run in planned.items():
            outcome = runner.outcomes[run.number]
            if isinstance(outcome, Finished):
                found[label] = outcome.histories
            elif outcome.due:
                raise MachineFailure(outcome.reason)
            else:
                self.failures[label] = outcome.reason
        return found

    def _executor(self) -> Executor:
        if self._pool is None:
            self._pool = self._stack.enter_context(process_pool(self.workers))
        return self._pool

    def _fetch(self, run: PlannedRun) -> None:
        """Bring a run that another store holds into one's own."""
        if any(self.store.path(key).exists() for key in run.keys.values()):
            return
        for factor, key in run.keys.items():
            for other in self.read:
                found = other.look_up(key)
                if found is not None:
                    self.store.save(key, replace(found, snapshots=()), other.meta(key) | {"step_factor": factor})
                    return


def _planned(number: int, case: Case) -> PlannedRun:
    """A case by its effects' keys: workers know the library of effects, but no effect of the user's own."""
    plain = case.resolved()
    return PlannedRun.alone(number, plain, solver_for(plain, simulate))
