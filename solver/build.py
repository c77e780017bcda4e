"""The plate and the bird of a case as the solver steps them: what the case says, meshed and put in place."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.solver.bird.body import BirdBody
from birdstrike.solver.bird.hex_mesh import HexMesh, bird_mesh
from birdstrike.solver.bird.hexahedra import HexBird, HexSettings
from birdstrike.solver.bird.shape import fill_bird, jittered, outline, slope_gain
from birdstrike.solver.bird.sph import Bird
from birdstrike.solver.bird.sph_strength import SolidBird
from birdstrike.solver.bird.total_lagrangian import ElasticBird
from birdstrike.solver.case.bird import Bird as BirdOfCase
from birdstrike.solver.case.case import Case
from birdstrike.solver.case.plate import EdgeSprings
from birdstrike.solver.case.plate import Plate as PlateOfCase
from birdstrike.solver.case.sections import Impact
from birdstrike.solver.case.struck import Plane, about_z, direction_of, point_of_aim, shells_at_rest
from birdstrike.solver.case.target import Target as TargetOfCase
from birdstrike.solver.target.assembled import LinkData, PartData, assembled
from birdstrike.solver.target.assembly import Target
from birdstrike.solver.target.mesh import ShellMesh, cylindrical_panel, plate_mesh
from birdstrike.solver.target.rectangle import plate_of, rigid_plate_of
from birdstrike.solver.target.section import ShellMaterial
from birdstrike.solver.target.supports import NAMED, RIGID, EdgeStiffness

PARTICLES: dict[str, type[Bird]] = {"fluid": Bird, "strength": SolidBird, "total_lagrangian": ElasticBird}
"""Particles that carry a material, by its `body`."""


def build_plate(case: Case) -> Target:
    """Plate of the case, at rest; raises UserError when its edges cannot hold its preload."""
    said = case.plate
    if case.target is not None:
        return build_assembly(case.target)
    if said.rigid:
        return rigid_plate_of(mesh_of(said), said.thickness)
    material = ShellMaterial(**said.material.model_dump())
    plate = plate_of(mesh_of(said), said.thickness, material, edges_of(said.edges), said.damping)
    if any(said.preload):
        plate.preload(*said.preload)
    return plate


def build_assembly(said: TargetOfCase) -> Target:
    """Target of several parts, at rest."""
    data = {name: PartData(part.thickness, said.materials[part.material]) for name, part in said.parts.items()}
    supports = {name: stiffness_of(edges) for name, edges in said.supports.items()}
    links = LinkData({name: tie.data() for name, tie in said.ties.items()}, tuple(said.rivet_rows()))
    return assembled(said.source.mesh(), data, supports, said.damping, links)


def stiffness_of(edges: str | EdgeSprings) -> EdgeStiffness:
    """Springs of a word or a table."""
    found = edges_of(edges)
    return NAMED[found] if isinstance(found, str) else found


def rest_mesh(case: Case) -> ShellMesh:
    """The shells that a bird can hit, at rest."""
    if case.target is None:
        return mesh_of(case.plate)
    return shells_at_rest(case.target)


def mesh_of(plate: PlateOfCase) -> ShellMesh:
    """Mesh at rest: flat, or curved to `radius`."""
    if plate.radius is None:
        return plate_mesh(plate.length, plate.width, plate.elements)
    return cylindrical_panel(plate.length, plate.width, plate.radius, plate.elements)


def edges_of(edges: str | EdgeSprings) -> str | EdgeStiffness:
    """A word as it stands; of springs, the keys that were left out are rigid."""
    if isinstance(edges, str):
        return edges
    given = edges.model_dump()
    return EdgeStiffness(**{name: RIGID if given[name] is None else given[name] for name in asdict(EdgeStiffness())})


def turned(points: Array, impact: Impact) -> Array:
    """Points (n, 3) of a bird, its axis along x, turned into the direction of flight.

    That is (cos angle, 0, -sin angle), turned about z by the heading. Out of it the axis turns by `yaw`, its nose
    towards y, and then by `pitch`, its nose raised; where one is 0 the other is the angle between axis and velocity.
    """
    angle = impact.angle
    along, across = np.array([math.cos(angle), 0.0, -math.sin(angle)]), np.array([0.0, 1.0, 0.0])
    up = np.array([math.sin(angle), 0.0, math.cos(angle)])
    if impact.yaw:
        c, s = math.cos(impact.yaw), math.sin(impact.yaw)
        along, across = c * along + s * across, c * across - s * along
    if impact.pitch:
        c, s = math.cos(impact.pitch), math.sin(impact.pitch)
        along, up = c * along + s * up, c * up - s * along
    return points @ (np.stack([along, across, up]) @ about_z(impact.heading))


def surface_in_flight(case: Case) -> Array:
    """Points (n, 3) [m] on the ideal surface of the case's bird about its centre, turned as it flies.

    Every ring about the bird's axis has a point where it lies lowest.
    """
    bird, impact = case.bird, case.impact
    yaw, pitch, angle = impact.yaw, impact.pitch, impact.angle
    upright = math.cos(pitch) * math.cos(angle) + math.sin(pitch) * math.cos(yaw) * math.sin(angle)
    roll = math.atan2(math.sin(yaw) * math.sin(angle), upright)
    return turned(outline(bird.shape, bird.diameter, bird.length, roll), impact)


def nose_meets(surface: Array, angle: float, height: float) -> tuple[float, float]:
    """x and y [m] where the lowest of a turned bird's points (n, 3) meets the plane z = height [m]."""
    lowest = surface[:, 2].min()
    touching = surface[np.isclose(surface[:, 2], lowest, atol=1e-9)]
    return float(touching[:, 0].mean() + (lowest - height) / math.tan(angle)), float(touching[:, 1].mean())


