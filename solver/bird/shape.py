"""Geometry of the bird: a lattice of particles fitted to its shape."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.errors import UserError
from birdstrike.data.histories import Array
from birdstrike.solver.kernels.bird.smoothing import slope, slope_constant

SHAPES = ("hemispherical_cylinder", "cylinder", "ellipsoid", "sphere")
Size = tuple[float, float]
ACROSS = 3.0
"""Particles across the smaller of diameter and length that an error about a single row of them asks for."""
ALONG, AROUND = 257, 64  # of the outline's points: from the middle to an end, and in a ring


def volume(shape: str, diameter: float, length: float) -> float:
    """Volume [m^3] of a bird of `diameter` and overall `length` [m]; a sphere's length is its diameter."""
    disc = 0.25 * math.pi * diameter**2
    ball = math.pi * diameter**3 / 6.0
    if shape == "hemispherical_cylinder":
        return disc * (length - diameter) + ball
    if shape == "cylinder":
        return disc * length
    if shape == "ellipsoid":
        return disc * length * 2.0 / 3.0
    if shape == "sphere":
        return ball
    raise ValueError(f"no such shape: {shape}")


def second_moments(shape: str, diameter: float, length: float) -> tuple[float, float]:
    """Means over the volume of the squared distance [m^2] from the centre: along the axis, and along any normal to it.

    Exact integrals. A hemisphere's centre lies 3/8 of its radius beyond its plane.
    """
    radius = 0.5 * diameter
    if shape == "cylinder":
        return length**2 / 12.0, radius**2 / 4.0
    if shape != "hemispherical_cylinder":
        half = 0.5 * length if shape == "ellipsoid" else radius
        return half**2 / 5.0, radius**2 / 5.0
    core = length - diameter
    ends = math.pi * diameter**3 / 6.0 / volume(shape, diameter, length)
    beyond = core**2 / 4.0 + 0.375 * core * radius + radius**2 / 5.0
    along = (1.0 - ends) * core**2 / 12.0 + ends * beyond
    return along, (1.0 - ends) * radius**2 / 4.0 + ends * radius**2 / 5.0


def outline(shape: str, diameter: float, length: float, roll: float = 0.0) -> Array:
    """Points (n, 3) [m] on the surface of the bird about its centre, axis along x.

    They lie in rings, of which each has points at the angles `roll` and `roll` + pi [rad] from z towards y.
    """
    radius = 0.5 * diameter
    half = radius if shape == "sphere" else 0.5 * length
    core = {"hemispherical_cylinder": half - radius, "cylinder": half}.get(shape, 0.0)
    turn = np.linspace(0.0, 0.5 * math.pi, ALONG)
    along = core + (half - core) * np.sin(turn)
    across = np.full(ALONG, radius) if shape == "cylinder" else radius * np.cos(turn)
    along, across = np.concatenate([-along[::-1], along]), np.concatenate([across[::-1], across])
    around = np.linspace(0.0, 2.0 * math.pi, AROUND, endpoint=False) + roll
    rings = across[:, None, None] * np.stack([np.sin(around), np.cos(around)], axis=1)
    return np.column_stack([np.repeat(along, AROUND), rings.reshape(-1, 2)])


def size_of_mass(shape: str, volume_wanted: float, slenderness: float | None, diameter: float | None) -> Size:
    """Diameter and overall length [m] of a volume [m^3], from the length over the diameter or from the diameter."""
    if slenderness is not None:
        wide = (volume_wanted / volume(shape, 1.0, slenderness)) ** (1.0 / 3.0)
        return wide, slenderness * wide
    if diameter is None:
        raise ValueError("neither slenderness nor diameter")
    per_length = volume(shape, diameter, 2.0 * diameter) - volume(shape, diameter, diameter)
    none = volume(shape, diameter, diameter) - per_length
    return diameter, diameter * (volume_wanted - none) / per_length


def statistical_density(mass: float) -> float:
    """Density [kg/m^3] of a bird of this mass [kg]: (1.148 - 0.063 log10(1000 m)) 1000, a fit over species."""
    return 1000.0 * (1.148 - 0.063 * math.log10(1000.0 * mass))


def statistical_diameter(mass: float) -> float:
    """Diameter [m] of a bird's body of this mass [kg]: log10 D = -1.095 + 0.335 log10 m, a fit over species."""
    return 10.0 ** (-1.095 + 0.335 * math.log10(mass))


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
    return in_order(unsorted_lattice(spacing, kind, half), spacing, kind)


def in_order(points: Array, spacing: float, kind: str) -> Array:
    """Points of a lattice layer by layer, along z, then y, then x."""
    return points[np.lexsort(np.round(points / (LATTICES[kind][1] * spacing), 6).T)]


def unsorted_lattice(spacing: float, kind: str, half: Array) -> Array:
    """The same as `lattice`, in order of its cells."""
    cell, ratio = LATTICES[kind]
    edge = ratio * spacing
    reach = [np.arange(-math.ceil(h / edge) - 1, math.ceil(h / edge) + 2) for h in half]
    corners = np.stack(np.meshgrid(*reach, indexing="ij"), axis=-1).reshape(-1, 1, 3)
    points = ((corners + cell) * edge).reshape(-1, 3)
    return points[np.all(np.abs(points) <= half + 0.5 * edge, axis=1)]


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
    Raises UserError when not even 8 particles fit, or when they lie in one row or one layer.
    """
    half = 0.5 * np.array([length if shape != "sphere" else diameter, diameter, diameter])
    nominal = (volume / particles) ** (1.0 / 3.0)
    best, cut_at = np.empty((0, 3)), nominal
    for factor in np.linspace(0.98, 1.02, 81):
        points = unsorted_lattice(factor * nominal, kind, half)
        points = points[inside(points, shape, diameter, length)]
        if abs(len(points) - particles) < abs(len(best) - particles):
            best, cut_at = points, factor * nominal
    if len(best) < 8:
        raise UserError(
            f"bird.particles = {particles} leaves {len(best)} particles in the bird; at least 100 are needed"
        )
    best = in_order(best, cut_at, kind)
    own = (volume / len(best)) ** (2.0 / 3.0) / 12.0
    along, across = (moment - own for moment in second_moments(shape, diameter, length))
    found = np.mean(best**2, axis=0)
    if min(along, across, found[0], found[1] + found[2]) <= 0.0:
        enough = math.ceil(volume / (min(length, diameter) / ACROSS) ** 3)
        raise UserError(
            f"bird.particles = {particles} makes a single row of particles in a bird of {1e3 * diameter:.4g} mm in "
            f"diameter and {1e3 * length:.4g} mm in length; set bird.particles to {enough} or more"
        )
    stretch = np.sqrt([along / found[0], *2 * [2.0 * across / (found[1] + found[2])]])
    return best * stretch, cut_at * float(np.prod(stretch)) ** (1.0 / 3.0)


def jittered(points: Array, reach: float, seed: int) -> Array:
    """Points (n, 3) each shifted by up to `reach` [m] along every axis, drawn from `seed`; their mean stays."""
    if reach == 0.0:
        return points
    shift = np.random.default_rng(seed).uniform(-reach, reach, points.shape)
    return points + shift - shift.mean(axis=0)
