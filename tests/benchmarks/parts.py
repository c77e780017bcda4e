"""What the benchmarks run: a bird alone, its arrays, the machine's own limits, and independent processes."""

from __future__ import annotations

import multiprocessing
import resource
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor

import numba
import numpy as np
from numba import njit

from birdstrike.solver.bird.eos.grueneisen import grueneisen
from birdstrike.solver.bird.materials.fluid import Fluid
from birdstrike.solver.bird.shape import fill_bird, slope_gain
from birdstrike.solver.bird.sph import Bird

MATERIAL = Fluid(grueneisen(900.0, 1670.0, 2.48), -0.37e6, 641.0)
# Flops and bytes of one pair, counted in its kernels: a square root or a division counts as one flop.
FLOPS = {"rate_of_deformation": 12 + 5 + 6 + 1 + 6 + 30, "pair_forces": 12 + 5 + 6 + 1 + 4 + 30 + 10 + 12 + 6 + 11}
COLUMNS = {
    "rate_of_deformation": 8,
    "pair_forces": 16,
}  # of the neighbour's row, 8 bytes each; 4 for its number


def swirling_bird(particles: int) -> Bird:
    """A bird of the reference's proportions that turns and is squeezed: neighbours change, nothing bursts."""
    length, diameter = 0.262, 0.106
    volume = np.pi * (0.5 * diameter) ** 2 * (length - diameter / 3.0)
    x, _ = fill_bird("hemispherical_cylinder", diameter, length, volume, particles, "fcc")
    spacing = (volume / len(x)) ** (1.0 / 3.0)
    v = x @ np.array([[-60.0, 0.0, 200.0], [0.0, 60.0, 0.0], [-400.0, 0.0, 0.0]]).T
    gain = slope_gain("fcc", 1.2)
    return Bird(x, v, MATERIAL.rho0 * spacing**3, 1.2 * spacing, MATERIAL, (1.0, 2.0), gain=gain)


def advance(bird: Bird, steps: int) -> None:
    """So many steps of the bird alone, neighbour lists and energies included."""
    dt = 0.9 * bird.step_at_impact(45.55)
    for _ in range(steps):
        bird.update_density(dt)
        bird.update_forces(dt)
        bird.update_energies(dt)
        bird.kick_and_drift(dt, dt)


def cost(bird: Bird, steps: int) -> float:
    """CPU seconds of one thread per particle-step, after three steps to warm up."""
    advance(bird, 3)
    start = time.process_time()
    advance(bird, steps)
    return (time.process_time() - start) / (steps * bird.n)


def quickest(run: Callable[[], object], repeats: int = 5) -> float:
    """Least wall seconds of several runs."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    return min(times)


def rate_of_runs(threads: int, particles: int, seconds: float) -> float:
    """Steps per second of wall that a process of so many threads makes of its own bird."""
    numba.set_num_threads(threads)
    bird = swirling_bird(particles)
    advance(bird, 5)
    start, steps = time.perf_counter(), 0
    while time.perf_counter() - start < seconds:
        advance(bird, 5)
        steps += 5
    return steps / (time.perf_counter() - start)


def rate_together(processes: int, threads: int, particles: int = 4500, seconds: float = 3.0) -> float:
    """Steps per second of several such processes at once, summed."""
    with ProcessPoolExecutor(processes, multiprocessing.get_context("spawn")) as pool:
        return sum(pool.map(rate_of_runs, *zip(*[(threads, particles, seconds)] * processes, strict=True)))


def bytes_per_particle(bird: Bird) -> float:
    """Of all arrays that the bird and its neighbour list hold."""
    held = [*vars(bird).values(), *vars(bird.list).values()]
    arrays = [value for value in held if isinstance(value, np.ndarray)]
    owners = [value if value.base is None else value.base for value in arrays]  # a view takes nothing
    return sum({id(owner): owner.nbytes for owner in owners}.values()) / bird.n


def peak_memory() -> float:
    """Largest resident memory of this process so far [bytes]."""
    return 1024.0 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


@njit(fastmath=True)
def multiply_add(rounds):
    """rounds x 64 independent multiply-adds on doubles: the machine's floating-point ceiling."""
    a = np.ones(64)
    for _ in range(rounds):
        for i in range(64):
            a[i] = a[i] * 0.999999 + 1e-6
    return a.sum()


@njit(fastmath=True)
def triad(a, b, c):
    """a = b + 3 c: the machine's memory ceiling, 24 bytes an entry."""
    for i in range(a.shape[0]):
        a[i] = b[i] + 3.0 * c[i]


@njit(fastmath=True)
def gather(table, index):
    """Sum of table rows' first 8 columns over a list of row numbers: the ceiling of indexed loads, 64 bytes each."""
    s0 = s1 = s2 = s3 = s4 = s5 = s6 = s7 = 0.0
    for m in range(index.shape[0]):
        b = index[m]
        s0 += table[b, 0]
        s1 += table[b, 1]
        s2 += table[b, 2]
        s3 += table[b, 3]
        s4 += table[b, 4]
        s5 += table[b, 5]
        s6 += table[b, 6]
        s7 += table[b, 7]
    return s0 + s1 + s2 + s3 + s4 + s5 + s6 + s7


def ceilings(bird: Bird) -> dict[str, float]:
    """Measured limits of one thread: flop/s, bytes/s of streaming, and indexed loads of doubles per second."""
    rounds = 200_000
    multiply_add(1)
    flops = 2.0 * 64 * rounds / quickest(lambda: multiply_add(rounds))
    a, b, c = (np.zeros(8_000_000) for _ in range(3))
    triad(a, b, c)
    stream = 24.0 * len(a) / quickest(lambda: triad(a, b, c))
    listed = bird.list.neighbour[: bird.list.start[-1]]
    gather(bird.row, listed)
    loads = 8.0 * len(listed) / quickest(lambda: gather(bird.row, listed))
    return {"flops": flops, "stream": stream, "loads": loads}
