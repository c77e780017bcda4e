"""What makes the result of a valid case doubtful before it is run: its mesh, a bird beside the plate, late sensors.

`check` prints these sentences, and they stand among the warnings of every run.
"""

from __future__ import annotations

import math

import numpy as np

from birdstrike.solver.build import aimed_at
from birdstrike.solver.case.case import Case
from birdstrike.solver.case.remarks import remarks
from birdstrike.solver.sensors.instrument import unrecorded

BESIDE = 0.01
"""Share of the bird's cross-section that may fly past the plate unsaid."""
RINGS = 100
"""Of the points of a cross-section, by which the share is found within 0.5 %."""


def setup_warnings(case: Case) -> list[str]:
    """Sentences about what is allowed and spoils the answer: what was found, what it means, what to do."""
    late = unrecorded(case.instrument, case.first_contact, case.time.end)
    return [*bird_beside_plate(case), *remarks(case), *late]


def bird_beside_plate(case: Case) -> list[str]:
    """A warning where a part of the bird flies past the plate at rest."""
    share = share_beside_plate(case)
    if share < BESIDE:
        return []
    diameter, plate, offset = 1e3 * case.bird.diameter, case.plate, case.impact.offset
    aside = f", impact.offset = {1e3 * offset[0]:.4g} and {1e3 * offset[1]:.4g} mm" if any(offset) else ""
    return [
        f"{share:.0%} of the bird's cross-section fly past the plate's edges (bird.diameter = {diameter:.4g} mm, plate "
        f"of {1e3 * plate.length:.4g} x {1e3 * plate.width:.4g} mm{aside}): that part loads nothing, and the rest "
        "loads the frame, which the model takes as ideal; enlarge the plate or correct impact.offset, unless that is "
        "meant"
    ]


def share_beside_plate(case: Case) -> float:
    """Share of the bird's cross-section whose lines of flight meet the plate's mid-plane outside the plate at rest.

    The bird is round about its line of flight: its shadow on the plane is an ellipse, diameter/sin(angle) long.
    """
    ring = (np.arange(RINGS) + 0.5) / RINGS
    radius, turn = np.meshgrid(0.5 * case.bird.diameter * np.sqrt(ring), 2.0 * math.pi * ring)
    x, y, _ = aimed_at(case)
    along = np.abs(x + radius * np.cos(turn) / math.sin(case.impact.angle))
    across = np.abs(y + radius * np.sin(turn))
    return float(np.mean((along > 0.5 * span_along(case)) | (across > 0.5 * case.plate.width)))


def span_along(case: Case) -> float:
    """Length of the plate in plan [m]: the chord of a curved panel."""
    length, radius = case.plate.length, case.plate.radius
    return length if radius is None else 2.0 * radius * math.sin(0.5 * length / radius)
