"""Processes that strike, when a script starts them."""

from __future__ import annotations

from pathlib import Path

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
