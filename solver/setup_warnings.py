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
    return [*coarse_mesh(case), *bird_beside_plate(case), *remarks(case), *late]


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


MESH_LIMIT = 0.05
"""Expected error of the peak displacement from which on a mesh is called too coarse."""

SHELLS_ACROSS = {2: 0.85, 3: 0.5, 4: 0.3, 5: 0.3, 6: 0.06, 8: 0.03, 12: 0.015}
SHELL_OVER_RADIUS = {2.0: 0.02, 2.75: 0.09, 3.5: 0.25, 5.0: 0.35}
ACROSS_BIRD = 1.2
"""Expected relative error of the peak of a central displacement, measured.

By the smaller of the two numbers of shells across the plate; by the root of a shell's area over the bird's radius; and
of the bird, ACROSS_BIRD over the square of its particles across the diameter. The first two are the root mean squares
over nine strikes, each on 9 to 28 meshes, against one of 50 x 40 shells or as fine; the table is in docs/choosing.md.
A strike: plates of 300 to 1500 mm, 3 to 10 mm thick, clamped, pinned, on springs, curved; birds of 40 to 106 mm in
diameter at 80 to 120 m/s. Elongated shells (1 to 5) have the error of their longer side's number, no more. An error of
6 shells was 0 to 17 %, one of 4 or 5 shells 2 to 90 %: a single mesh may be right by chance.
"""


def coarse_mesh(case: Case) -> list[str]:
    """A warning for the plate's mesh and one for the bird's where the error to be expected is beyond the limit."""
    return [] if case.plate.rigid else [*_coarse_plate(case), *_coarse_bird(case)]


def _coarse_plate(case: Case) -> list[str]:
    error, elements = plate_mesh_error(case), case.plate.elements
    if error <= MESH_LIMIT:
        return []
    diameter = case.bird.diameter
    sides = (case.plate.length, case.plate.width)
    enough = [max(n, 8, math.ceil(side / diameter)) for n, side in zip(elements, sides, strict=True)]
    return [
        f"plate.elements = {list(elements)} is too coarse: expect an error of about {error:.0%} in the peak "
        f"displacement ({min(elements)} shells across the plate, a shell {shell_over_radius(case):.2g} times the bird's "
        f"radius); set plate.elements = {enough} or finer, and measure what is left with birdstrike converge"
    ]


def _coarse_bird(case: Case) -> list[str]:
    error, bird = bird_mesh_error(case), case.bird
    if error <= MESH_LIMIT:
        return []
    enough = math.ceil(bird.volume * (ACROSS_BIRD / MESH_LIMIT) ** 1.5 / bird.diameter**3 / 10.0) * 10
    return [
        f"bird.particles = {bird.particles} is too coarse: expect an error of about {error:.0%} in the peak "
        f"displacement and more in forces ({particles_across(case):.2g} across the bird's diameter); set "
        f"bird.particles = {enough} or more, and measure what is left with birdstrike converge"
    ]


def plate_mesh_error(case: Case) -> float:
    """Expected error of the peak displacement by the plate's mesh, a share of the peak."""
    by_count, by_size = (
        math.exp(float(np.interp(math.log(at), np.log(list(table)), np.log(list(table.values())))))
        for at, table in ((min(case.plate.elements), SHELLS_ACROSS), (shell_over_radius(case), SHELL_OVER_RADIUS))
    )
    return max(by_count, by_size)


def bird_mesh_error(case: Case) -> float:
    """Expected error of the peak displacement by the bird's particles or elements, a share of the peak."""
    return ACROSS_BIRD / particles_across(case) ** 2


def shell_over_radius(case: Case) -> float:
    """Root of a shell's area over the bird's radius."""
    plate, (along, across) = case.plate, case.plate.elements
    return math.sqrt(plate.length * plate.width / (along * across)) / (0.5 * case.bird.diameter)


def particles_across(case: Case) -> float:
    """Particles, or elements, across the bird's diameter."""
    return case.bird.diameter / (case.bird.volume / case.bird.particles) ** (1.0 / 3.0)
