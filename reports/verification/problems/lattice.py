"""SPH on a lattice: moments of the kernel, speed of sound, and decay of shear waves in two directions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.integrate import quad

from birdstrike.data.histories import Array
from birdstrike.reports.verification.columns import SEED, SMOOTHING, advance, images_of, periodic_bird
from birdstrike.reports.verification.draw import Curve, Panel, draw, slope_line
from birdstrike.reports.verification.problem import Computed, Picture, Problem, Row, Solution, below, matches, near
from birdstrike.solver.bird.shape import lattice, slope_gain
from birdstrike.solver.bird.sph import Bird
from birdstrike.solver.kernels.bird.smoothing import slope, slope_constant, wendland

DEFINITION = "definition of a smoothing kernel"
SPACING = 5e-3
CELLS = (8, 16, 32)
ORDER = 0.3  # how far an observed order may be from 2


def kernel_moments(_: Computed) -> Solution:
    """Integral of W in the continuum; sums of V W and of -V r grad W on the lattices at h = 1.2 spacings."""
    volume, _error = quad(lambda q: 4.0 * np.pi * q**2 * wendland(q, 1.0), 0.0, 2.0)
    rows = [near("integral of W", float(volume), 1.0, "", 1e-10, DEFINITION)]
    for kind in ("fcc", "cubic"):
        points = lattice(1.0, kind, np.full(3, 4.0))
        r = np.linalg.norm(points, axis=1)
        weights = np.array([wendland(d / SMOOTHING, SMOOTHING) for d in r])
        slopes = np.array([slope(d / SMOOTHING, slope_constant(SMOOTHING)) for d in r])
        second = -slope_gain(kind, SMOOTHING) * np.einsum("a,ai,aj->ij", slopes, points, points)
        sources = (DEFINITION, "sum over the lattice, h = 1.2 spacings")
        rows.append(matches(f"sum of V W, {kind}", float(weights.sum()), 1.0, "", 2.5, *sources))
        rows.append(below(f"sum of V W r, {kind}", float(np.abs(weights @ points).max()), 1e-12, "", *sources))
        off = float(np.abs(second - np.eye(3)).max())
        rows.append(below(f"-sum of V r grad W - 1, {kind}", off, 1e-12, "", DEFINITION, "gradient with its gain"))
    return Solution(tuple(rows))


def sound_speed(cells: int) -> float:
    """Of a standing wave of one box length [m/s], from its quarter period."""
    unbroken = replace(SEED, pressure_cutoff=-1e9)
    bird, box = periodic_bird((cells, 3, 3), SPACING, (0, 1, 2), unbroken, (0.0, 0.0))
    k = 2.0 * np.pi / box[0]
    shape = np.sin(k * bird.x[: bird.n, 0])
    bird.v[: bird.n, 0] = 0.05 * shape
    bird.refresh_images()
    dt = 0.4 * bird.stable_step(SEED.eos.sound_speed)
    amplitude: list[float] = []
    while not amplitude or amplitude[-1] > 0.0:
        advance(bird, dt, first=not amplitude)
        amplitude.append(float(shape @ bird.v[: bird.n, 0]))
    a, b = amplitude[-2:]
    return 0.5 * np.pi / (k * (len(amplitude) - 1.5 + a / (a - b)) * dt)


def convergence(
    name: str, measure: Callable[[int], float], truth: float, unit: str, ceiling: float, source: str
) -> Solution:
    """Value at the finest lattice and order of convergence between the last two, per cells along the wave."""
    values = [measure(cells) for cells in CELLS]
    errors = [abs(value / truth - 1.0) for value in values]
    order = float(np.log2(errors[-2] / errors[-1]))
    figure = name.replace(" ", "_")
    rows: tuple[Row, ...] = (
        matches(f"{name}, {CELLS[-1]} cells a wave", values[-1], truth, unit, ceiling, source, "", figure),
        near(f"order of convergence of the {name}", order, 2.0, "", ORDER, "second-order scheme", "", figure),
    )
    panel = Panel(
        "lattice cells a wavelength",
        f"error of the {name} [%]",
        (
            slope_line(CELLS, 100.0 * errors[0], -2.0),
            Curve("birdstrike", CELLS, [100.0 * error for error in errors]),
        ),
        log=True,
    )
    off = ", ".join(f"{100.0 * error:.2g} %" for error in errors)
    caption = (
        f"The {name} against {truth:g} {unit} with {CELLS} FCC cells a wavelength: off by {off}; order {order:.2f}."
    )
    return Solution(rows, (Picture(figure, draw(panel), caption),))


def solve_sound(_: Computed) -> Solution:
    """Quarter period of a standing wave."""
    return convergence("sound speed", sound_speed, SEED.eos.sound_speed, "m/s", 0.5, "c = C of the equation of state")


ABOUT = (
    "Moments of the kernel, and waves on a periodic lattice (no edges, so that only the scheme's own error is seen)."
)
SOUND_PROBLEMS = (
    Problem("kernel_moments", "SPH", ABOUT, kernel_moments),
    Problem("sound_wave", "SPH", "", solve_sound),
)


MU = 641.0  # Pa s
AXES = {  # FCC cells in units of the cubic cell's edge: edges, points
    "100": ((1.0, 1.0, 1.0), ((0.0, 0.0, 0.0), (0.0, 0.5, 0.5), (0.5, 0.0, 0.5), (0.5, 0.5, 0.0))),
    "110": ((0.5**0.5, 0.5**0.5, 1.0), ((0.0, 0.0, 0.0), (0.5, 0.5, 0.5))),
}
THEORY = "v = sin(kx) exp(-MU k² t/rho)"


def periodic_block(axis: str, cells: int) -> tuple[Bird, Array]:
    """A resting viscous block that repeats in all directions, the wave's axis along x, and its box [m]."""
    edges, cell = AXES[axis]
    size = 4.0 ** (1.0 / 3.0) * SPACING * np.array(edges)
    counts = (cells, *(int(np.ceil(3.4 * SPACING / edge)) for edge in size[1:]))
    corners = np.stack(np.meshgrid(*map(np.arange, counts), indexing="ij"), axis=-1).reshape(-1, 1, 3)
    x, box = ((corners + np.array(cell) + 0.25) * size).reshape(-1, 3), size * np.array(counts)
    h = SMOOTHING * SPACING
    material, gain = replace(SEED, viscosity=MU), slope_gain("fcc", SMOOTHING)
    images = images_of(x, box, (0, 1, 2), 2.6 * h)
    return Bird(x, np.zeros_like(x), SEED.rho0 * SPACING**3, h, material, (1.0, 2.0), images, gain), box


