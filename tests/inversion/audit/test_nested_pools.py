"""A worker that keeps pools of its own ends with them."""

from __future__ import annotations

from pathlib import Path

from tests.script import run_script

SCRIPT = """
from contextlib import ExitStack
from multiprocessing.util import Finalize

from birdstrike.doe.campaign.worker import process_pool
from birdstrike.inversion.audit.audit import BEFORE_QUEUES

stack = None


def inner(x):
    return x * x


def outer(x):
    global stack
    if stack is None:
        stack = ExitStack()
        Finalize(None, stack.close, exitpriority=BEFORE_QUEUES)
        for _ in range(2):
            stack.enter_context(process_pool(1)).submit(inner, 1).result()
    return x


if __name__ == "__main__":
    with process_pool(1) as pool:
        print(pool.submit(outer, 3).result())
"""


def test_workers_with_two_pools_of_their_own_end(tmp_path: Path) -> None:
    """Queues close at exit priority 10: pools that end with them could no longer tell their processes to."""
    assert run_script(tmp_path, SCRIPT, 300.0) == "3"
