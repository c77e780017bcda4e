"""Smooth viscous flow: decaying shear waves on a lattice, in two directions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.reports.verification.columns import SEED, SMOOTHING, advance, images_of
from birdstrike.reports.verification.draw import Curve, Panel, draw, slope_line
from birdstrike.reports.verification.problem import Outcome, Picture, Problem, Strikes
from birdstrike.reports.verification.rows import matches, near
from birdstrike.solver.bird.shape import slope_gain
from birdstrike.solver.bird.sph import Bird

SPACING, MU = 5e-3, 641.0
CELLS = (8, 16, 32)
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
    """Viscosity [Pa s] told from the decay of a shear wave of one box length, over a third of its life."""
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


def solve(_: Strikes) -> Outcome:
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
    return Outcome(tuple(rows), (Picture(figure, draw(panel), caption),))


PROBLEMS = (Problem("shear_wave", "SPH", "", solve),)
