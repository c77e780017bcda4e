"""Processes for runs: started fresh, on one thread each, kept for the next campaign of their program, gone with it."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import get_context
from multiprocessing.util import Finalize
from pathlib import Path
from typing import Any

from birdstrike.data.errors import UserError, refuse_not_whole

ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def worker_count(workers: int | None) -> int:
    """Processes at a time, all cores by default; raises UserError."""
    if workers is not None:
        refuse_not_whole("--workers", workers, "leave it out to use all cores")
        if workers < 1:
            raise UserError(f"--workers = {workers} is below 1; leave it out to use all cores")
    return workers or os.cpu_count() or 1


class UninterruptedPool(ProcessPoolExecutor):
    """A pool whose processes start with Ctrl-C blocked: before `prepare` they would answer it with a traceback."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """As of any executor; a process that is started for it inherits the blocked signal."""
        if not hasattr(signal, "pthread_sigmask"):  # Windows
            return super().submit(fn, *args, **kwargs)
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            return super().submit(fn, *args, **kwargs)
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)


@dataclass(frozen=True)
class Processes:
    """A pool of processes. surroundings: what they took over when they started; lifeline: they end when it closes."""

    pool: ProcessPoolExecutor
    surroundings: tuple[object, ...]
    lifeline: Any  # a connection, whose class depends on the platform
    far_end: Any

    @classmethod
    def started(cls, workers: int) -> Processes:
        """New ones. They are spawned, since numba's threads do not survive a fork."""
        context = get_context("spawn")
        far_end, lifeline = context.Pipe(duplex=False)
        pool = UninterruptedPool(workers, mp_context=context, initializer=prepare, initargs=(far_end,))
        return cls(pool, surroundings(workers), lifeline, far_end)

    @property
    def alive(self) -> bool:
        """Whether they still answer."""
        try:
            return self.pool.submit(bool).result() is False
        except BrokenExecutor:
            return False

    def end(self, at_once: bool = False) -> None:
        """End them, when their runs are done or at once."""
        if at_once:
            self.lifeline.close()
        self.pool.shutdown(cancel_futures=True)
        self.lifeline.close()
        self.far_end.close()


_kept: list[Processes] = []
"""The processes that the last campaign left: to start them takes as long as several small simulations."""
BEFORE_QUEUES = 20
"""Priority of the end of a worker's own workers: before their queues are closed (10, multiprocessing.queues), by which
they are told to end, and before the worker waits for them (at 0)."""
MOMENTARY = ("COLUMNS", "LINES", "PYTEST_CURRENT_TEST")  # change from call to call and mean nothing to a simulation


def surroundings(workers: int) -> tuple[object, ...]:
    """What a process takes over from this one when it starts; other processes are needed once it has changed."""
    variables = {name: value for name, value in os.environ.items() if name not in MOMENTARY}
    return workers, Path.cwd(), tuple(sys.path), tuple(sorted(variables.items()))


@contextmanager
def process_pool(workers: int) -> Iterator[Executor]:
    """`workers` processes; when the block is left by an error or Ctrl-C they stop at once, runs in flight included.

    Otherwise they are kept for the next block. A script that starts a campaign needs `if __name__ == "__main__":`
    around it, because they are spawned.
    """
    processes = _left_over(workers) or Processes.started(workers)
    try:
        yield processes.pool
    except BaseException:
        processes.end(at_once=True)
        raise
    _kept.append(processes)


def _end_kept() -> None:
    """End the processes that were kept; a program's own end does so by itself."""
    while _kept:
        _kept.pop().end()


def _left_over(workers: int) -> Processes | None:
    """The kept processes where they can serve; others are ended."""
    wanted = surroundings(workers)
    while _kept:
        found = _kept.pop()
        if found.surroundings == wanted and found.alive:
            return found
        found.end()
    return None


def prepare(lifeline: Any) -> None:
    """First act of a worker: one thread for the numerical libraries, Ctrl-C left to the campaign's own process.

    Numba is left alone where a script that imports it at its top has done so here already: it reads the environment
    anew whenever it compiles, and refuses to have other threads than those launched. A run asks it for one anyway.
    """
    libraries = ONE_THREAD if "numba" in sys.modules else ("NUMBA_NUM_THREADS", *ONE_THREAD)
    os.environ.update(dict.fromkeys(libraries, "1"))
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    Finalize(None, _end_kept, exitpriority=BEFORE_QUEUES)
    threading.Thread(target=_end_with, args=(lifeline,), daemon=True).start()


def _end_with(lifeline: Any) -> None:
    """Leave when the campaign closes the lifeline, by will or by its death; otherwise workers would wait for ever."""
    try:
        lifeline.recv_bytes()
    except (EOFError, OSError):
        os._exit(1)
