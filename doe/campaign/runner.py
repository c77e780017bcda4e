"""The runner: strikes go to an executor, each result goes to the run store as it comes in."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Executor, Future, wait
from concurrent.futures.process import BrokenProcessPool
from typing import NamedTuple

from birdstrike.data.errors import RunFailed
from birdstrike.data.histories import Histories
from birdstrike.data.store import RunStore
from birdstrike.doe.campaign.attempt import Simulate, attempt
from birdstrike.doe.campaign.run import Failed, Finished, Strike, consult, record
from birdstrike.solver.case.case import Case

Outcome = Finished | Failed


class Progress(NamedTuple):
    """How far a campaign is, in strikes: all, finished (of which found in the store), running, failed."""

    total: int
    finished: int
    reused: int
    running: int
    failed: int


class Runner:
    """State of a running campaign; `outcomes` by run number."""

    def __init__(self, store: RunStore, strikes: Sequence[Strike], progress: Callable[[Progress], None]) -> None:
        self.store, self.progress, self.total = store, progress, len(strikes)
        self.outcomes: dict[int, Outcome] = {}
        self.failed = 0
        self.due: deque[tuple[Strike, float]] = deque()
        self.waiting: dict[Future[Histories | str], tuple[Strike, float]] = {}
        for strike in strikes:
            self._place(strike, consult([store], strike))
        self.reused = self.finished
        self.tell(workers=0)

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

        ahead: most strikes handed over at a time, twice `workers` by default. lost: what the executor raises for a
        strike whose workers died under it again and again: it is left out now, and due again at the next call.
        """
        while self.due or self.waiting:
            while self.due and len(self.waiting) < (ahead or 2 * workers):
                self._send(executor, simulate, case)
            self.tell(workers)
            if self.waiting:
                for future in wait(self.waiting, return_when=FIRST_COMPLETED).done:
                    self._take(future, lost)
        self.tell(workers)

    def tell(self, workers: int) -> None:
        """Report the progress."""
        running = min(len(self.waiting), workers)
        self.progress(Progress(self.total, self.finished, self.reused, running, self.failed))

    @property
    def finished(self) -> int:
        """Strikes that can be used."""
        return len(self.outcomes) - self.failed

    def _send(self, executor: Executor, simulate: Simulate, case: Case) -> None:
        """Hand over the next strike, unless another process on the same store has ended it meanwhile."""
        strike, factor = self.due.popleft()
        if self.store.path(strike.keys[factor]).exists():
            self._place(strike, consult([self.store], strike))
            return
        sent = executor.submit(attempt, simulate, strike.case or case, strike.values, factor, threads=1)
        self.waiting[sent] = (strike, factor)

    def _take(self, future: Future[Histories | str], lost: tuple[type[Exception], ...]) -> None:
        strike, factor = self.waiting.pop(future)
        try:
            result = future.result()
        except (BrokenProcessPool, CancelledError, MemoryError) as error:
            raise self._broken(strike, error) from error
        except lost as error:
            self._place(strike, Failed(f"its workers died under it ({error}); the next call tries it again"))
            return
        self._place(strike, record([self.store], strike, factor, result))

    def _broken(self, strike: Strike, error: Exception) -> RunFailed:
        """Why the campaign cannot go on, and what to do."""
        kept = f"{self.finished} of {self.total} strikes are kept"
        if isinstance(error, MemoryError):
            return RunFailed(
                f"run {strike.number} does not fit into memory; {kept}",
                "run again with fewer --workers or a coarser case (bird.particles, plate.elements)",
            )
        if isinstance(error, CancelledError):
            return RunFailed(f"the scheduler was lost; {kept}", "run the same command again to resume")
        return RunFailed(
            f"a worker process ended abruptly (killed, or out of memory); {kept}",
            "run the same command again to resume, with fewer --workers if memory is short",
        )

    def _place(self, strike: Strike, state: Outcome | float) -> None:
        if isinstance(state, Finished | Failed):
            self.outcomes[strike.number] = state
            self.failed += isinstance(state, Failed)
        else:
            self.due.append((strike, state))
