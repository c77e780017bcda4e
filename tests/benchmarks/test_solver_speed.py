"""Speed of the solver, as ratios within one run (`make bench`); figures are printed, nothing about time is asserted."""

from __future__ import annotations

import subprocess
import sys
import time

import numba
import numpy as np
import pytest

from solver.case import load_case
from solver.kernels.sph import pair_forces
from solver.kernels.velocity_gradient import rate_of_deformation
from solver.simulate import simulate
from tests.benchmarks.parts import (
    COLUMNS,
    FLOPS,
    advance,
    bytes_per_particle,
    ceilings,
    cost,
    peak_memory,
    quickest,
    rate_together,
    swirling_bird,
)


def say(capsys: pytest.CaptureFixture[str], text: str) -> None:
    with capsys.disabled():
        print(f"\n  {text}", flush=True)  # noqa: T201


@pytest.fixture(autouse=True)
def one_thread():
    """One thread unless a benchmark says otherwise."""
    before = numba.get_num_threads()
    numba.set_num_threads(1)
    yield
    numba.set_num_threads(before)


def test_reference_strike_on_one_core(capsys):
    short = {"bird.particles": "500", "time.end": "0.05 ms", "time.snapshots": "[]"}
    simulate(load_case("reference_strike", short), threads=1)
    wall, cpu = time.perf_counter(), time.process_time()
    run = simulate(load_case("reference_strike"), threads=1).summary
    wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
    counts = f"{run['particles']} particles x {run['bird_steps']} steps, {run['shells']} shells x {run['steps']} steps"
    say(capsys, f"reference strike, 3 ms ({counts}): {wall:.1f} s of wall, {cpu:.1f} s of one core")


def test_cost_of_a_particle_step(capsys):
    bird = swirling_bird(4500)
    seconds = cost(bird, 100)
    near = sum(np.linalg.norm(bird.x[:, None] - bird.x[::50][None], axis=2).T.ravel() < 2.0 * bird.h) * 50 / bird.n
    text = f"{1e6 * seconds:.2f} us per particle-step, {near - 1:.0f} neighbours, lists and books included"
    say(capsys, f"bird alone, {bird.n} particles, one thread, float64: {text}")


def test_cost_grows_linearly(capsys):
    sizes, costs = [], []
    for particles, steps in ((1_000, 200), (10_000, 30), (100_000, 12), (1_000_000, 6)):
        bird = swirling_bird(particles)
        sizes.append(bird.n)
        costs.append(cost(bird, steps))
    each = ", ".join(f"{n}: {1e6 * seconds:.2f} us" for n, seconds in zip(sizes, costs, strict=True))
    exponent = 1.0 + np.polyfit(np.log(sizes), np.log(costs), 1)[0]
    say(capsys, f"cost per particle-step by size ({each}): cost grows with the size to the power {exponent:.3f}")
    say(capsys, f"largest resident memory, {sizes[-1]} particles: {peak_memory() / sizes[-1]:.0f} bytes a particle")


def test_memory(capsys):
    bird = swirling_bird(20_000)
    advance(bird, 2)
    say(capsys, f"arrays of the bird: {bytes_per_particle(bird):.0f} bytes a particle")


def test_two_threads_against_two_processes(capsys):
    together = rate_together(2, 1)
    threaded, alone = rate_together(1, 2), rate_together(1, 1)
    text = f"{threaded / alone:.2f} x one thread; two independent processes reach {together / alone:.2f} x together"
    say(capsys, f"two threads on one bird: {text}; per such process {2.0 * threaded / together:.2f} x")


def test_start_of_a_command(capsys):
    command = [sys.executable, "-m", "birdstrike", "check", "reference_strike"]
    seconds = quickest(lambda: subprocess.run(command, check=True, capture_output=True), 3)
    say(capsys, f"`birdstrike check` with compiled code cached: {seconds:.2f} s")


def test_roofline(capsys):
    bird = swirling_bird(4500)
    advance(bird, 5)
    limit = ceilings(bird)
    say(
        capsys,
        f"one thread: {1e-9 * limit['flops']:.1f} Gflop/s, {1e-9 * limit['stream']:.1f} GB/s streamed, "
        f"{1e-9 * limit['loads']:.2f} G indexed loads/s from the bird's rows",
    )
    rows = bird.list.rows
    head = (bird.n, bird.row, bird.mass, bird.h, bird.slope)
    kernels = {
        "rate_of_deformation": lambda: rate_of_deformation(*head, *rows, bird.drho_dt, bird.deformation),
        "pair_forces": lambda: pair_forces(*head, 641.0, bird.shock, *rows, bird.acceleration, bird.dissipation),
    }
    for name, run in kernels.items():
        pairs = bird.list.start[-1] / quickest(run, 30)
        bytes_moved = 8 * COLUMNS[name] + 4
        say(
            capsys,
            f"{name}: {1e9 / pairs:.2f} ns a listed pair ({FLOPS[name]} flops, {bytes_moved} bytes): "
            f"{FLOPS[name] * pairs / limit['flops']:.0%} of the flops, "
            f"{COLUMNS[name] * pairs / limit['loads']:.0%} of the indexed loads that this core can do",
        )