def nose_on_plane(surface: Array, direction: Array, plane: Plane, height: float) -> Array:
    """From the plane's point to where the first of a bird's points (n, 3) to touch it does, in the plane, (3,) [m].

    The bird flies through the plane's point along `direction` (3,) and touches at `height` [m] from the plane.
    """
    away = surface @ plane.normal
    touching = surface[np.isclose(away, away.min(), atol=1e-9)].mean(axis=0)
    met = touching + (height - away.min()) / (direction @ plane.normal) * direction
    return met - (met @ plane.normal) * plane.normal


def flight_to_panel(x: Array, direction: Array, plate: PlateOfCase, surface: float) -> float:
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


def flight_to(case: Case, points: Array, surface: float, plane: Plane | None) -> float:
    """Least distance [m] that a point of (n, 3) flies until it touches what is struck, a plate, panel or `plane`.

    surface: distance from the mid-surface at which a point touches [m].
    """
    direction = direction_of(case.impact)
    if plane is None:
        return flight_to_panel(points, direction, case.plate, surface)
    return float((plane.seen(points)[:, 2].min() - surface) / -(plane.normal @ direction))


def build_bird(case: Case) -> tuple[BirdBody, float]:
    """Bird of the case and when it is there [s]: `standoff` of flight before its ideal surface touches, at 0.

    Before 0 where the outermost points reach the plate earlier than that (`in_flight`).
    """
    return build_hexahedra(case) if case.bird.method == "hexahedra" else build_particles(case)


def in_flight(case: Case, points: Array, skin: float) -> tuple[Array, Array, float]:
    """Positions (n, 3) [m] and velocities (n, 3) [m/s] of a bird's points (n, 3), given about its centre, axis along x.

    And when they are there [s]. The bird's ideal surface touches after the stand-off, so that the clock does not hang
    on where the outermost points happen to lie. Each acts `skin` [m] ahead of itself. Where a lattice is cut at random,
    its points lie 0 to 2 skins deep at even odds; those less than one deep are stopped early, and the first layer comes
    to rest skin/4 further out than the mass that it stands for. The bird begins as much further back. None is let begin
    in the plate, nor in a thicker part of its target: where one would, the bird begins before time 0, as far back as it
    takes.
    """
    impact, half = case.impact, 0.5 * case.plate.thickness
    direction = direction_of(impact)
    surface, start, plane = surface_in_flight(case), aimed_at(case), case.struck_plane
    x = turned(points, impact) + start
    flight = flight_to(case, surface + start, half + 0.25 * skin, plane) - impact.standoff
    thickest = half if case.target is None else 0.5 * max(part.thickness for part in case.target.parts.values())
    free = min(flight, flight_to(case, x, thickest + skin, plane))
    return x + free * direction, np.tile(impact.speed * direction, (len(x), 1)), (free - flight) / impact.speed


