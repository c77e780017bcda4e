"""Geometry of the bird: a lattice of particles fitted to its shape."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from data.errors import UserError
from data.histories import Array
from solver.bird_shape import second_moments
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


def fill_bird(
    shape: str, diameter: float, length: float, volume: float, particles: int, kind: str
) -> tuple[Array, float]:
    """Particle positions (n, 3) [m] about the bird's centre, axis along x, and the lattice's spacing [m].

    Lattices cut at spacings within 2 % of (volume/particles)^(1/3) are tried, and the nearest count wins. Where the
    cut falls is an accident that moves the bird's ends by up to half a layer, so the lattice is then stretched, along
    and across, until the particles, each a cube of its share of the volume, have the shape's second moments.
    Raises UserError when not even 8 particles fit.
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
    own = (volume / len(best)) ** (2.0 / 3.0) / 12.0
    along, across = (moment - own for moment in second_moments(shape, diameter, length))
    found = np.mean(best**2, axis=0)
    stretch = np.sqrt([along / found[0], *2 * [2.0 * across / (found[1] + found[2])]])
    return best * stretch, cut_at * float(np.prod(stretch)) ** (1.0 / 3.0)


def jittered(points: Array, reach: float, seed: int) -> Array:
    """Points (n, 3) each shifted by up to `reach` [m] along every axis, drawn from `seed`; their mean stays."""
    if reach == 0.0:
        return points
    shift = np.random.default_rng(seed).uniform(-reach, reach, points.shape)
    return points + shift - shift.mean(axis=0)
