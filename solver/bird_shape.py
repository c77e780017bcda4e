"""Volumes, second moments and outlines of the idealised birds; length is overall, along the axis of revolution."""

from __future__ import annotations

import math

import numpy as np

from data.histories import Array

SHAPES = ("hemispherical_cylinder", "cylinder", "ellipsoid", "sphere")
Size = tuple[float, float]
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


def outline(shape: str, diameter: float, length: float) -> Array:
    """Points (n, 3) [m] on the surface of the bird about its centre, axis along x, in rings with one point at y = 0."""
    radius = 0.5 * diameter
    half = radius if shape == "sphere" else 0.5 * length
    core = {"hemispherical_cylinder": half - radius, "cylinder": half}.get(shape, 0.0)
    turn = np.linspace(0.0, 0.5 * math.pi, ALONG)
    along = core + (half - core) * np.sin(turn)
    across = np.full(ALONG, radius) if shape == "cylinder" else radius * np.cos(turn)
    along, across = np.concatenate([-along[::-1], along]), np.concatenate([across[::-1], across])
    around = np.linspace(0.0, 2.0 * math.pi, AROUND, endpoint=False)
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
