"""How many cells a hexahedral mesh of a bird has, and where: totals near the wanted number, cells near cubes."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Counts:
    """Cells: `across` the core's section, `layers` around it, `along` the core (or the straight part) in x."""

    across: int
    layers: int
    along: int

    @property
    def section(self) -> int:
        """Cells of a cross-section."""
        return self.across**2 + 4 * self.across * self.layers

    @property
    def cap(self) -> int:
        """Cells that close both ends of a wrapped core."""
        return 2 * self.across**2 * self.layers


def choose_counts(shape: str, diameter: float, length: float, elements: int) -> Counts:
    """Counts whose total is near `elements`, of cells near to cubes."""
    straight = {"cylinder": length, "hemispherical_cylinder": length - diameter}.get(shape, 0.0)
    best, least = Counts(2, 1, 2), math.inf
    for across in range(2, int(elements ** (1.0 / 3.0)) + 4, 2):
        for layers in range(max(1, across // 3), max(1, across // 2) + 1):
            size = diameter / (across + 2 * layers)
            for along in _lengths(shape, across, size, straight, length / diameter):
                counts = Counts(across, layers, along)
                cost = 4.0 * abs(math.log(_total(shape, counts) / elements)) + _slenderness(
                    shape, counts, size, straight, length
                )
                if cost < least:
                    best, least = counts, cost
    return best


def _lengths(shape: str, across: int, size: float, straight: float, ratio: float) -> range:
    """Numbers of cells along x worth trying."""
    if shape == "sphere":
        return range(across, across + 1)
    if shape == "ellipsoid":
        most = max(2, round(across * ratio))
        return range(max(2, int(0.6 * most)) // 2 * 2, int(1.5 * most) + 3, 2)
    ideal = straight / size
    return range(int(0.6 * ideal), int(1.5 * ideal) + 2) if straight > 0.0 else range(1)


def _total(shape: str, counts: Counts) -> int:
    """Cells of the whole bird."""
    if shape == "cylinder":
        return max(counts.along, 1) * counts.section
    if shape == "hemispherical_cylinder":
        return (counts.across + counts.along) * counts.section + counts.cap
    return counts.along * counts.section + counts.cap


def _slenderness(shape: str, counts: Counts, size: float, straight: float, length: float) -> float:
    """How far the cells are from cubes: |log| of their length over width, and of the layers' share of the radius."""
    aspect = 1.0
    if shape == "ellipsoid":
        aspect = length / (counts.along + 2 * counts.layers) / size
    elif straight > 0.0:
        aspect = straight / max(counts.along, 0.5) / size
    return abs(math.log(aspect)) + 0.2 * abs(math.log(2.7 * counts.layers / counts.across))
