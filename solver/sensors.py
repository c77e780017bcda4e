"""Sensors: what is read at every step, and its resampling to the user's clock without aliasing."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from data.histories import Array
from solver.kernels.contact import bilinear
from solver.plate import Plate

UNITS = {"displacement": "m", "contact_force": "N", "reaction_force": "N"}


def nodes_at(plate: Plate, at: tuple[float, float]) -> tuple[NDArray[np.int64], Array]:
    """The four nodes and shape functions of the undeformed point `at` [m] from the plate's centre."""
    corners = plate.mesh.nodes[plate.quads][:, :, :2]
    low, high = corners.min(axis=1), corners.max(axis=1)
    outside = np.maximum(np.maximum(low - at, at - high), 0.0).sum(axis=1)
    element = int(np.argmin(outside))
    xi, eta = np.clip(2.0 * (at - low[element]) / (high[element] - low[element]) - 1.0, -1.0, 1.0)
    return plate.quads[element], np.array(bilinear(xi, eta))


class Recorder:
    """Per-step readings; the push is towards -z, and displacement and forces are positive in the push."""

    def __init__(self, plate: Plate, sensors: dict[str, tuple[str, tuple[float, float]]], steps: int) -> None:
        self.kinds = {name: kind for name, (kind, _) in sensors.items()}
        self.places = {name: nodes_at(plate, at) for name, (kind, at) in sensors.items() if kind == "displacement"}
        self.time = np.zeros(steps + 1)
        self.readings = {name: np.zeros(steps + 1) for name in sensors}
        self.rest = plate.mesh.nodes[:, 2].copy()

    def read(self, step: int, time: float, plate: Plate, contact_force: float, reaction: float) -> None:
        """Take all readings of one step; forces in the push [N]."""
        self.time[step] = time
        for name, kind in self.kinds.items():
            if kind == "displacement":
                self.readings[name][step] = self.displacement(name, plate)
            else:
                self.readings[name][step] = contact_force if kind == "contact_force" else reaction

    def displacement(self, name: str, plate: Plate) -> float:
        """Displacement of the sensor's point in the push [m]."""
        nodes, shape = self.places[name]
        return float(shape @ (self.rest[nodes] - plate.x[nodes, 2]))

    def sampled(self, clock: Array) -> dict[str, Array]:
        """Channels on the user's clock [s]: displacements interpolated, forces as means over the sampling interval."""
        return {
            name: np.interp(clock, self.time, values)
            if self.kinds[name] == "displacement"
            else mean_over_interval(clock, self.time, values)
            for name, values in self.readings.items()
        }


def mean_over_interval(clock: Array, time: Array, force: Array) -> Array:
    """Mean force over each sampling interval centred on the clock, from the impulse: no impulse is lost or aliased."""
    impulse = np.concatenate([[0.0], np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(time))])
    half = 0.5 * (clock[1] - clock[0])
    early, late = np.clip(clock - half, 0.0, time[-1]), np.clip(clock + half, 0.0, time[-1])
    return (np.interp(late, time, impulse) - np.interp(early, time, impulse)) / (late - early)
