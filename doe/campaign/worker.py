"""Processes for runs: started fresh, on one thread each, and gone as soon as their campaign is gone."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context
from typing import Any

from birdstrike.data.errors import UserError

ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def worker_count(workers: int | None) -> int:
    """Processes at a time, all cores by default; raises UserError."""
    if workers is not None and workers < 1:
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


@contextmanager
def process_pool(workers: int) -> Iterator[Executor]:
    """`workers` processes; when the block is left by an error or Ctrl-C they stop at once, runs in flight included.

    They are spawned, since numba's threads do not survive a fork; a script that starts a campaign therefore needs
    `if __name__ == "__main__":` around it.
    """
    context = get_context("spawn")
    far_end, lifeline = context.Pipe(duplex=False)
    pool = UninterruptedPool(workers, mp_context=context, initializer=prepare, initargs=(far_end,))
    try:
        yield pool
    except BaseException:
        lifeline.close()
        raise
    finally:
        pool.shutdown(cancel_futures=True)
        lifeline.close()
        far_end.close()


def prepare(lifeline: Any) -> None:
    """First act of a worker: one thread for the numerical libraries, Ctrl-C left to the campaign's own process.

    Numba is left alone where a script that imports it at its top has done so here already: it reads the environment
    anew whenever it compiles, and refuses to have other threads than those launched. A run asks it for one anyway.
    """
    libraries = ONE_THREAD if "numba" in sys.modules else ("NUMBA_NUM_THREADS", *ONE_THREAD)
    os.environ.update(dict.fromkeys(libraries, "1"))
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with, args=(lifeline,), daemon=True).start()


def _end_with(lifeline: Any) -> None:
    """Leave when the campaign closes the lifeline, by will or by its death; otherwise workers would wait for ever."""
    try:
        lifeline.recv_bytes()
    except (EOFError, OSError):
        os._exit(1)
