"""Which simulations a diagnosis needs: a coarse campaign, a few fine ones of its points, and designs over the effects.

The campaign may be coarser than the case, because a mesh correction carries its curves to a fine mesh (co-kriging:
Kennedy & O'Hagan, Biometrika 87 (2000) 1). Effects are varied together by a folded-over two-level design (Box, Hunter &
Hunter, Statistics for Experimenters, 2nd ed. 2005, ch. 6): half the difference of a pair at one point of the campaign
holds no even term and no error of the emulator. A one-sided effect is absent in one half and present in the other, and
one of which little can be taken away is nearly so.

Candidate sensors: places on the target at which no sensor stands, simulated beside the case's own.

What an effect would change there tells which sensor to add (`conclusions.next_measurement`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Container, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.linalg import hadamard

from birdstrike.data.errors import UserError
from birdstrike.data.histories import Array
from birdstrike.doe.designs.registry import make_design
from birdstrike.doe.designs.space import ParameterSpace
from birdstrike.doe.external.deck import unsupported_by_deck
from birdstrike.inversion.estimation.mesh_correction import FINE_RUNS, FINER_SHELLS, fine_mesh, spread
from birdstrike.inversion.estimation.prior import NormalPrior
from birdstrike.solver.build import Outline, outline_of, rest_mesh
from birdstrike.solver.case.case import Case
from birdstrike.solver.effects.effect import Effect
from birdstrike.solver.effects.registry import effect_named, effects_of
from birdstrike.solver.sensors.displacement import Displacement
from birdstrike.solver.sensors.places import point_at
from birdstrike.solver.sensors.reaction_force import ReactionForce
from birdstrike.solver.sensors.sensor import Placed, Sensor

PREFIX = "probe_"
PLACES = {"centre": (0.0, 0.0), "fore": (0.25, 0.0), "aft": (-0.25, 0.0), "side": (0.0, 0.25), "corner": (0.25, 0.25)}
"""Place's name -> shares of length and width from the middle of what is struck."""
STRAINS = ("centre", "fore", "side")
TOO_NEAR = 0.02  # of length and width: a sensor that near to one of its kind shows nothing new


def with_candidate_sensors(case: Case) -> Case:
    """The case with every candidate sensor that it does not have; the strike itself is not touched.

    An external solver writes what its deck asks for, and nothing more.
    """
    if case.solver.name == "external":
        return case
    return _with_own_instruments(case).with_sensors(candidate_sensors(case))


def _with_own_instruments(case: Case) -> Case:
    """The case with what its effects make of its sensors' instruments written there, so that they stay these sensors'.

    The effects act on displacements where there are any, so that a case of strains would lose them to the
    candidates. The clock is that of all sensors.
    """
    faults = {name: effect_named(name).fault for name in case.effects}
    own = {name: case.effects[name] for name, fault in faults.items() if fault is not None and not fault.common}
    if not own:
        return case
    rest = case.with_effects({name: x for name, x in case.effects.items() if name not in own})
    table: dict[str, dict[str, Any]] = {}
    for name, x in own.items():
        for sensor, settings in effect_named(name).change(rest, x).get("instrument", {}).items():
            table.setdefault(sensor, {}).update(settings)
    return rest.overlaid({"instrument": table})


def _has(case: Case, kind: str, place: Array, outline: Outline) -> bool:
    """Whether the case has a sensor of that kind at a place, or so near that another one would be the same again."""
    own = [_seen(case, sensor, outline) for sensor in case.sensors.values() if sensor.kind == kind]
    return any(one is not None and bool((np.abs(one - place) <= TOO_NEAR * outline.sides).all()) for one in own)


def _seen(case: Case, sensor: Sensor, outline: Outline) -> Array | None:
    """Where a sensor sits in the outline's axes, (2,) [m]; None for one that has no place."""
    if outline.plane is None or not isinstance(sensor, Placed):
        return None if sensor.place is None else np.array(sensor.place[:2])
    mesh = rest_mesh(case)
    return outline.seen(point_at(mesh, *sensor.on(mesh)))[:2]


