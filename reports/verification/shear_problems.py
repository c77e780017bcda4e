"""Smooth viscous flow: decaying shear waves on a lattice, in the two directions that span its anisotropy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from data.histories import Array
from reports.verification.columns import SEED, SMOOTHING, advance, images_of
from reports.verification.draw import Curve, Panel, draw, slope_line
from reports.verification.problem import Outcome, Picture, Problem, Strikes
from reports.verification.rows import matches, near
from solver.bird import Bird
from solver.geometry import lattice, slope_gain
from solver.kernels.smoothing import slope, slope_constant

SPACING, MU = 5e-3, 641.0
CELLS = (8, 16, 32)
AXES = {  # FCC cells in units of the cubic cell's edge: edges, points, share of the direction in the isotropic mean
    "100": ((1.0, 1.0, 1.0), ((0.0, 0.0, 0.0), (0.0, 0.5, 0.5), (0.5, 0.0, 0.5), (0.5, 0.5, 0.0)), 0.6),
    "110": ((0.5**0.5, 0.5**0.5, 1.0), ((0.0, 0.0, 0.0), (0.5, 0.5, 0.5)), 0.4),
}
THEORY = "v = sin(kx) exp(-MU k² t/rho)"


def lattice_viscosity(axis: str) -> float:
    """What the pair sum makes of MU for long waves along `axis`, in units of MU.

    Shear along <100> feels the sum S of V F x^2 y^2/r^2 over the neighbours, along <110> half of that of
    V F (x^4 - x^2 y^2)/r^2; both are -1/5 where the lattice is isotropic, and their 3:2 mean is so on every cubic one.
    """
    points = lattice(1.0, "fcc", np.full(3, 2.0 * SMOOTHING + 1.0))
    r = np.linalg.norm(points, axis=1)
    points, r = points[r > 0.0], r[r > 0.0]
    pull = slope_gain("fcc", SMOOTHING) * np.array([slope(d / SMOOTHING, slope_constant(SMOOTHING)) for d in r])
    x, y = (points[:, 0] ** 2, points[:, 1] ** 2) / r
    along, across = float((pull * x * x).sum()), float((pull * x * y).sum())
    return -5.0 * across if axis == "100" else -2.5 * (along - across)


def periodic_block(axis: str, cells: int) -> tuple[Bird, Array]:
    """A resting viscous block that repeats in all directions, the wave's axis along x, and its box [m]."""
    edges, cell, _ = AXES[axis]
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
    """Converges at second order to the lattice's own viscosity, whose mean over directions is MU."""
    found = {axis: [decaying_wave(axis, cells) for cells in CELLS] for axis in AXES}
    limit = {axis: MU * lattice_viscosity(axis) for axis in AXES}
    errors = {axis: [abs(value / limit[axis] - 1.0) for value in values] for axis, values in found.items()}
    mean = sum(share * found[axis][-1] for axis, (_, _, share) in AXES.items())
    figure = "shear_wave"
    rows = [matches(f"mean viscosity, {CELLS[-1]} cells a wave", mean, MU, "Pa s", 0.5, THEORY, "", figure)]
    for axis in AXES:
        order = float(np.log2(errors[axis][-2] / errors[axis][-1]))
        name = f"order of convergence to the lattice's viscosity, <{axis}>"
        rows.append(near(name, order, 2.0, "", 0.3, "second-order scheme", "", figure))
        rows.append(matches(f"shear wave along <{axis}>", found[axis][-1], MU, "Pa s", None, THEORY, "", figure))
    curves = [Curve(f"along <{axis}>", CELLS, [100.0 * error for error in errors[axis]]) for axis in AXES]
    panel = Panel(
        "cells a wavelength",
        "off the lattice's viscosity [%]",
        (slope_line(CELLS, curves[0].y[0], -2.0), *curves),
        log=True,
    )
    strays = ", ".join(f"{100.0 * (limit[axis] / MU - 1.0):+.1f} % along <{axis}>" for axis in AXES)
    caption = (
        f"Decay of a shear wave on a periodic FCC lattice. The central pair forces that carry MU see the lattice's "
        f"fourth "
        f"moments, so an undistorted lattice is anisotropic ({strays}) at any resolution; the mean over directions is "
        f"{mean:.1f} Pa s of {MU:g}. A struck bird's particles do not stay on their lattice."
    )
    return Outcome(tuple(rows), (Picture(figure, draw(panel), caption),))


PROBLEMS = (Problem("shear_wave", "SPH", "", solve),)
