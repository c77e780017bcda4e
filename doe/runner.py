"""The runner: strikes go to an executor, each result goes to the run store as it comes in."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from concurrent.futures.process import BrokenProcessPool
from typing import NamedTuple

from data.errors import RunFailed
from data.histories import Histories
from data.store import RunStore
from doe.attempt import Simulate, attempt
from doe.strike import Failed, Finished, Strike, consult, record
from solver.case import Case

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
            self._place(strike, consult(store, strike))
        self.reused = self.finished
        self.tell(workers=0)

    def run(self, executor: Executor, simulate: Simulate, case: Case, workers: int) -> None:
        """Carry out what is due, at most twice `workers` strikes handed over at a time; raises RunFailed."""
        while self.due or self.waiting:
            while self.due and len(self.waiting) < 2 * workers:
                strike, factor = self.due.popleft()
                sent = executor.submit(attempt, simulate, strike.case or case, strike.values, factor)
                self.waiting[sent] = (strike, factor)
            self.tell(workers)
            for future in wait(self.waiting, return_when=FIRST_COMPLETED).done:
                self._take(future)
        self.tell(workers)

    def tell(self, workers: int) -> None:
        """Report the progress."""
        running = min(len(self.waiting), workers)
        self.progress(Progress(self.total, self.finished, self.reused, running, self.failed))

    @property
    def finished(self) -> int:
        """Strikes that can be used."""
        return len(self.outcomes) - self.failed

    def _take(self, future: Future[Histories | str]) -> None:
        strike, factor = self.waiting.pop(future)
        try:
            result = future.result()
        except BrokenProcessPool as error:
            raise RunFailed(
                f"a worker process ended abruptly (killed, or out of memory); {self.finished} of {self.total} "
                "strikes are kept",
                "run the same command again to resume, with fewer --workers if memory is short",
            ) from error
        except MemoryError as error:
            raise RunFailed(
                f"run {strike.number} does not fit into memory; {self.finished} of {self.total} strikes are kept",
                "run again with fewer --workers or a coarser case (bird.particles, plate.elements)",
            ) from error
        self._place(strike, record(self.store, strike, factor, result))

    def _place(self, strike: Strike, state: Outcome | float) -> None:
        if isinstance(state, Finished | Failed):
            self.outcomes[strike.number] = state
            self.failed += isinstance(state, Failed)
        else:
            self.due.append((strike, state))
