"""Speed of the solver, as ratios within one run (`make bench`); figures are printed, nothing about time is asserted."""

from __future__ import annotations

import os
import subprocess
import sys
import time

import numpy as np
import pytest

from solver.case import Case, load_case
from solver.simulate import simulate

SHORT = {"time.end": "0.5 ms", "time.snapshots": "[]", "impact.standoff": "1 mm"}


def short(particles: int, elements: str = "[50, 40]") -> Case:
    return load_case("reference_strike", SHORT | {"bird.particles": str(particles), "plate.elements": elements})


def timed(case: Case, threads: int = 1) -> tuple[float, dict[str, float]]:
    """Best of three, seconds, and the run's counts."""
    simulate(load_case("reference_strike", SHORT | {"time.end": "0.02 ms"}), threads=threads)
    best, summary = np.inf, {}
    for _ in range(3):
        start = time.perf_counter()
        summary = dict(simulate(case, threads=threads).summary)
        best = min(best, time.perf_counter() - start)
    return best, summary


def say(capsys: pytest.CaptureFixture[str], text: str) -> None:
    with capsys.disabled():
        print(f"\n  {text}", flush=True)  # noqa: T201


def test_cost_per_particle_step(capsys):
    seconds, counts = timed(short(4500))
    alone, _ = timed(short(4500, "[4, 4]"))
    steps = counts["steps"] * counts["particles"]
    say(capsys, f"whole strike: {1e6 * seconds / steps:.2f} us per particle-step on one thread, plate included")
    say(capsys, f"share of the plate: {1.0 - alone / seconds:.0%} (against a plate of 16 shells; its step differs)")


def test_reference_strike_on_one_core(capsys):
    start = time.perf_counter()
    summary = simulate(load_case("reference_strike"), threads=1).summary
    seconds = time.perf_counter() - start
    say(
        capsys,
        f"reference strike, {summary['particles']} particles, {summary['steps']} steps: {seconds:.1f} s on one core",
    )


def test_cost_grows_linearly(capsys):
    sizes, costs = [], []
    for particles in (1000, 4000, 16000):
        seconds, counts = timed(short(particles, "[4, 4]"))
        sizes.append(counts["particles"])
        costs.append(seconds / counts["steps"])
    exponent = np.polyfit(np.log(sizes), np.log(costs), 1)[0]
    say(capsys, f"cost per step grows with the particles to the power {exponent:.2f} (1,000 to 16,000)")


def test_two_threads_against_one(capsys):
    one, _ = timed(short(4500), threads=1)
    two, _ = timed(short(4500), threads=min(2, os.cpu_count() or 1))
    say(capsys, f"two threads on one strike: {one / two:.2f} times faster than one")


def test_start_of_a_command(capsys):
    times = []
    command = [sys.executable, "-m", "birdstrike", "check", "reference_strike"]
    for _ in range(3):
        start = time.perf_counter()
        subprocess.run(command, check=True, capture_output=True)
        times.append(time.perf_counter() - start)
    say(capsys, f"`birdstrike check` with compiled code cached: {min(times):.1f} s")
