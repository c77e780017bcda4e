"""What makes the result of a valid case doubtful before it is run: its mesh, a bird beside the plate, late sensors.

`check` prints these sentences, and they stand among the warnings of every run.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np

from birdstrike.solver.build import aimed_at, outline_of, rest_mesh, stiffness_of
from birdstrike.solver.case.case import Case
from birdstrike.solver.case.remarks import remarks
from birdstrike.solver.sensors.instrument import unrecorded
from birdstrike.solver.target.files.mesh_quality import WARNING
from birdstrike.solver.target.supports import NAMED

THICKNESS_OFF = 1e-3  # share of a part's thickness by which the file's may differ without a word
BESIDE = 0.01
"""Share of the bird's cross-section that may fly past the plate unsaid."""
RINGS = 100
"""Of the points of a cross-section, by which the share is found within 0.5 %."""


def setup_warnings(case: Case) -> list[str]:
    """Sentences about what is allowed and spoils the answer, the gravest first, each with a remedy."""
    return [
        *aimed_off(case),
        *free_target(case),
        *other_thicknesses(case),
        *bird_beside_plate(case),
        *remarks(case),
        *unrecorded(case.instrument, case.first_contact, case.time.end),
        *coarse_mesh(case),
        *doubtful_shells(case),
        *edge_on(case),
        *long_rivets(case),
        *sunk_sheets(case),
        *loose_ties(case),
    ]


def other_thicknesses(case: Case) -> list[str]:
    """A warning where the mesh file states other thicknesses of parts than the case, which are those simulated."""
    if case.target is None or case.mesh_file is None:
        return []
    other = [
        f"{name} {1e3 * stated:.4g} mm (target.parts.{name}.thickness: {1e3 * own:.4g} mm)"
        for name, stated in case.target.source.mesh().thicknesses.items()
        if not math.isclose(stated, own := case.target.parts[name].thickness, rel_tol=THICKNESS_OFF)
        and f"target.parts.{name}.thickness" not in case.inversion.parameters
    ]
    if not other:
        return []
    return [
        f"{case.mesh_file.name} states another thickness than the case, whose own is simulated: {', '.join(other)}; "
        "correct the one that is wrong"
    ]


def free_target(case: Case) -> list[str]:
    """A warning about a target of several parts that nothing holds."""
    target = case.target
    if target is None:
        return []
    sets_of_mesh = target.source.mesh().sets
    if any(len(sets_of_mesh[name]) and stiffness_of(held) != NAMED["free"] for name, held in target.supports.items()):
        return []
    if any(not target.materials[part.material].moves for part in target.parts.values()):
        return []
    sets = ", ".join(target.source.sets)
    return [
        "target.supports holds nothing: the whole target is a free rigid body that the bird pushes away, and there is "
        f"no reaction; hold one of its sets in target.supports (sets: {sets}), unless free flight is meant"
    ]


def aimed_off(case: Case) -> list[str]:
    """A warning where the struck part of a mesh from a file lies away from the point that the bird is aimed at."""
    target = case.target
    if target is None or case.mesh_file is None:
        return []
    from birdstrike.solver.sensors.places import place_in_space, point_at  # late: it brings in compiled kernels

    mesh, aim = rest_mesh(case), np.array(aimed_at(case))
    nearest = point_at(mesh, *place_in_space(mesh, aim, target.struck_name))
    off = float(np.linalg.norm(nearest - aim))
    if off <= AIMED_OFF * case.bird.diameter:
        return []
    in_file = ", ".join(f"{c:.6g} mm" for c in np.round(1e3 * (nearest + np.array(target.origin)), 3) + 0.0)
    plane = "the plane through target.origin" if case.struck_plane is None else "the part's plane there"
    aimed_by = "impact.offset" if case.impact.point is None else "impact.point"
    return [
        f"the struck part {target.struck_name} of target.mesh = {target.mesh} lies {1e3 * off:.4g} mm away from the "
        f"point that the bird is aimed at: stand-off and first contact count to {plane}, so the "
        f"bird meets the part at another time, or never; set target.origin to a point of the part, nearest "
        f"({in_file}) in the file's axes, or correct {aimed_by}"
    ]