def candidate_sensors(case: Case) -> dict[str, Any]:
    """Tables of the candidate sensors, those left out whose place is on no shell of a mesh from a file.

    The places are shares of the outline; where the struck plane lies aslant they are points in space of the shells that
    are met there against its normal, and gauges lie along its length.
    """
    found: dict[str, Any] = {}
    outline = outline_of(case)
    for kind, names in (("displacement", PLACES), ("strain", STRAINS)) if not case.plate.rigid else ():
        for name in names:
            place = outline.middle + np.array(PLACES[name]) * outline.sides
            table = _table(case, place, outline)
            if table is not None and not _has(case, kind, place, outline):
                along = {} if kind != "strain" or outline.plane is None else {"along": outline.plane.axes[0].tolist()}
                found[f"{PREFIX}{kind}_{name}"] = {"kind": kind} | table | along
    if not any(isinstance(sensor, ReactionForce) and sensor.along is None for sensor in case.sensors.values()):
        found[f"{PREFIX}reaction_force"] = {"kind": "reaction_force"}
    return found


def _table(case: Case, place: Array, outline: Outline) -> dict[str, Any] | None:
    """What a sensor at a place (2,) [m] of the outline says of it; None where there is no shell.

    A mesh from a file may have any outline, and holes.
    """
    sensor = {"at": [f"{1e3 * x:.6g} mm" for x in place]}
    if case.mesh_file is None:
        return sensor
    mesh = rest_mesh(case)
    nodes = outline.seen(mesh.nodes)
    laid, there = replace(mesh, nodes=nodes, surface=nodes[:, :2]), Displacement.model_validate(sensor)
    if list(there.misplaced("", laid)):
        return None
    if outline.plane is None:
        return sensor
    facet, xi, eta = there.on(laid)
    point = [f"{x:.6g} mm" for x in (1e3 * point_at(mesh, facet, xi, eta)).round(6) + 0.0]
    return {"point": point, "part": mesh.part_of(facet)}


COARSE_PARTICLES, COARSEST_SHELLS = 1000, 12
"""Particles of the campaign, and the least number of shells a side."""
RUNS = 25  # of the campaign
RESPONSE_PARTICLES = 3000  # at most, of the simulations with effects: friction drowns in the scatter of 1000
LATTICES = 4  # fine simulations that are repeated on the other lattice
OTHER_LATTICE = {"fcc": "cubic", "cubic": "fcc"}
JITTER = 0.1  # of the spacing: each pair of the design has a lattice of its own, so that their mean has none
OF_ONE_SEED, SEEDS = 1000, 2_000_000  # lattices of one seed of a plan, and seeds with lattices of their own
WIDEST = 5.0  # plausible sizes up to which an effect of the solver is looked for


@dataclass(frozen=True)
class Known:
    """An effect that the case can carry. size: its plausible magnitude, SI; least: smallest magnitude in sizes."""

    effect: Effect
    size: float
    least: float

    @property
    def name(self) -> str:
        """Name in a case."""
        return self.effect.name

    @property
    def one_sided(self) -> bool:
        """Whether 0 is the smallest magnitude."""
        return self.least >= 0.0

    @property
    def ends(self) -> bool:
        """Whether nothing can lie below the smallest magnitude, which is else only the smallest that is looked for."""
        return self.least > -WIDEST


@dataclass(frozen=True)
class Block:
    """Effects that are varied together on one mesh. base: the case on it; signs: (pairs, effects) two-level design."""

    base: Case
    known: tuple[Known, ...]
    signs: Array

    def label(self, pair: int, sign: int) -> str:
        """Of one half of a pair."""
        return f"pair {pair} {sign:+d} of {self.base.bird.particles} particles"

    def finished(self, labels: Container[str]) -> list[int]:
        """Pairs of which both halves are among the labels."""
        return [i for i in range(len(self.signs)) if all(self.label(i, sign) in labels for sign in (1, -1))]

    def halves(self, pairs: Sequence[int], curve: Callable[[str], Array]) -> Array:
        """(pairs, ...) half the difference of each pair; curve: what a simulation shows, by its label."""
        return np.array([0.5 * (curve(self.label(i, 1)) - curve(self.label(i, -1))) for i in pairs])

    def codes(self, pairs: Sequence[int]) -> Array:
        """(pairs, effects) plausible sizes by which half the difference of each pair moves the effects."""
        return self.signs[list(pairs)] * [slope(known) for known in self.known]


