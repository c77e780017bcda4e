"""A campaign on a Dask cluster: the same futures, from workers that a scheduler hands the runs to."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple, cast

from birdstrike.data.errors import UserError
from birdstrike.data.histories import Histories
from birdstrike.doe.attempt import Simulate
from birdstrike.solver.case.case import Case

if TYPE_CHECKING:
    from distributed import Client

ANSWER_S = 20.0
AHEAD = 1000
"""Runs handed over at a time: enough for an adaptive cluster to see that it should grow."""


class WrongWorker(UserError, OSError):
    """A worker with another solver than the campaign's: the machine's fault, not the run's."""


@dataclass(frozen=True)
class SameSolver:
    """The embedded solver, or WrongWorker from one whose version is another: workers may join at any time."""

    simulate: Simulate
    version: str

    def __call__(self, case: Case, **options: Any) -> Histories:
        """simulate(case, **options) by a worker of the right version."""
        here = version_here()
        if here != self.version:
            raise WrongWorker(_differs(f"this worker: {here}", self.version))
        return self.simulate(case, **options)


class Cluster(NamedTuple):
    """executor; threads: runs at a time now, 0 without a worker; lost: raised for a run whose workers died."""

    executor: Executor
    threads: int
    lost: tuple[type[Exception], ...]


@contextmanager
def cluster(address: str) -> Iterator[Cluster]:
    """The cluster of the scheduler at `address` ("tcp://host:8786"); what is not done yet is withdrawn on leaving.

    Raises UserError for what is no address, when no scheduler answers, and when a worker has no birdstrike or another
    version of its solver.
    """
    refuse_address(address)
    from distributed import Client, KilledWorker

    logging.getLogger("distributed.client").setLevel(logging.CRITICAL)  # a loss is told once, without its traceback
    try:
        client = Client(address, timeout=ANSWER_S, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise UserError(
            f"--scheduler = {address} does not answer ({error}); start one with: dask scheduler, and workers with: "
            f"{worker_command(address)}"
        ) from error
    with client:
        _refuse_other_solvers(client)
        executor = client.get_executor(pure=False)
        try:
            yield Cluster(executor, sum(cast(dict[str, int], client.nthreads()).values()), (KilledWorker,))
        finally:
            executor.shutdown(wait=False)


def refuse_address(address: str) -> None:
    """Raise UserError for what is no address of a scheduler, or where the library is missing."""
    try:
        from distributed.comm.addressing import get_address_host_port
    except ModuleNotFoundError as error:
        raise UserError('--scheduler needs dask.distributed: pip install "birdstrike[cluster]"') from error
    try:
        get_address_host_port(address)  # a Client that cannot read it would wait 40 s and end with a traceback
    except ValueError as error:
        raise UserError(f"--scheduler = {address} is no address ({error}); write tcp://host:8786") from error


def worker_command(address: str) -> str:
    """What starts a worker of one thread beside a scheduler."""
    return f"dask worker {address} --nthreads 1"


def _refuse_other_solvers(client: Client) -> None:
    """Raise UserError for workers whose solver is not this process's."""
    try:
        found = cast(dict[str, str], client.run(version_here))
    except Exception as error:  # whatever keeps a worker from loading the package
        raise UserError(
            f"a worker of the scheduler cannot load birdstrike ({type(error).__name__}: {error}); install it there"
        ) from error
    own = version_here()
    other = [f"{worker}: {version}" for worker, version in found.items() if version != own]
    if other:
        raise UserError(_differs(", ".join(other), own))


def _differs(found: str, wanted: str) -> str:
    return f"workers with another solver version than {wanted} ({found}); install the same birdstrike there"


def version_here() -> str:
    """The embedded solver's version of the process that is asked."""
    from birdstrike.solver.version import SOLVER_VERSION  # late: it reads every source file of the solver

    return SOLVER_VERSION