def edge_on(case: Case) -> list[str]:
    """A warning where the bird meets the edge of a shell with particles that are wider than it."""
    if case.target is None or not case.meets_edge:
        return []
    spacing, thickness = float(np.cbrt(case.bird.volume / case.bird.particles)), case.target.struck_part.thickness
    if spacing < thickness:
        return []
    return [
        f"the bird meets {case.target.struck_name} on an edge: particles {1e3 * spacing:.3g} mm apart feel an edge of "
        f"{1e3 * thickness:.3g} mm as one of {1e3 * (thickness + spacing):.3g} mm, so that the forces are too high and "
        "fall with their number; raise bird.particles until they change no more"
    ]


def long_rivets(case: Case) -> list[str]:
    """A warning for each row of rivets of one's own that joins sheets which do not lie on each other."""
    target = case.target
    own = {} if target is None else {name: one.row() for name, one in target.rivets.items()}
    if target is None or not any(own.values()):
        return []
    from birdstrike.solver.target.links.anchors import Surface  # late: few cases have such rows

    mesh, found = target.source.mesh(), list[str]()
    surfaces = {name: Surface.of(mesh, name) for name in mesh.parts}
    for name, row in own.items():
        if row is None:
            continue
        feet = [[surfaces[part].foot(point) for part in row.parts] for point in row.points]
        apart = max(float(np.linalg.norm(np.subtract(*(f.weights @ mesh.nodes[f.nodes] for f in two)))) for two in feet)
        thick = sum(target.parts[part].thickness for part in row.parts)
        if apart > LONG_RIVET * thick:
            found.append(
                f"target.rivets.{name} joins {' and '.join(row.parts)} where their mid-surfaces are up to "
                f"{1e3 * apart:.3g} mm apart, sheets of {1e3 * thick:.3g} mm together: rivets through air, which carry "
                "bending as no rivet does; correct parts, start and end, unless spacers are meant"
            )
    return found


def sunk_sheets(case: Case) -> list[str]:
    """A warning for each row of a generator whose sheets are so thick that they lie in each other by its lap."""
    target = case.target
    lap = None if target is None else getattr(target.generator, "lap", None)
    if target is None or lap is None:
        return []
    found = list[str]()
    for name, rows in target.source.mesh().rows.items():
        for parts in dict.fromkeys(row.parts for row in rows):
            half = 0.5 * sum(target.parts[part].thickness for part in parts)
            if lap < SUNK * half:
                found.append(
                    f"target.generator.lap = {1e3 * lap:.3g} mm, and {' and '.join(parts)}, joined by the rivets of "
                    f"{name}, lie on each other at {1e3 * half:.3g} mm, half of their thicknesses together: they are "
                    "simulated in each other, which makes the joint too soft in bending; raise target.generator.lap"
                )
    return found


def loose_ties(case: Case) -> list[str]:
    """A warning for each tie that leaves nodes of its set free, as they are farther away than its distance."""
    if case.target is None or not case.target.ties:
        return []
    from birdstrike.solver.target.links.anchors import Surface  # late: few cases have ties
    from birdstrike.solver.target.links.ties import distances

    mesh, found = case.target.source.mesh(), list[str]()
    for name, tie in case.target.ties.items():
        own, away = distances(mesh, Surface.of(mesh, tie.onto), tie.nodes)
        far = away[away > tie.distance]
        if len(far):
            found.append(
                f"target.ties.{name} leaves {len(far)} of {len(own)} nodes of {tie.nodes} free, as they lie "
                f"{1e3 * far.min():.3g} to {1e3 * far.max():.3g} mm from {tie.onto}, beyond distance = "
                f"{1e3 * tie.distance:.3g} mm; raise it, unless they are meant to be free"
            )
    return found


LONG_RIVET = 2.0
"""Of the sheets' thicknesses together, beyond which their mid-surfaces lie apart."""
SUNK = 0.5
"""Of the distance at which two sheets lie on each other, below which a lap is told: a panel has one for all pairs."""
AIMED_OFF = 0.25
"""Of the bird's diameter, by which the struck part of a mesh from a file may lie off the aim unsaid."""


def doubtful_shells(case: Case) -> list[str]:
    """What a mesh from a file has against it that does not refuse it."""
    if case.target is None:
        return []
    found = [one.text for one in case.target.findings() if one.severity == WARNING]
    return [f"target.mesh = {case.target.mesh}: {text}" for text in found]


