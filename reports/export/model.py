"""A case as a finite-element model that any code can take: nodes, elements, supports, contact and what is recorded."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.errors import UserError
from birdstrike.data.histories import Array
from birdstrike.solver.bird.body import BirdBody
from birdstrike.solver.build import build_bird, build_plate, direction_of
from birdstrike.solver.case.case import Case
from birdstrike.solver.case.plate import PlateMaterial
from birdstrike.solver.kernels.contact.contact import bilinear
from birdstrike.solver.sensors.reaction_force import ReactionForce
from birdstrike.solver.sensors.sensor import Placed, Sensor
from birdstrike.solver.sensors.strain import Strain
from birdstrike.solver.target.assembly import Target
from birdstrike.solver.target.laws.interface import TargetMaterial

Numbers = NDArray[np.int64]
AXES = np.eye(3)
SMALLEST_SHARE = 1e-9
"""Share of a sensor in a node below which the node is not recorded."""
STEP_SHARE = 0.9
"""Of the shells' own stable step: that of a support's spring is set to it by the mass that the spring gets."""


@dataclass(frozen=True)
class ShellPart:
    """Shells of one thickness [m] and metal: corner nodes (e, 4), a triangle's last one twice, counted from 0.

    material: of a plate, or of one of a target's parts; None of a rigid plate. moves: whether it is held nowhere.
    """

    name: str
    thickness: float
    material: PlateMaterial | TargetMaterial | None
    quads: Numbers
    first: int

    @property
    def moves(self) -> bool:
        """Whether it strains; a rigid part's nodes are all held."""
        return self.material is not None and getattr(self.material, "moves", True)


@dataclass(frozen=True)
class BirdMesh:
    """Points (n, 3) [m], all flying at `velocity` (3,) [m/s]; cells (e, 8) of a Lagrangian bird, empty of particles.

    masses (n,) [kg]; smoothing: length [m] at which other codes set their particles; skin: half a particle's width [m].
    """

    points: Array
    cells: Numbers
    masses: Array
    velocity: Array
    smoothing: float
    skin: float
    density: float


@dataclass(frozen=True)
class HeldNodes:
    """Nodes held alike in global axes; freedoms: x, y, z, then the rotations about them."""

    nodes: Numbers
    freedoms: tuple[bool, bool, bool, bool, bool, bool]


@dataclass(frozen=True)
class SupportSprings:
    """Nodes, each with springs of these stiffnesses to the ground: along x, y, z [N/m], about each axis [N m/rad].

    mass [kg], inertia [kg m^2]: of a spring where a code wants them, such that its own stable step is no smaller than
    the shells'.
    """

    nodes: Numbers
    translation: tuple[float, float, float]
    rotation: float
    mass: float
    inertia: float


@dataclass(frozen=True)
class ContactPair:
    """Bird against the parts of one thickness [m]; gap: distance from their mid-surface at which contact begins [m]."""

    parts: tuple[int, ...]
    thickness: float
    gap: float


@dataclass(frozen=True)
class SensorOutput:
    """What a code records for a sensor: the sum of weights (k,) times its variable at nodes (k,), along `direction`.

    kind, unit: the sensor's; element: the shell under a gauge, None of other sensors; side: z over the half thickness.
    """

    name: str
    kind: str
    unit: str
    nodes: Numbers
    weights: Array
    direction: Array
    element: int | None = None
    side: float = 0.0


@dataclass(frozen=True)
class StrikeModel:
    """Everything that a deck holds, SI, nodes and elements counted from 0.

    nodes (m, 3): of the target at rest; damping: factor alpha of mass-proportional damping forces [1/s];
    contact_stiffness: of a point on the surface [N/m]; missing: sensors that no code records by itself, and why; begin:
    instant of the case's clock [s] at which the bird is there.
    """

    case: Case
    nodes: Array
    parts: tuple[ShellPart, ...]
    bird: BirdMesh
    held: tuple[HeldNodes, ...]
    springs: tuple[SupportSprings, ...]
    damping: float
    contacts: tuple[ContactPair, ...]
    contact_stiffness: float
    friction: float
    sensors: tuple[SensorOutput, ...]
    missing: tuple[str, ...]
    begin: float

    @property
    def end(self) -> float:
        """Of the deck's own clock [s]."""
        return self.case.time.end - self.begin

    @property
    def output_interval(self) -> float:
        """[s]."""
        return self.case.time.output_interval