def aimed_at(case: Case) -> Array:
    """Where the bird's axis meets the plate's mid-plane, (3,) [m]: the point of aim, or such that the nose meets it."""
    start = point_of_aim(case.impact)
    plane = case.struck_plane if case.impact.aim == "first_touch" else None
    if plane is not None:
        start -= nose_on_plane(surface_in_flight(case), direction_of(case.impact), plane, 0.5 * case.plate.thickness)
    elif case.impact.aim == "first_touch":
        x_nose, y_nose = nose_meets(surface_in_flight(case), case.impact.angle, 0.5 * case.plate.thickness)
        start -= [x_nose, y_nose if case.impact.yaw else 0.0, 0.0]  # without yaw the nose lies at y = 0 exactly
    return start


def middle_of(case: Case) -> tuple[float, float]:
    """Middle in plan of what is struck, x and y [m]: the origin, but for a mesh from a file, which lies anywhere."""
    if case.target is None or case.mesh_file is None:
        return 0.0, 0.0
    nodes = case.target.source.mesh().nodes
    x, y, _ = 0.5 * (nodes.min(axis=0) + nodes.max(axis=0))
    return float(x), float(y)


@dataclass(frozen=True)
class Outline:
    """What is struck in the axes of the plane that the bird strikes: along length, width, the normal.

    aim, direction (3,): the point of aim [m], and the velocity's; middle, sides (2,): of the rectangle around it [m].
    """

    plane: Plane | None
    aim: Array
    direction: Array
    middle: Array
    sides: Array

    def seen(self, points: Array) -> Array:
        """Points (n, 3) [m] in these axes."""
        return points if self.plane is None else self.plane.seen(points)


def outline_of(case: Case) -> Outline:
    """The outline in plan, of a curved panel its arc's length; of shells that lie aslant across their normal."""
    plane, aim, direction = case.struck_plane, aimed_at(case), direction_of(case.impact)
    if plane is None or case.target is None:
        return Outline(None, aim, direction, np.array(middle_of(case)), np.array([case.plate.length, case.plate.width]))
    nodes = plane.seen(case.target.source.mesh().nodes)[:, :2]
    low, high = nodes.min(axis=0), nodes.max(axis=0)
    return Outline(plane, plane.seen(aim), plane.axes @ direction, 0.5 * (low + high), high - low)


def build_hexahedra(case: Case) -> tuple[HexBird, float]:
    """Lagrangian bird of the case, its hourglass control that of its material unless the case names one."""
    b, s = case.bird, case.solver
    mesh = bird_mesh(b.shape, b.diameter, b.length, b.volume, b.particles)
    x, v, begin = in_flight(case, mesh.nodes, 0.0)
    hourglass = s.hourglass or b.material.hourglass
    settings = HexSettings((s.shock_linear, s.shock_quadratic), hourglass, s.hourglass_coefficient, s.smallest_step)
    bird = HexBird(HexMesh(x, mesh.cells), v, b.material.build(b.actual_density), settings)
    bird.stiffen(case.normal_speed)
    return bird, begin


def build_particles(case: Case) -> tuple[Bird, float]:
    """SPH bird of the case."""
    b = case.bird
    points, spacing = bird_lattice(b)
    share = b.volume / len(points)
    x, v, begin = in_flight(case, points, 0.5 * share ** (1.0 / 3.0))
    material = b.material.build(b.actual_density)
    shock = (case.solver.shock_linear, case.solver.shock_quadratic)
    state = (x, v, b.actual_mass / len(points), case.solver.smoothing * spacing)
    gain = slope_gain(b.lattice, case.solver.smoothing) * spacing**3 / share
    bird = PARTICLES[b.material.body](*state, material, shock, gain=gain)
    bird.stiffen(case.normal_speed)
    return bird, begin


def bird_lattice(b: BirdOfCase) -> tuple[Array, float]:
    """Particle positions (n, 3) [m] about the bird's centre, axis along x, and the lattice's spacing [m]."""
    points, spacing = fill_bird(b.shape, b.diameter, b.length, b.volume, b.particles, b.lattice)
    return jittered(points, b.jitter * spacing, b.seed), spacing