def bird_beside_plate(case: Case) -> list[str]:
    """A warning where a part of the bird flies past the plate at rest."""
    share = share_beside_plate(case)
    if share < BESIDE:
        return []
    diameter, plate, aims = 1e3 * case.bird.diameter, case.plate, {"impact.offset": case.impact.offset}
    if case.impact.point is not None:
        aims = {"impact.point": case.impact.point} | aims
    aside = "".join(
        f", {key} = {' and '.join(f'{1e3 * c:.4g}' for c in aim[:2])} mm" for key, aim in aims.items() if any(aim)
    )
    return [
        f"{share:.0%} of the bird's cross-section fly past the plate's edges (bird.diameter = {diameter:.4g} mm, plate "
        f"of {1e3 * plate.length:.4g} x {1e3 * plate.width:.4g} mm{aside}): that part loads nothing, and the rest "
        f"loads the frame, which the model takes as ideal; enlarge the plate or correct {next(iter(aims))}, unless "
        "that is meant"
    ]


def share_beside_plate(case: Case) -> float:
    """Share of the bird's cross-section whose lines of flight meet the plate's mid-plane outside the plate at rest.

    The bird is round about its line of flight: its shadow on the plane is an ellipse, diameter/sin(angle) long.
    """
    ring, seen = (np.arange(RINGS) + 0.5) / RINGS, outline_of(case)
    radius, turn = np.meshgrid(0.5 * case.bird.diameter * np.sqrt(ring), 2.0 * math.pi * ring)
    (x, y, z), (x_middle, y_middle) = seen.aim, seen.middle
    angle, heading = case.impact.angle, case.impact.heading
    length, width = span_along(case), case.plate.width
    if seen.plane is not None:
        angle, heading = math.asin(min(-seen.direction[2], 1.0)), math.atan2(seen.direction[1], seen.direction[0])
        length, width = seen.sides
    longer, wide = z / math.tan(angle) + radius * np.cos(turn) / math.sin(angle), radius * np.sin(turn)
    along = np.abs(x - x_middle + longer * math.cos(heading) - wide * math.sin(heading))
    across = np.abs(y - y_middle + longer * math.sin(heading) + wide * math.cos(heading))
    return float(np.mean((along > 0.5 * length) | (across > 0.5 * width)))


def span_along(case: Case) -> float:
    """Length of the plate in plan [m]: the chord of a curved panel."""
    length, radius = case.plate.length, case.plate.radius
    return length if radius is None else 2.0 * radius * math.sin(0.5 * length / radius)


MESH_LIMIT = 0.04
"""Expected error of the peak displacement from which on a mesh is called too coarse."""
FEW_SHELLS = 5
"""Across the plate, up to which the error by their number holds that of a sensor inside a shell."""
SHELLS_ACROSS = {2: 0.85, 3: 0.45, 4: 0.3, 5: 0.3, 6: 0.06, 8: 0.03, 12: 0.017}
SHELL_OVER_RADIUS = {2.0: 0.02, 2.75: 0.09, 3.5: 0.25, 5.0: 0.35}
PARTICLES = {95: 0.046, 146: 0.043, 208: 0.023, 290: 0.012}
FORCE_BY_PARTICLES = {95: 0.9, 146: 0.55, 208: 0.5, 290: 0.2, 500: 0.15}
"""Expected relative error of a strike's peak central displacement, and of the peak of its reaction force, measured.

By the smaller of the two numbers of shells across the plate; by the root of a shell's area over the bird's radius; and
by the bird's particles. Root mean squares over nine strikes on 9 to 27 meshes each (plates of 300 to 1500 mm, 3 to
10 mm thick, clamped, pinned, on springs, one curved; birds of 40 to 106 mm in diameter at 80 to 120 m/s) against the
finest, and of three with 85 to 9000 particles. docs/choosing.md has the tables, docs/mesh_error.py makes them. Shells
five times as long as wide err like their smaller number, not more. Four or five shells erred by 2 to 90 %: such a mesh
may be right by chance.
"""


def coarse_mesh(case: Case) -> list[str]:
    """A warning for the plate's mesh and one for the bird's where the error to be expected is beyond the limit."""
    return [] if case.plate.rigid or case.meets_edge else [*_coarse_plate(case), *_coarse_bird(case)]


