"""Threads of a simulation: as many as are allowed, fewer while other programs take their cores."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager

import numba
from numba.core import config

MOST_THREADS: int = config.NUMBA_NUM_THREADS  # pyright: ignore[reportAttributeAccessIssue]
"""What the process may use, even where it has been lowered before this module is imported."""
UNDISTURBED = 0.75
"""Share of a period that a thread is at work in, waiting for others included; disturbed ones fall to 0.5."""
PATIENCE = (4, 64)  # periods before one thread more is tried again: at first, and at most


@contextmanager
def limited_threads(wanted: int) -> Iterator[Team]:
    """At most this many threads for numba's parallel loops; afterwards as many as before."""
    before = numba.get_num_threads()
    team = Team(min(wanted, MOST_THREADS))
    try:
        yield team
    finally:
        numba.set_num_threads(before)


class Team:
    """At most so many threads; they change no bit of a history, so that their number may follow the machine's load.

    A loop over particles ends with its slowest thread. Where another program has one of their cores, that takes longer
    than one thread less would: the reference strike on two cores, one of them taken, twice as long as on one thread. It
    shows in this thread, which sleeps once a wait has been long (`compilation.wait_briefly`): its time on a core
    falls behind the clock.
    """

    def __init__(self, most: int) -> None:
        self.most, self.threads = most, most
        self.calm, self.patience = 0, PATIENCE[0]
        self._begin()

    def _begin(self) -> None:
        """Start of a period with the present number of threads."""
        numba.set_num_threads(self.threads)
        self.clock, self.on_core = time.perf_counter(), time.thread_time()

    def follow_load(self) -> None:
        """End of a period: one thread fewer if it was disturbed, one more after some that were not."""
        if self.most == 1:
            return
        worked, passed = time.thread_time() - self.on_core, time.perf_counter() - self.clock
        self.threads = self.after(worked < UNDISTURBED * passed)
        self._begin()

    def after(self, disturbed: bool) -> int:
        """Threads of the next period; each attempt that was disturbed doubles the time until the next."""
        if disturbed and self.threads > 1:
            self.calm, self.patience = 0, min(2 * self.patience, PATIENCE[1])
            return self.threads - 1
        self.calm += 1
        if self.calm < self.patience:
            return self.threads
        self.calm = 0
        if self.threads == self.most:
            self.patience = PATIENCE[0]
        return min(self.threads + 1, self.most)
