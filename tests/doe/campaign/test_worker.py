"""Processes that strike, when a script starts them."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import pytest

from birdstrike.doe.campaign.worker import process_pool
from tests.script import run_script

SCRIPT = """
import numba

from birdstrike.doe.campaign.worker import process_pool

numba.get_num_threads()  # launches the threads, as importing the solver does


def strike():
    numba.set_num_threads(1)
    return numba.njit(lambda x: x + 1)(1)


if __name__ == "__main__":
    with process_pool(1) as pool:
        print(pool.submit(strike).result())
"""


def test_a_script_that_imports_numba_at_its_top_can_strike(tmp_path: Path) -> None:
    """Whatever compiles in a worker would otherwise fail where nothing is cached yet: every strike of a campaign."""
    assert run_script(tmp_path, SCRIPT, 300.0) == "2"


WORKERS_OF_A_WORKER = """
from birdstrike.doe.campaign.worker import process_pool


def record():
    with process_pool(1) as pool:
        return pool.submit(abs, -2).result()


if __name__ == "__main__":
    with process_pool(1) as pool:
        print(pool.submit(record).result())
"""


def test_a_program_ends_whose_workers_have_kept_workers_of_their_own(tmp_path: Path) -> None:
    """As those of an audit, each of which diagnoses: a worker waited for its own, which nothing told to end."""
    assert run_script(tmp_path, WORKERS_OF_A_WORKER, 60.0) == "2"


def test_the_next_campaign_finds_the_processes_of_the_last_one() -> None:
    """Each starts in seconds; those of another number of workers are new, as are those after an error."""
    with process_pool(1) as pool:
        first = pool.submit(os.getpid).result()
    with process_pool(1) as pool:
        assert pool.submit(os.getpid).result() == first
        with process_pool(1) as other:
            assert other.submit(os.getpid).result() != first
    with pytest.raises(ZeroDivisionError), process_pool(1) as pool:
        pool.submit(divmod, 1, 0).result()
    with process_pool(1) as pool:
        assert pool.submit(os.getpid).result() != first


def test_processes_that_died_between_two_campaigns_are_replaced() -> None:
    with process_pool(1) as pool:
        first = pool.submit(os.getpid).result()
    os.kill(first, signal.SIGKILL)
    with process_pool(1) as pool:
        assert pool.submit(os.getpid).result() != first


def test_processes_take_over_what_has_changed_around_them(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with process_pool(1) as pool:
        assert pool.submit(os.getcwd).result() == str(Path.cwd())
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("SOLVER_LICENCE", "here")
    with process_pool(1) as pool:
        assert pool.submit(os.getcwd).result() == str(tmp_path)
        assert pool.submit(os.getenv, "SOLVER_LICENCE").result() == "here"