def _coarse_plate(case: Case) -> list[str]:
    error, (_, elements) = plate_mesh_error(case), shells_across(case)
    if error <= MESH_LIMIT:
        return []
    size = f"{min(elements)} shells across the plate, a shell {shell_over_radius(case):.2g} times the bird's radius"
    if case.target is not None:
        remedy = "make target.generator.element_size smaller, or refine the file of target.mesh"
        return [
            f"the target's mesh is too coarse: expect an error of about {error:.0%} in the peak displacement ({size}); "
            f"{remedy}, and {_measure(case)}"
        ]
    name = max(case.sensors, key=partial(interpolation_error, case))
    if interpolation_error(case, name) == error:
        size = f"{name} lies inside a shell, where the reading is interpolated between the nodes"
    return [
        f"plate.elements = {list(elements)} is too coarse: expect an error of about {error:.0%} in the peak "
        f"displacement ({size}); set plate.elements = {_fine_enough(case)} or finer, and measure what is left with "
        "birdstrike converge"
    ]


def _coarse_bird(case: Case) -> list[str]:
    error, particles = bird_mesh_error(case), case.bird.particles
    if error <= MESH_LIMIT:
        return []
    return [
        f"bird.particles = {particles} is too coarse: expect an error of about {error:.0%} in the peak displacement "
        f"and of {interpolated(FORCE_BY_PARTICLES, particles):.0%} in the peak of a reaction force; set "
        f"bird.particles = 300 or more, and {_measure(case)}"
    ]


def _measure(case: Case) -> str:
    """How the error of the mesh is measured; a mesh from a file is not refined by birdstrike converge."""
    if case.mesh_file is not None:
        return "compare with a simulation on a finer file and more particles"
    return "measure what is left with birdstrike converge"


def _fine_enough(case: Case) -> list[int]:
    """Numbers of shells of a rectangular plate from which on nothing is said of its mesh."""
    sides = (case.plate.length, case.plate.width)
    numbers = zip(case.plate.elements, sides, strict=True)
    enough = [max(n, 8, math.ceil(side / case.bird.diameter)) for n, side in numbers]
    while plate_mesh_error(case.with_mesh(case.bird.particles, (enough[0], enough[1]))) > MESH_LIMIT:
        enough = [n + (n % 2 or 2) for n in enough]
    return enough


def plate_mesh_error(case: Case) -> float:
    """Expected error of the peak displacement by the plate's mesh, a share of the peak."""
    by_count = interpolated(SHELLS_ACROSS, min(shells_across(case)[1]))
    by_size = interpolated(SHELL_OVER_RADIUS, shell_over_radius(case))
    return max(by_count, by_size, *map(partial(interpolation_error, case), case.sensors))


def interpolation_error(case: Case, name: str) -> float:
    """Share by which a displacement sensor inside a shell reads too little: the chord of the deflection between nodes.

    At a share f of a side, h long: w'' h^2 f (1 - f)/2, with the deflection w of clamped edges, 1 + cos(2 pi x/length).
    Of 5 shells or fewer SHELLS_ACROSS has it already.
    """
    sensor, plate = case.sensors[name], case.plate
    at: tuple[float, float] | None = getattr(sensor, "at", None)
    if sensor.kind != "displacement" or at is None or case.target is not None:
        return 0.0
    found = 0.0
    for x, side, count in zip(at, (plate.length, plate.width), plate.elements, strict=True):
        inside = (x / side + 0.5) * count % 1.0
        bend = math.cos(2.0 * math.pi * x / side)
        if count > FEW_SHELLS and bend > 0.0:
            found += math.pi**2 * inside * (1.0 - inside) * 2.0 * bend / (1.0 + bend) / count**2
    return found


def bird_mesh_error(case: Case) -> float:
    """Expected error of the peak displacement by the bird's particles or elements, a share of the peak."""
    return interpolated(PARTICLES, case.bird.particles)


def interpolated(table: Mapping[Any, float], at: float) -> float:
    """Value of a table between its entries, a power law; beyond its ends the last one."""
    known, values = np.array(list(table), dtype=float), np.array(list(table.values()))
    return math.exp(float(np.interp(math.log(at), np.log(known), np.log(values))))


def shells_across(case: Case) -> tuple[tuple[float, float], tuple[int, int]]:
    """Length and width of what is struck [m], and its shells along them: of a mesh that lies aslant in its plane."""
    plate, seen = case.plate, outline_of(case)
    if seen.plane is None or case.target is None:
        return (plate.length, plate.width), plate.elements
    (length, width), size = seen.sides, case.target.source.element_size
    return (length, width), (max(round(length / size), 2), max(round(width / size), 2))


def shell_over_radius(case: Case) -> float:
    """Root of a shell's area over the bird's radius."""
    (length, width), (along, across) = shells_across(case)
    return math.sqrt(length * width / (along * across)) / (0.5 * case.bird.diameter)
