"""Geometry of a strike: a lattice of particles in the bird's shape, and the plate's rectangular mesh."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from data.errors import UserError
from data.histories import Array
from solver.kernels.smoothing import slope, slope_constant

# Points of one cubic cell and the cell's edge over the spacing of a cubic lattice of equal density.
LATTICES = {
    "cubic": (np.array([[0.0, 0.0, 0.0]]), 1.0),
    "fcc": (np.array([[0.0, 0.0, 0.0], [0.0, 0.5, 0.5], [0.5, 0.0, 0.5], [0.5, 0.5, 0.0]]), 4.0 ** (1.0 / 3.0)),
}


def inside(points: Array, shape: str, diameter: float, length: float) -> NDArray[np.bool_]:
    """Which points (n, 3) lie in the bird, its axis along x and its centre at the origin [m]."""
    along, across = points[:, 0], np.hypot(points[:, 1], points[:, 2])
    radius = 0.5 * diameter
    if shape == "cylinder":
        return (np.abs(along) <= 0.5 * length) & (across <= radius)
    if shape == "ellipsoid":
        return (2.0 * along / length) ** 2 + (across / radius) ** 2 <= 1.0
    core = max(0.5 * length - radius, 0.0) if shape == "hemispherical_cylinder" else 0.0
    return np.hypot(np.maximum(np.abs(along) - core, 0.0), across) <= radius


def lattice(spacing: float, kind: str, half: Array) -> Array:
    """Points of a lattice centred on a point of it, within the box -half .. half [m]; one point per spacing^3."""
    cell, ratio = LATTICES[kind]
    edge = ratio * spacing
    reach = [np.arange(-math.ceil(h / edge) - 1, math.ceil(h / edge) + 2) for h in half]
    corners = np.stack(np.meshgrid(*reach, indexing="ij"), axis=-1).reshape(-1, 1, 3)
    points = ((corners + cell) * edge).reshape(-1, 3)
    points = points[np.all(np.abs(points) <= half + 0.5 * edge, axis=1)]
    return points[np.lexsort(np.round(points / edge, 6).T)]


def slope_gain(kind: str, smoothing: float) -> float:
    """Factor on the kernel's slope that makes the sum of V x grad W over the undistorted lattice exactly -1.

    Without it, a lattice sum of the kernel at h = 1.2 spacings sees compressions 1.9 % (FCC) too small, and so does
    the sound speed. One factor for all pairs keeps every conservation law. smoothing: h over spacing.
    """
    reach = 2.0 * smoothing
    points = lattice(1.0, kind, np.full(3, reach))
    distance = np.linalg.norm(points, axis=1)
    pull = np.array([slope(float(r) / smoothing, slope_constant(smoothing)) for r in distance])
    return float(-3.0 / (pull * distance**2).sum())


def fill_bird(shape: str, diameter: float, length: float, volume: float, particles: int, kind: str) -> Array:
    """Particle positions (n, 3) [m] about the bird's centre, axis along x; n as near `particles` as a lattice allows.

    Lattices cut at spacings within 2 % of (volume/particles)^(1/3) are tried, and the nearest count wins; the points
    are then scaled (by as much) so that each particle has exactly its share volume/n of the lattice, because the SPH
    sums are normalised by it. Raises UserError when not even 8 particles fit.
    """
    half = 0.5 * np.array([length if shape != "sphere" else diameter, diameter, diameter])
    nominal = (volume / particles) ** (1.0 / 3.0)
    best, cut_at = np.empty((0, 3)), nominal
    for factor in np.linspace(0.98, 1.02, 81):
        points = lattice(factor * nominal, kind, half)
        points = points[inside(points, shape, diameter, length)]
        if abs(len(points) - particles) < abs(len(best) - particles):
            best, cut_at = points, factor * nominal
    if len(best) < 8:
        raise UserError(
            f"bird.particles = {particles} leaves {len(best)} particles in the bird; at least 100 are needed"
        )
    return best * ((volume / len(best)) ** (1.0 / 3.0) / cut_at)


def jittered(points: Array, reach: float, seed: int) -> Array:
    """Points (n, 3) each shifted by up to `reach` [m] along every axis, drawn from `seed`; their mean stays."""
    if reach == 0.0:
        return points
    shift = np.random.default_rng(seed).uniform(-reach, reach, points.shape)
    return points + shift - shift.mean(axis=0)


def place_bird(points: Array, angle: float, start: float, aim: str, surface: float) -> Array:
    """Bird with its axis along the velocity, `start` [m] of flight before the first particle touches.

    The plate's mid-surface is z = 0; the bird comes from z > 0 and flies along (cos angle, 0, -sin angle). `surface`
    is the height at which a particle touches [m]. aim "axis": the axis meets the plate's centre; "first_touch": the
    nose touches above the centre.
    """
    direction = np.array([math.cos(angle), 0.0, -math.sin(angle)])
    across = np.array([math.sin(angle), 0.0, math.cos(angle)])
    turned = points @ np.stack([direction, [0.0, 1.0, 0.0], across])
    flight = (turned[:, 2].min() - surface) / math.sin(angle)
    if aim == "first_touch":
        nose = turned[:, 0][np.isclose(turned[:, 2], turned[:, 2].min(), atol=1e-9)].mean()
        turned = turned - np.array([nose + flight * direction[0], 0.0, 0.0])
    return turned + (flight - start) * direction


@dataclass(frozen=True)
class PlateMesh:
    """Nodes and quadrilaterals of a shell: nodes (m, 3) [m], quads (e, 4), across (e, 4): see `contact`."""

    nodes: Array
    quads: NDArray[np.int64]
    across: NDArray[np.int64]
    rim: NDArray[np.int64]


def plate_mesh(length: float, width: float, elements: tuple[int, int]) -> PlateMesh:
    """Flat rectangular mesh in z = 0, centred at the origin; the impact side is z > 0."""
    nx, ny = elements
    x, y = np.linspace(-0.5 * length, 0.5 * length, nx + 1), np.linspace(-0.5 * width, 0.5 * width, ny + 1)
    grid = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    nodes = np.column_stack([grid, np.zeros(len(grid))])
    i, j = (a.ravel() for a in np.meshgrid(np.arange(nx), np.arange(ny), indexing="ij"))
    corner = i * (ny + 1) + j
    quads = np.column_stack([corner, corner + ny + 1, corner + ny + 2, corner + 1]).astype(np.int64)
    return shell_mesh(nodes, quads)


def shell_mesh(nodes: Array, quads: NDArray[np.int64]) -> PlateMesh:
    """Any mesh of quadrilaterals with its facet neighbours and the nodes of its rim."""
    sides = np.stack([quads[:, [3, 0]], quads[:, [1, 2]], quads[:, [0, 1]], quads[:, [2, 3]]], axis=1)
    flat = np.sort(sides.reshape(-1, 2), axis=1)
    _, label, count = np.unique(flat, axis=0, return_inverse=True, return_counts=True)
    order = np.argsort(label.ravel(), kind="stable")
    across = np.full(len(flat), -1, dtype=np.int64)
    first = np.concatenate([[0], np.cumsum(count)[:-1]])[count == 2]
    one, other = order[first], order[first + 1]
    across[one], across[other] = other // 4, one // 4
    rim = np.unique(flat[count[label.ravel()] == 1])
    return PlateMesh(nodes, quads, across.reshape(-1, 4), rim.astype(np.int64))
