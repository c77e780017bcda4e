"""Where a bird first touches, and how far it flies until then."""

from __future__ import annotations

import math

import numpy as np

from data.histories import Array
from solver.case_plate import Plate


def turned(points: Array, angle: float) -> Array:
    """Points (n, 3) of a bird, its axis along x, turned into the direction of flight (cos angle, 0, -sin angle)."""
    along = [math.cos(angle), 0.0, -math.sin(angle)]
    return points @ np.stack([along, [0.0, 1.0, 0.0], [math.sin(angle), 0.0, math.cos(angle)]])


def yawed(points: Array, yaw: float) -> Array:
    """Points (n, 3) of a bird, its axis along x, turned sideways by `yaw` [rad] about the bird's own z."""
    if not yaw:
        return points
    c, s = math.cos(yaw), math.sin(yaw)
    return points @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


def nose_meets(surface: Array, angle: float, height: float) -> float:
    """x [m] where the lowest of a turned bird's points (n, 3) meets the plane z = height [m]."""
    lowest = surface[:, 2].min()
    nose = surface[:, 0][np.isclose(surface[:, 2], lowest, atol=1e-9)].mean()
    return float(nose + (lowest - height) / math.tan(angle))


def flight_to_panel(x: Array, direction: Array, plate: Plate, surface: float) -> float:
    """Least distance [m] that a point at x (n, 3) flies along `direction` (3,) until it touches the plate.

    surface: distance from the mid-surface at which a point touches [m]. On a panel, each point's line is met with
    the cylinder of radius + surface about the panel's axis; lines that miss the panel do not count. For a flat plate,
    or if every line misses, the distance is that to the plane at the height of `surface`.
    """
    plane = float((x[:, 2].min() - surface) / -direction[2])
    if plate.radius is None:
        return plane
    along, height = x[:, 0], x[:, 2] + plate.radius
    half = along * direction[0] + height * direction[2]
    norm = direction[0] ** 2 + direction[2] ** 2
    under_root = half**2 - norm * (along**2 + height**2 - (plate.radius + surface) ** 2)
    flight = (-half - np.sqrt(np.where(under_root >= 0.0, under_root, np.nan))) / norm
    met = x + flight[:, None] * direction
    arc = plate.radius * np.arctan2(met[:, 0], met[:, 2] + plate.radius)
    on_panel = (np.abs(arc) <= 0.5 * plate.length) & (np.abs(met[:, 1]) <= 0.5 * plate.width)
    return float(flight[on_panel].min()) if on_panel.any() else plane
