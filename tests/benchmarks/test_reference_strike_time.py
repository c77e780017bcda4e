"""How long the reference strike takes on one core once its kernels are compiled; off by default, see `make bench`."""

from __future__ import annotations

import time

from solver.case import load_case
from solver.simulate import simulate

LIMIT_S = 15.0
BEST_OF = 3  # a busy machine makes a run slower, never faster


def test_reference_strike_runs_in_fifteen_seconds_on_one_core() -> None:
    case = load_case("reference_strike")
    simulate(load_case("reference_strike", {"time.end": "0.3 ms", "time.snapshots": "[]"}), threads=1)
    taken: list[float] = []
    for _ in range(BEST_OF):
        started = time.perf_counter()
        summary = simulate(case, threads=1).summary
        taken.append(time.perf_counter() - started)
    print(f"\nreference strike: {min(taken):.2f} s ({summary['particles']} particles, {summary['steps']} steps)")  # noqa: T201
    assert int(str(summary["particles"])) >= 4400
    assert summary["shells"] == 2000
    assert min(taken) <= LIMIT_S
