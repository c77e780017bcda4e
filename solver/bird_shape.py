"""Volumes of the idealised birds; length is overall, along the axis of revolution."""

from __future__ import annotations

import math

SHAPES = ("hemispherical_cylinder", "cylinder", "ellipsoid", "sphere")


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