@dataclass(frozen=True)
class Plan:
    """Cases to simulate by label.

    case: as declared; coarse, fine: the case on the meshes of the campaign and of the correction, with the candidate
    sensors; space: the parameters; unit: (n, k) the campaign's points as fractions of the ranges; spread: indices of
    the points, most spread first; blocks: the effects by simulation; refused: effect -> why the case cannot carry it;
    seed: of the points and of the lattices.
    """

    case: Case
    coarse: Case
    fine: Case
    space: ParameterSpace
    unit: Array
    spread: tuple[int, ...]
    blocks: tuple[Block, ...]
    refused: Mapping[str, str]
    seed: int = 0

    @cached_property
    def prior(self) -> NormalPrior:
        """Of the parameters, in fractions of the ranges."""
        return NormalPrior.of(self.case.priors, self.space)

    def block_of(self, effect: str) -> Block:
        """The block in which an effect is."""
        return next(one for one in self.blocks if effect in (known.name for known in one.known))

    def at(self, base: Case, point: int) -> Case:
        """A case with the parameters of a point of the campaign."""
        return base.with_values(self.values(self.unit[point]))

    def values(self, unit: Array) -> dict[str, float]:
        """SI values by dotted key of fractions (k,) of the ranges."""
        return dict(zip(self.space.names, map(float, self.space.to_physical(unit[None])[0]), strict=True))

    def pair_point(self, pair: int) -> int:
        """Point of the campaign at which a pair of the two-level design stands."""
        return self.spread[pair % len(self.spread)]

    def campaign(self) -> dict[str, Case]:
        """The coarse campaign."""
        return {f"coarse {i}": self.at(self.coarse, i) for i in range(len(self.unit))}

    def with_points(self, unit: Array) -> Plan:
        """The plan with more points (n, k) of the campaign; nothing else stands on them."""
        return replace(self, unit=np.vstack([self.unit, unit]))

    def finished(self, labels: Container[str]) -> list[int]:
        """Points of the campaign whose coarse simulation is among the labels."""
        return [i for i in range(len(self.unit)) if f"coarse {i}" in labels]

    def fine_points(self) -> tuple[int, ...]:
        """Points of the campaign that are simulated on the fine mesh."""
        return self.spread[:FINE_RUNS]

    def meshes(self) -> dict[str, Case]:
        """The fine simulations."""
        return {f"fine {i}": self.at(self.fine, i) for i in self.fine_points()}

    def lattices(self) -> dict[str, Case]:
        """The first fine simulations once more, on the other lattice; none of a bird without a lattice.

        Their differences tell what that choice, which is arbitrary, moves: it looks like another bird.
        """
        if self.case.solver.name == "external" or self.case.bird.method != "sph":
            return {}
        other = {"bird": {"lattice": OTHER_LATTICE[self.case.bird.lattice]}}
        points = self.fine_points()[:LATTICES]
        return {f"lattice {i}": self.on_lattice(self.at(self.fine, i).overlaid(other), i) for i in points}

    def on_lattice(self, case: Case, number: int) -> Case:
        """A case on a lattice of its own, so that the mean of several has none; another program keeps its bird.

        By the plan's seed: the points of one parameter alone are the same for every seed.
        """
        if case.solver.name == "external":
            return case
        return case.overlaid({"bird": {"jitter": JITTER, "seed": number + OF_ONE_SEED * (self.seed % SEEDS)}})

    def responses(self) -> dict[str, Case]:
        """The simulations with effects: both halves of each pair of the design at one point, on one lattice."""
        cases: dict[str, Case] = {}
        for block in self.blocks:
            for pair, row in enumerate(block.signs):
                base = self.on_lattice(self.at(block.base, self.pair_point(pair)), pair)
                for sign in (1, -1):
                    own = {k.name: magnitude(k, sign * s) * k.size for k, s in zip(block.known, row, strict=True)}
                    acting = {**base.effects, **{name: b for name, b in own.items() if b}}
                    cases[block.label(pair, sign)] = base.with_effects(acting)
        return cases


def magnitude(known: Known, code: float) -> float:
    """Plausible sizes of a code of the two-level design, -1 or 1."""
    low, high = levels(known)
    return 0.5 * (low + high) + code * slope(known)


def slope(known: Known) -> float:
    """Plausible sizes by which half the difference of a pair moves an effect."""
    low, high = levels(known)
    return 0.5 * (high - low)