def strike_model(case: Case) -> StrikeModel:
    """The model of a case, its effects in their keys; raises UserError for what no common keyword says."""
    acted = case.resolved()
    if any(acted.plate.preload) and acted.target is None:
        raise UserError(
            "plate.preload has no card in a whole deck: an initial stress wants the other code's own equilibrium; "
            'export the case without it (--set \'plate.preload=["0 MPa", "0 MPa"]\') and set it there'
        )
    _refuse_links(acted)
    target, (bird, begin) = build_plate(acted), build_bird(acted)
    parts = tuple(_parts(acted, target))
    step = _shell_step(target, parts)
    sensors, missing = _sensors(acted, target, bird)
    damping = acted.plate.damping if acted.target is None else acted.target.damping
    return StrikeModel(
        case=acted,
        nodes=target.x.copy(),
        parts=parts,
        bird=_bird(acted, bird),
        held=tuple(_held(target)),
        springs=tuple(_springs(target, step)),
        damping=2.0 * damping,
        contacts=tuple(_contacts(parts, bird.skin)),
        contact_stiffness=float(bird.bulk_modulus * bird.spacing),
        friction=acted.impact.friction,
        sensors=sensors,
        missing=missing,
        begin=begin,
    )


def _refuse_links(case: Case) -> None:
    """Raise UserError where ties or rivets join the parts: without cards for them the parts would fall apart."""
    said = case.target
    given = [] if said is None else [key for key in ("ties", "rivets") if getattr(said, key)]
    if not given:
        return
    names = ", ".join(f"target.{key}.{name}" for key in given for name in getattr(said, key))
    raise UserError(
        f"{' and '.join(f'target.{key}' for key in given)} ({names}) have no card in a whole deck, and without them "
        "the parts would not be joined; give a target whose parts share their nodes along the joints (target.mesh), "
        "or export the bird's cards alone (without --deck) for a deck of your own that has the joints"
    )


def _parts(case: Case, target: Target) -> Iterator[ShellPart]:
    if case.target is None:
        material = None if case.plate.rigid else case.plate.material
        yield ShellPart("plate", case.plate.thickness, material, target.quads, 0)
        return
    first = 0
    for name, facets in target.mesh.parts.items():
        said = case.target.parts[name]
        yield ShellPart(name, said.thickness, case.target.materials[said.material], target.quads[facets], first)
        first += len(facets)


def _bird(case: Case, bird: BirdBody) -> BirdMesh:
    cells = np.asarray(getattr(bird, "cells", np.empty((0, 8))), np.int64)
    velocity = case.impact.speed * direction_of(case.impact)
    masses = bird.masses[: bird.n].copy()
    density = case.bird.actual_density
    nearest = (math.sqrt(2.0) * float(masses.mean()) / density) ** (1.0 / 3.0)
    return BirdMesh(
        points=bird.x[: bird.n].copy(),
        cells=cells,
        masses=masses,
        velocity=velocity,
        smoothing=nearest,
        skin=bird.skin,
        density=density,
    )


def _global_axis(direction: Array) -> int:
    """The global axis along a direction; raises UserError where it lies along none."""
    along = np.abs(AXES @ direction)
    if along.max() < 1.0 - 1e-9:
        raise UserError(
            "plate.edges: supports that hold some freedoms of a curved or tilted edge only, or hold it by springs, "
            'have no card along global axes; export with "clamped", "pinned" or "free" edges, or a flat plate'
        )
    return int(along.argmax())


def _held(target: Target) -> Iterator[HeldNodes]:
    """Sets of nodes by the freedoms that are held, in global axes."""
    supports, groups = target.supports, {}
    for node in np.flatnonzero(supports.held):
        bits = int(supports.held[node])
        freedoms = [False] * 6
        for start, held in ((0, bits & 7), (3, bits >> 3)):
            if held == 7:
                freedoms[start : start + 3] = [True] * 3
                continue
            for local in range(3):
                if held >> local & 1:
                    freedoms[start + _global_axis(supports.axes[node][local])] = True
        groups.setdefault(tuple(freedoms), []).append(int(node))
    for freedoms, nodes in groups.items():
        yield HeldNodes(np.array(nodes), freedoms)


