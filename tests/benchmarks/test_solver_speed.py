"""Speed of the solver, as ratios within one run (`make bench`); figures are printed, nothing about time is asserted."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable

import numba
import numpy as np
import pytest
from scipy.spatial import KDTree

from birdstrike.solver.case.case import load_case
from birdstrike.solver.kernels.bird.sph import pair_forces
from birdstrike.solver.kernels.bird.velocity_gradient import rate_of_deformation
from birdstrike.solver.simulate import simulate
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

SIZES = ((1_000, 200), (10_000, 30), (100_000, 12), (1_000_000, 6))  # particles, steps
MILLION = os.environ.get("BIRDSTRIKE_BENCH_MILLION", "1") != "0"  # the largest takes a minute and 1 GB


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
    text = f"{1e6 * seconds:.2f} us per particle-step, {near - 1:.0f} neighbours, lists and energies included"
    say(capsys, f"bird alone, {bird.n} particles, one thread, float64: {text}")


def test_against_taichi(capsys):
    ti = pytest.importorskip("taichi", reason="the peer comes with the extra `bench`")
    ti.init(arch=ti.cpu, cpu_max_num_threads=1, default_fp=ti.f64, fast_math=True, log_level=ti.ERROR)
    from tests.benchmarks.peer_taichi import Wcsph

    def seconds(run: Callable[[], object]) -> float:
        start = time.process_time()
        for _ in range(40):
            run()
        return (time.process_time() - start) / (40 * bird.n)

    bird = swirling_bird(4500)
    peer = Wcsph(bird, 0.1 * bird.step_at_impact(45.55))
    peer.search()
    peer.step()
    exact = [len(row) for row in KDTree(bird.x).query_ball_point(bird.x, 2.0 * bird.h)]
    assert np.array_equal(peer.count.to_numpy(), np.array(exact) - 1), "the peer must sum over the same pairs"
    rounds = np.array([(seconds(peer.search), seconds(peer.step), cost(bird, 40)) for _ in range(5)])
    search, loops, ours = 1e6 * np.median(rounds, axis=0)
    say(
        capsys,
        f"plain WCSPH in taichi, same pairs, one thread, float64: {search + loops:.2f} us per particle-step with a "
        f"search at every step, {loops:.2f} us without any; ours {ours:.2f} us: {(search + loops) / ours:.1f} x and "
        f"{loops / ours:.1f} x (medians of 5 rounds in turn)",
    )
    assert np.isfinite(peer.x.to_numpy()).all()


def test_cost_grows_linearly(capsys):
    sizes, costs = [], []
    for particles, steps in SIZES if MILLION else SIZES[:-1]:
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
        pairs = bird.list.mean_length * bird.n / quickest(run, 30)
        bytes_moved = 8 * COLUMNS[name] + 4
        say(
            capsys,
            f"{name}: {1e9 / pairs:.2f} ns a listed pair ({FLOPS[name]} flops, {bytes_moved} bytes): "
            f"{FLOPS[name] * pairs / limit['flops']:.0%} of the flops, "
            f"{COLUMNS[name] * pairs / limit['loads']:.0%} of the indexed loads that this core can do",
        )
