"""A bird end on against a rigid plate, with a pressure gauge in the middle: Wilbeck's set-up as changes of a case."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from reports.verification.shots import Shot

DENSITY, C, S1 = 938.0, 1670.0, 2.48
DIAMETER = 0.1  # m
GAUGE = 0.1  # of the diameter: the gauge's radius


@dataclass(frozen=True)
class Compared:
    """A computed value and its reference, both SI, and what else was seen."""

    computed: float
    reference: float
    unit: str
    seen: dict[str, float]

    @property
    def error(self) -> float:
        """Relative to the reference."""
        return self.computed / self.reference - 1.0


def rigid_shot(spacing: float, length: float, speed: float, end: float, **changes: str) -> Shot:
    """A flat cylinder of DIAMETER, particles `spacing` [m] apart, no viscosity; speed [m/s], end [s].

    changes: as of `Shot.with_`.
    """
    particles = round(0.25 * np.pi * DIAMETER**2 * length / spacing**3)
    table = {
        "plate.rigid": "true",
        "plate.length": "600 mm",
        "plate.width": "600 mm",
        "plate.elements": "[30, 30]",
        "bird.shape": "cylinder",
        "bird.diameter": f"{DIAMETER} m",
        "bird.length": f"{length} m",
        "bird.density": f"{DENSITY} kg/m^3",
        "bird.particles": f"{particles}",
        "bird.material.viscosity": "0 Pa s",
        "bird.material.compression_erosion": "0.0",
        "impact.speed": f"{speed} m/s",
        "impact.angle": "90 deg",
        "impact.standoff": "0 mm",
        "time.end": f"{end} s",
        "time.output_interval": "2 us",
        "time.snapshots": "[]",
        "sensors.centre.kind": "pressure",
        "sensors.centre.radius": f"{GAUGE * DIAMETER} m",
    }
    return Shot("reference_strike", tuple(table.items())).with_(**changes)
