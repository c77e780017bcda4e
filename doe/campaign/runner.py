"""The runner of a campaign: runs go to an executor, each result goes to the run store as it comes in."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Executor, Future, wait
from concurrent.futures.process import BrokenProcessPool
from typing import NamedTuple

from birdstrike.data.errors import MachineFailure, RunFailed, UserError
from birdstrike.data.histories import Histories
from birdstrike.data.storage.store import RunStore
from birdstrike.doe.attempt import Simulate, attempt
from birdstrike.doe.campaign.run import Failed, Finished, PlannedRun, State, keep, state_of
from birdstrike.solver.case.case import Case


class RunCounts(NamedTuple):
    """How far a campaign is, in runs: all, finished (of which found in the store), running, failed."""

    total: int
    finished: int
    reused: int
    running: int
    failed: int

    @property
    def done(self) -> float:
        """Share of the runs that are over, 0..1."""
        return (self.finished + self.failed) / max(self.total, 1)


class Runner:
    """State of a running campaign; `outcomes` by run number.

    retry: failures stored before this time [s, Unix] are tried again (doe.campaign.run.retry_before).
    """

    def __init__(
        self,
        store: RunStore,
        runs: Sequence[PlannedRun],
        progress: Callable[[RunCounts], None],
        retry: float = 0.0,
    ) -> None:
        self.store, self.progress, self.total, self.retry = store, progress, len(runs), retry
        self.outcomes: dict[int, Finished | Failed] = {}
        self.failed = 0
        self.due: deque[tuple[PlannedRun, float]] = deque()
        self.waiting: dict[Future[Histories | str], tuple[PlannedRun, float]] = {}
        for planned in runs:
            self._place(planned, state_of([store], planned, retry))
        self.reused = self.finished
        self.report(workers=0)

    def run(
        self,
        executor: Executor,
        simulate: Simulate,
        case: Case,
        workers: int,
        *,
        ahead: int | None = None,
        lost: tuple[type[Exception], ...] = (),
    ) -> None:
        """Carry out what is due; raises RunFailed when the executor is broken.

        ahead: most runs handed over at a time, twice `workers` by default. lost: what the executor raises for a run
        whose workers died under it again and again. Such a run, and one that the machine ended, is left out now, with
        nothing stored, and due again at the next call.
        """
        while self.due or self.waiting:
            while self.due and len(self.waiting) < (ahead or 2 * workers):
                self._send(executor, simulate, case)
            self.report(workers)
            if self.waiting:
                for future in wait(self.waiting, return_when=FIRST_COMPLETED).done:
                    self._take(future, lost)
        self.report(workers)

    def report(self, workers: int) -> None:
        """Report the progress."""
        running = min(len(self.waiting), workers)
        self.progress(RunCounts(self.total, self.finished, self.reused, running, self.failed))

    @property
    def finished(self) -> int:
        """Number of runs that can be used."""
        return len(self.outcomes) - self.failed

    def _send(self, executor: Executor, simulate: Simulate, case: Case) -> None:
        """Hand over the next run, unless another process on the same store has ended it meanwhile."""
        planned, factor = self.due.popleft()
        if self.store.path(planned.keys[factor]).exists():
            self._place(planned, state_of([self.store], planned, self.retry))
            return
        sent = executor.submit(attempt, simulate, planned.case or case, planned.values, factor, threads=1)
        self.waiting[sent] = (planned, factor)

    def _take(self, future: Future[Histories | str], lost: tuple[type[Exception], ...]) -> None:
        planned, factor = self.waiting.pop(future)
        try:
            result = future.result()
        except (BrokenProcessPool, CancelledError, MemoryError) as error:
            raise self._broken(planned, error) from error
        except lost as error:
            self._place(planned, Failed(f"its workers died under it ({error}); the next call tries it again", due=True))
            return
        except MachineFailure as error:
            self._place(planned, Failed(f"{error.reason}; the next call tries it again", due=True))
            return
        except OSError as error:
            if isinstance(error, FileNotFoundError | UserError):
                raise  # a program that is not there, a worker of another version: no later call mends it
            self._place(planned, Failed(f"{error}; the next call tries it again", due=True))
            return
        self._place(planned, keep([self.store], planned, factor, result, self.retry))

    def _broken(self, planned: PlannedRun, error: Exception) -> RunFailed:
        """Why the campaign cannot go on, and what to do."""
        kept = f"{self.finished} of {self.total} runs are kept"
        if isinstance(error, MemoryError):
            return RunFailed(
                f"run {planned.number} does not fit into memory; {kept}",
                "run again with fewer --workers or a coarser case: fewer bird.particles and shells",
            )
        if isinstance(error, CancelledError):
            return RunFailed(f"the scheduler was lost; {kept}", "run the same command again to resume")
        return RunFailed(
            f"a worker process ended abruptly (killed, or out of memory); {kept}",
            "run the same command again to resume, with fewer --workers if memory is short",
        )

    def _place(self, planned: PlannedRun, state: State) -> None:
        if isinstance(state, Finished | Failed):
            self.outcomes[planned.number] = state
            self.failed += isinstance(state, Failed)
        else:
            self.due.append((planned, state))
