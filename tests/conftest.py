"""How tests are shared between workers: files that share costly fixtures stay together, and the longest go first."""

from __future__ import annotations

import os
from typing import Any

import pytest

# Threads of linear algebra wait for one another by spinning, and take the cores from the tests of the other process.
# Before numpy and torch are imported; inherited by what a test starts.
os.environ.update(dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1"))

TOGETHER = {
    "reports": ("tests/reports/page", "tests/reports/results", "tests/reports/sections", "tests/reports/comparison"),
    "diagnosis": tuple(f"tests/inversion/diagnosis/test_{name}.py" for name in ("end_to_end", "explored", "predicted")),
}
"""Folders and files whose fixtures of a session would otherwise be made by every worker, by the name of their group."""

FIRST = (
    "tests/reports",
    "tests/inversion/diagnosis",
    "tests/outside",
    "tests/inversion/audit/test_audit.py",
    "tests/test_laboratory_records.py",
    "tests/cli",
)


@pytest.fixture(autouse=True)
def one_thread_beside_another_worker() -> None:
    """Threads of kernels that a test calls itself; those of a simulation follow the load (`solver.threads`).

    A loop waits for its slowest thread: where another worker has that core, a test of small kernels took 17 times as
    long.
    """
    if "PYTEST_XDIST_WORKER" in os.environ:
        import numba  # after the variables above are set

        numba.set_num_threads(1)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The longest first, so that no worker waits for another at the end."""
    items.sort(key=lambda item: next((i for i, name in enumerate(FIRST) if item.nodeid.startswith(name)), len(FIRST)))


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """Of `--dist loadscope`: a file stays with one worker, as do the folders in TOGETHER."""
    if config.getoption("dist") != "loadscope":
        return None
    from xdist.scheduler import LoadScopeScheduling

    class ByFixtures(LoadScopeScheduling):
        def _split_scope(self, nodeid: str) -> str:
            groups = (name for name, members in TOGETHER.items() if nodeid.startswith(members))
            return next(groups, super()._split_scope(nodeid))

    config.option.loadscopereorder = False
    return ByFixtures(config, log)
