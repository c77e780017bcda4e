"""Volumes of the idealised birds; length is overall, along the axis of revolution."""

from __future__ import annotations

import math

SHAPES = ("hemispherical_cylinder", "cylinder", "ellipsoid", "sphere")
Size = tuple[float, float]


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