def levels(known: Known) -> tuple[float, float]:
    """Plausible sizes of an effect in the design: -L and L, 0 and L of a one-sided effect.

    The lower level is at most half of the least magnitude that means anything. Of an effect of which the case declares
    so little that L cannot be taken away, the upper one stays at L: else its response would drown in the scatter.
    """
    top = known.effect.level
    if known.one_sided:
        return 0.0, top
    low = min(top, 0.5 * abs(known.least))
    return -low, top if abs(known.least) < top else low


def make_plan(case: Case, runs: int = RUNS, seed: int = 0, first: Case | None = None) -> Plan:
    """The plan of a case; first: by whose effects' plausible sizes magnitudes are counted, of several cases."""
    probed = with_candidate_sensors(case)
    coarse, fine = meshes(probed)
    space = ParameterSpace.of(case.parameters())
    unit = make_design("uniform", space, runs, seed).unit
    known, refused = library(case, first or case)
    return Plan(
        case=case,
        coarse=coarse,
        fine=fine,
        space=space,
        unit=unit,
        spread=spread(unit),
        blocks=blocks(case, coarse, known),
        refused=refused,
        seed=seed,
    )


def blocks(case: Case, coarse: Case, known: Sequence[Known]) -> tuple[Block, ...]:
    """Effects by the mesh on which they are simulated: those of a coarse bird's inside on one that resolves them."""
    if case.solver.name == "external":
        return (Block(coarse, tuple(known), two_level(len(known))),)
    least = min(max(case.bird.particles, COARSE_PARTICLES), RESPONSE_PARTICLES)
    found: dict[int, list[Known]] = {}
    for one in known:
        found.setdefault(max(least, one.effect.particles), []).append(one)
    return tuple(
        Block(coarse.with_mesh(particles, coarse.plate.elements), tuple(own), two_level(len(own)))
        for particles, own in sorted(found.items())
    )


def meshes(case: Case) -> tuple[Case, Case]:
    """The case on the campaign's mesh and on the fine one, never coarser than declared."""
    if case.solver.name == "external":
        return case, case
    particles = min(case.bird.particles, COARSE_PARTICLES)
    shells = [max(min(n, COARSEST_SHELLS), math.ceil(n / FINER_SHELLS)) for n in case.plate.elements]
    coarse = case.with_mesh(particles, (shells[0], shells[1]))
    return coarse, fine_mesh(coarse, case)


def library(case: Case, first: Case) -> tuple[tuple[Known, ...], dict[str, str]]:
    """Effects that take a simulation and that the case can carry, and why it cannot carry the others.

    Their sizes are those of the first case of several: one magnitude is then as many sizes in every shot. Raises
    UserError for a size that is not above 0.
    """
    known, refused = [], dict[str, str]()
    for name, effect in effects_of(case).items():
        if effect.fault is not None:
            continue
        if reason := effect.refuses(case) or _declared(case, name) or unsupported_by_deck(case, name):
            refused[name] = reason
            continue
        size = _size(effect, first)
        known.append(Known(effect, size, max(effect.least(case) / size, -WIDEST) + 0.0))
    return tuple(known), refused


def _size(effect: Effect, case: Case) -> float:
    """Plausible magnitude, SI; raises UserError for one of an effect of one's own that is none."""
    size = effect.size(case)
    if not 0.0 < size < math.inf:
        raise UserError(
            f'effect "{effect.name}": its `size` is {size:g} {effect.unit} for the case {case.name} and must be above '
            "0; let it return the magnitude that is plausible there"
        )
    return size


def fits_a_label(name: str) -> bool:
    """Whether an effect's name, with its set of nodes, can stand in a label beside those of others."""
    return "@" not in name and "+" not in name


def _declared(case: Case, name: str) -> str:
    if not fits_a_label(name):
        return "a set of nodes whose name holds @ or + could not be told from shots and pairs in an answer; rename it"
    return "the case states it already" if name in case.effects else ""


def two_level(columns: int) -> Array:
    """(n, columns) signs of a two-level design of resolution III, folded over by its user; n a power of two.

    A column of ones is left to no effect, so that what pairs differ by without any stays visible.
    """
    if not columns:
        return np.zeros((0, 0))
    order = 1 << max(3, math.ceil(math.log2(columns + 3)))
    return np.asarray(hadamard(order), dtype=np.float64)[:, 1 : columns + 1]


def labelled(cases: Sequence[Mapping[str, Case]]) -> dict[str, Case]:
    """Several sets of cases as one."""
    return {label: case for part in cases for label, case in part.items()}
