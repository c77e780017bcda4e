"""Erosion limits that can erode nothing: where a parameter does not act, runs do not differ by it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from data.histories import Array
from doe.designs import Design

Test = Callable[[Array], NDArray[np.bool_]]

INACTIVE: Mapping[str, tuple[Test, str]] = MappingProxyType(
    {
        "bird.material.tension_erosion": (lambda v: v <= 1.0, "V/V0 <= 1 (or 0, off)"),
        "bird.material.compression_erosion": (lambda v: (v <= 0.0) | (v >= 1.0), "V/V0 >= 1 (or 0, off)"),
    }
)
"""Dotted key -> which values (n,) of V/V0 never erode, and the same in words."""


def inactive_runs(design: Design) -> dict[str, int]:
    """Number of runs of the design in which an erosion limit does not act, by dotted key."""
    varied = {name: design.values[:, j] for j, name in enumerate(design.names) if name in INACTIVE}
    return {name: int(np.sum(INACTIVE[name][0](values))) for name, values in varied.items()}


def activity_sentences(design: Design) -> list[str]:
    """One line for every erosion limit that is inactive in part of the design."""
    return [
        f"{name} is inactive in {count} of {len(design.numbers)} runs ({INACTIVE[name][1]}): there it changes nothing"
        for name, count in inactive_runs(design).items()
        if count
    ]
