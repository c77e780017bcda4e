"""10 000 runs of a cheap stand-in: bookkeeping per run, memory, and how fast pandas reads the curves. `make bench`.

The bound on bookkeeping is one of processor time; the wall, shown beside it, means something on an idle machine only.
"""

from __future__ import annotations

import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pandas as pd
import pytest

from birdstrike.doe.campaign.campaign import run_campaign
from birdstrike.doe.campaign.runner import RunCounts
from tests.doe.stand_in import VERSION, design, reference, strike

RUNS = 10_000
PAGE_MB = 4096 / 1e6


def resident() -> float:
    """Memory of this process [MB]."""
    return int(Path("/proc/self/statm").read_text(encoding="utf-8").split()[1]) * PAGE_MB


def timed_strike(runs: int = 200) -> float:
    """Seconds that the stand-in itself takes."""
    case = reference()
    strike(case)
    begun = time.perf_counter()
    for _ in range(runs):
        strike(case)
    return (time.perf_counter() - begun) / runs


def test_ten_thousand_runs(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    memory: dict[int, float] = {}

    def note(state: RunCounts) -> None:
        for count in (2000, RUNS - 100):
            if state.finished >= count and count not in memory:  # progress does not come after every run
                memory[count] = resident()

    own, planned, begun, cpu = timed_strike(), design(RUNS), time.perf_counter(), time.process_time()
    with ThreadPoolExecutor(1) as executor:
        run_campaign(
            reference(), planned, tmp_path, workers=1, simulate=strike, solver_version=VERSION, say=lambda _: None,
            progress=note, executor=executor,
        )  # fmt: skip
    wall, cpu = (time.perf_counter() - begun) / RUNS - own, (time.process_time() - cpu) / RUNS - own
    begun = time.perf_counter()
    table = pd.read_csv(tmp_path / "curves.csv")
    reading = time.perf_counter() - begun
    growth = memory[RUNS - 100] - memory[2000]
    with capsys.disabled():
        print(  # noqa: T201
            f"\n{RUNS} runs: bookkeeping {1e3 * wall:.2f} ms of wall and {1e3 * cpu:.2f} ms of processor a run; memory "
            f"grows by {growth:.0f} MB from run 2000 on; pandas reads {len(table)} rows in {reading:.2f} s"
        )
    assert len(table) == RUNS * 31
    assert cpu <= 5e-3
    assert growth < 20.0
    assert reading < 2.0