def decaying_wave(axis: str, cells: int) -> float:
    """Viscosity [Pa s] from the decay of a shear wave of one box length, over a third of its life."""
    bird, box = periodic_block(axis, cells)
    k = 2.0 * np.pi / box[0]
    wave = np.sin(k * bird.x[: bird.n, 0])
    bird.v[: bird.n, 1] = 0.5 * wave
    bird.refresh_images()
    life = SEED.rho0 / (MU * k**2)
    steps = int(np.ceil(0.3 * life / min(0.8 * bird.stable_step(SEED.eos.sound_speed), life / 200.0)))
    dt = 0.3 * life / steps
    start = float(wave @ bird.v[: bird.n, 1])
    for step in range(steps):
        advance(bird, dt, first=step == 0)
    return -np.log(float(wave @ bird.v[: bird.n, 1]) / start) / ((steps - 0.5) * dt) * SEED.rho0 / k**2


def solve_shear(_: Computed) -> Solution:
    """Second order towards MU, in both directions."""
    found = {axis: [decaying_wave(axis, cells) for cells in CELLS] for axis in AXES}
    errors = {axis: [abs(value / MU - 1.0) for value in values] for axis, values in found.items()}
    figure, rows = "shear_wave", []
    for axis in AXES:
        order = float(np.log2(errors[axis][-2] / errors[axis][-1]))
        name = f"shear wave along <{axis}>, {CELLS[-1]} cells a wave"
        rows.append(matches(name, found[axis][-1], MU, "Pa s", 1.5, THEORY, "", figure))
        rows.append(
            near(f"order of convergence to MU, <{axis}>", order, 2.0, "", 0.3, "second-order scheme", "", figure)
        )
    curves = [Curve(f"along <{axis}>", CELLS, [100.0 * error for error in errors[axis]]) for axis in AXES]
    panel = Panel(
        "cells a wavelength", "off MU [%]", (slope_line(CELLS, 0.7 * curves[0].y[0], -2.0), *curves), log=True
    )
    off = ", ".join(f"{100.0 * (found[axis][-1] / MU - 1.0):+.2f} % along <{axis}>" for axis in AXES)
    caption = (
        f"Decay of a shear wave on a periodic FCC lattice, MU {MU:g} Pa s: {off} at {CELLS[-1]} cells a wavelength. "
        "The viscous stress takes its strain from the corrected gradient: no direction of the lattice is preferred."
    )
    return Solution(tuple(rows), (Picture(figure, draw(panel), caption),))


PROBLEMS = (*SOUND_PROBLEMS, Problem("shear_wave", "SPH", "", solve_shear))
