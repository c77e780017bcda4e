"""A campaign on a Dask cluster: a real scheduler and real workers on loopback, one of which is killed."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import pytest

from birdstrike.data.errors import RunFailed, UserError
from birdstrike.data.storage.store import RunStore
from birdstrike.doe.campaign.campaign import run_campaign
from birdstrike.doe.campaign.cluster import SameSolver, WrongWorker, cluster
from birdstrike.doe.designs.registry import make_design
from birdstrike.doe.designs.space import ParameterSpace
from tests.doe.campaign.test_campaign import campaign as here_campaign
from tests.doe.campaign.test_interruption import until
from tests.doe.external.test_external import campaign as external_campaign
from tests.doe.external_case import oscillator
from tests.doe.stand_in import VERSION, attempts, design, pids, reference, strike

distributed = pytest.importorskip("distributed")

RUNS = 16


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    """A scheduler with two workers, each a process of one thread under a nanny that replaces it when it dies."""
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, host="127.0.0.1", dashboard_address=None
    ) as local:
        yield local.scheduler_address


def test_a_worker_killed_midway_costs_its_strike_and_nothing_else(tmp_path: Path, address: str) -> None:
    diary, whole = tmp_path / "diary", tmp_path / "whole"
    here_campaign(whole, design(RUNS))
    killed: list[int] = []

    def kill() -> None:
        until(lambda: len(attempts(diary, "ended")) >= 3)
        killed.append(max(pids(diary)))
        os.kill(killed[0], signal.SIGKILL)

    killer = threading.Thread(target=kill)
    killer.start()
    simulate = partial(strike, diary=diary, seconds=0.15)
    run_campaign(
        reference(), design(RUNS), tmp_path / "out", simulate=simulate, solver_version=VERSION, scheduler=address,
        say=lambda _: None,
    )  # fmt: skip
    killer.join()
    assert (tmp_path / "out" / "curves.csv").read_bytes() == (whole / "curves.csv").read_bytes()
    assert len(pids(diary)) >= 2
    assert RUNS <= len(attempts(diary)) <= RUNS + 4  # the strike in flight, and results that the dead worker still held


def test_an_external_solver_runs_on_the_cluster_as_here(tmp_path: Path, address: str) -> None:
    case = oscillator(tmp_path / "case")
    external_campaign(case, tmp_path / "here")
    planned = make_design("lhs", ParameterSpace.of(case.parameters()), 4)
    run_campaign(case, planned, tmp_path / "there", scheduler=address, say=lambda _: None)
    here, there = (RunStore(tmp_path / name / "runs").keys() for name in ("here", "there"))
    assert here == there
    assert (tmp_path / "here" / "curves.csv").read_bytes() == (tmp_path / "there" / "curves.csv").read_bytes()


def test_a_scheduler_that_does_not_answer_is_the_user_s_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("birdstrike.doe.campaign.cluster.ANSWER_S", 0.5)
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    answer = rf"--scheduler = tcp://127.0.0.1:{port} does not answer.*dask scheduler"
    with pytest.raises(UserError, match=answer), cluster(f"tcp://127.0.0.1:{port}"):
        pass


def test_a_scheduler_without_workers_is_said_and_its_loss_told_without_a_traceback(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """The runs waited without a word, and dask's client printed 25 lines of traceback when the scheduler went."""
    said, place = list[str](), tmp_path / "scheduler.json"
    options = ("--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", str(place))
    with subprocess.Popen([sys.executable, "-m", "distributed.cli.dask_scheduler", *options]) as alone:
        until(place.exists)
        address = json.loads(place.read_text(encoding="utf-8"))["address"]

        def lose(line: str) -> None:
            said.append(line)
            if "no workers yet" in line:
                threading.Timer(0.5, alone.kill).start()

        with pytest.raises(RunFailed, match="the scheduler was lost; 0 of 4 runs are kept"):
            run_campaign(
                reference(), design(4), tmp_path / "out", simulate=strike, solver_version=VERSION,
                scheduler=address, say=lose,
            )  # fmt: skip
    (waits,) = (line for line in said if line.startswith(f"--scheduler = {address} has no workers yet"))
    assert f"dask worker {address} --nthreads 1" in waits
    assert not [record for record in caplog.records if record.name.startswith("distributed.client")]


def test_what_is_no_address_of_a_scheduler_is_named_at_once() -> None:
    """It was handed to dask, whose client then waited 40 s and ended with a traceback."""
    answer = "--scheduler = foo is no address .*port.*; write tcp://host:8786"
    with pytest.raises(UserError, match=answer), cluster("foo"):
        pass


def test_a_worker_of_another_version_is_refused(monkeypatch: pytest.MonkeyPatch, address: str) -> None:
    with pytest.raises(WrongWorker, match="workers with another solver version than 0123"):
        SameSolver(strike, "0123")(reference())
    monkeypatch.setattr("birdstrike.solver.version.SOLVER_VERSION", "0123")
    with pytest.raises(UserError, match="workers with another solver version than 0123"), cluster(address):
        pass