def _springs(target: Target, step: float) -> Iterator[SupportSprings]:
    """Springs by their stiffnesses, which differ between sides and corners."""
    supports, groups = target.supports, {}
    for node, normal, (in_plane, transverse, rotation) in zip(
        supports.nodes, supports.normal, supports.springs, strict=True
    ):
        if in_plane == transverse == rotation == 0.0:
            continue
        along = [in_plane] * 3
        if in_plane != transverse:
            along[_global_axis(normal)] = transverse
        key = tuple(float(f"{value:.12g}") for value in (*along, rotation))
        groups.setdefault(key, []).append(int(node))
    for (kx, ky, kz, rotation), nodes in groups.items():
        stiffest = max(kx, ky, kz)
        mass, inertia = stiffest * step**2, rotation * step**2
        yield SupportSprings(np.array(nodes), (kx, ky, kz), rotation, mass or inertia, inertia or mass * 1e-6)


def _shell_step(target: Target, parts: tuple[ShellPart, ...]) -> float:
    """A stable step [s] of the smallest shell: its shortest side over its fastest wave."""
    steps = []
    for part in parts:
        young, density = getattr(part.material, "young", 2e11), getattr(part.material, "density", 7850.0)
        poisson = getattr(part.material, "poisson", 0.3)
        corners = target.x[part.quads]
        sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
        steps.append(sides[sides > 0.0].min() / math.sqrt(young / density / (1.0 - poisson**2)))
    return STEP_SHARE * min(steps)


def _contacts(parts: tuple[ShellPart, ...], skin: float) -> Iterator[ContactPair]:
    """A contact for each thickness, since the gap is the part's."""
    for thickness in dict.fromkeys(part.thickness for part in parts):
        numbers = tuple(i for i, part in enumerate(parts) if part.thickness == thickness)
        yield ContactPair(numbers, thickness, 0.5 * thickness + skin)


def _sensors(case: Case, target: Target, bird: BirdBody) -> tuple[tuple[SensorOutput, ...], tuple[str, ...]]:
    """What is recorded for the case's sensors, and those for which a code has nothing."""
    plane = case.struck_plane
    against = np.array([0.0, 0.0, -1.0]) if plane is None else -plane.normal
    run: Any = SimpleNamespace(plate=target, bird=bird, against=against)
    found, missing = [], []
    order = _element_numbers(case, target)
    for name, sensor in case.sensors.items():
        output = _output(name, sensor, run, order)
        if output is None:
            aside = ", along a direction of its own," if getattr(sensor, "along", None) is not None else ""
            missing.append(f"{name} ({sensor.kind}){aside} is no output of another code: it is not recorded")
        else:
            found.append(output)
    return tuple(found), tuple(missing)


def _element_numbers(case: Case, target: Target) -> Numbers:
    """Number of each facet in the deck, where the elements stand part by part."""
    order = np.arange(len(target.quads))
    if case.target is not None:
        order[np.concatenate(list(target.mesh.parts.values()))] = np.arange(len(target.quads))
    return order


def _output(name: str, sensor: Sensor, run: Any, order: Numbers) -> SensorOutput | None:
    target: Target = run.plate
    if sensor.kind == "contact_force":
        return SensorOutput(name, sensor.kind, sensor.unit, np.empty(0, np.int64), np.empty(0), run.against)
    if isinstance(sensor, ReactionForce):
        if sensor.along is not None:  # codes differ in the sign of a reaction, which is told by its impulse in the push
            return None
        rows = target.supports.nodes
        if sensor.support is not None:
            rows = rows[target.supports.sets[sensor.support]]
        nodes = np.unique(rows)
        return SensorOutput(name, sensor.kind, sensor.unit, nodes, np.ones(len(nodes)), run.against)
    if sensor.kind not in ("displacement", "strain") or not isinstance(sensor, Placed):
        return None
    element, xi, eta = sensor.located(run)
    if sensor.kind == "strain":
        assert isinstance(sensor, Strain), "the registry's kind has one class"
        toward, side = sensor.laid(target.mesh), float(sensor.face(target.mesh))
        gauge = (np.empty(0, np.int64), np.empty(0), toward, int(order[element]), side)
        return SensorOutput(name, sensor.kind, sensor.unit, *gauge)
    weights = np.array(bilinear(xi, eta))
    merged: dict[int, float] = {}
    for node, weight in zip(target.quads[element], weights, strict=True):
        merged[int(node)] = merged.get(int(node), 0.0) + float(weight)
    kept = {node: weight for node, weight in merged.items() if abs(weight) > SMALLEST_SHARE}
    along = getattr(sensor, "along", None)
    direction = run.against if along is None else np.array(along) / np.linalg.norm(along)
    return SensorOutput(name, sensor.kind, sensor.unit, np.array([*kept]), np.array([*kept.values()]), direction)
