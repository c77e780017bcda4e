"""Which simulations a diagnosis needs: a coarse campaign, a few fine ones of its points, and designs over the effects.

The campaign may be coarser than the case, because a mesh correction carries its curves to a fine mesh (co-kriging:
Kennedy & O'Hagan, Biometrika 87 (2000) 1). Effects are varied together by a folded-over two-level design (Box, Hunter &
Hunter, Statistics for Experimenters, 2nd ed. 2005, ch. 6): half the difference of a pair at one point of the campaign
holds no even term and no error of the emulator. A one-sided effect is absent in one half and present in the other.
"""

from __future__ import annotations

import math
from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import hadamard

from birdstrike.data.histories import Array
from birdstrike.doe.designs.registry import make_design
from birdstrike.doe.designs.space import ParameterSpace
from birdstrike.doe.external.deck import unsupported_by_deck
from birdstrike.inversion.estimation.mesh_correction import FINE_RUNS, FINER_SHELLS, fine_mesh, spread
from birdstrike.solver.case.case import Case
from birdstrike.solver.effects.effect import Effect
from birdstrike.solver.effects.registry import effects

COARSE_PARTICLES, COARSEST_SHELLS = 1000, 12
"""Particles of the campaign (a quarter of a second a particle-millisecond is bought here), least shells a side."""
RUNS = 25  # of the campaign
RESPONSE_PARTICLES = 3000  # of the simulations with effects: friction drowns in the scatter of a bird of 1000 particles
LATTICES = 4  # fine simulations that are repeated on the other lattice
OTHER_LATTICE = {"fcc": "cubic", "cubic": "fcc"}
JITTER = 0.1  # of the spacing: each pair of the design has a lattice of its own, so that their mean has none
LEVEL = 2.0  # plausible sizes of an effect in the design: large beside the particles' scatter, still linear
GENTLER = {"plate_preload": 0.5}
"""Plausible sizes where LEVEL leaves the linear range: a fifth of the buckling load is the size of a preload, and the
first frequency's square changes by a tenth at half of that (Leissa 1969, sect. 10.4)."""
INSTRUMENT = ("time_offset", "sensor_gain", "sensor_bandwidth", "sensor_drift")
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


@dataclass(frozen=True)
class Plan:
    """Cases to simulate by label.

    case: as declared; coarse, fine, response: the case on the meshes of the
    campaign, of the correction and of the design over the effects, with the candidate sensors; space: the parameters;
    unit: (n, k) the campaign's points as fractions of the ranges; spread: indices of the points, most spread first;
    known: effects by simulation; refused: effect -> why the case cannot carry it; signs: (pairs, effects) two-level
    design.
    """

    case: Case
    coarse: Case
    fine: Case
    response: Case
    space: ParameterSpace
    unit: Array
    spread: tuple[int, ...]
    known: tuple[Known, ...]
    refused: Mapping[str, str]
    signs: Array

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
        """A case on a lattice of its own, so that the mean of several has none; another program keeps its bird."""
        if case.solver.name == "external":
            return case
        return case.overlaid({"bird": {"jitter": JITTER, "seed": number}})

    def responses(self) -> dict[str, Case]:
        """The simulations with effects: both halves of each pair of the design at one point, on one lattice."""
        cases: dict[str, Case] = {}
        for pair, row in enumerate(self.signs):
            base = self.on_lattice(self.at(self.response, self.pair_point(pair)), pair)
            for sign in (1, -1):
                own = {k.name: magnitude(k, sign * s) * k.size for k, s in zip(self.known, row, strict=True)}
                cases[f"pair {pair} {sign:+d}"] = base.with_effects(
                    {**base.effects, **{n: b for n, b in own.items() if b}}
                )
        return cases


def magnitude(known: Known, code: float) -> float:
    """Plausible sizes of a code of the two-level design: -L, L; 0 and L of a one-sided effect."""
    return (0.5 * (1.0 + code) if known.one_sided else code) * level(known)


def slope(known: Known) -> float:
    """Plausible sizes by which half the difference of a pair moves an effect."""
    return (0.5 if known.one_sided else 1.0) * level(known)


def level(known: Known) -> float:
    """Plausible sizes of an effect in the design."""
    top = GENTLER.get(known.name, LEVEL)
    return top if known.one_sided else min(top, 0.5 * abs(known.least))


def make_plan(case: Case, runs: int = RUNS, seed: int = 0) -> Plan:
    """The plan of a case."""
    probed = with_probes(case)
    coarse, fine = meshes(probed)
    space = ParameterSpace.of(case.parameters())
    unit = make_design("uniform", space, runs, seed).unit
    known, refused = library(case)
    own = coarse
    if case.solver.name != "external":
        own = coarse.with_mesh(
            min(max(case.bird.particles, COARSE_PARTICLES), RESPONSE_PARTICLES), coarse.plate.elements
        )
    return Plan(case, coarse, fine, own, space, unit, spread(unit), known, refused, two_level(len(known)))


def meshes(case: Case) -> tuple[Case, Case]:
    """The case on the campaign's mesh and on the fine one, never coarser than declared."""
    if case.solver.name == "external":
        return case, case
    particles = min(case.bird.particles, COARSE_PARTICLES)
    shells = [max(min(n, COARSEST_SHELLS), math.ceil(n / FINER_SHELLS)) for n in case.plate.elements]
    coarse = case.with_mesh(particles, (shells[0], shells[1]))
    return coarse, fine_mesh(coarse, case)


def library(case: Case) -> tuple[tuple[Known, ...], dict[str, str]]:
    """Effects that take a simulation and that the case can carry, and why it cannot carry the others."""
    known, refused = [], dict[str, str]()
    for name, effect in effects().items():
        if name in INSTRUMENT:
            continue
        if reason := effect.refuses(case) or _declared(case, name) or unsupported_by_deck(case, name):
            refused[name] = reason
            continue
        size = effect.size(case)
        known.append(Known(effect, size, max(effect.least(case) / size, -WIDEST) + 0.0))
    return tuple(known), refused


def _declared(case: Case, name: str) -> str:
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


PREFIX = "probe_"
PLACES = {"centre": (0.0, 0.0), "fore": (0.25, 0.0), "aft": (-0.25, 0.0), "side": (0.0, 0.25), "corner": (0.25, 0.25)}
"""Place's name -> shares of length and width from the plate's centre."""


def with_probes(case: Case) -> Case:
    """The case with every candidate sensor that it does not have; the strike itself is not touched.

    An external solver writes what its deck asks for, and nothing more.
    """
    if case.solver.name == "external":
        return case
    return case.with_sensors(candidates(case))


def candidates(case: Case) -> dict[str, Any]:
    """Tables of the candidate sensors."""
    found: dict[str, Any] = {}
    taken = {(sensor.kind, tuple(round(x, 4) for x in sensor.place or ())) for sensor in case.sensors.values()}
    for name, (along, across) in PLACES.items():
        place = (along * case.plate.length, across * case.plate.width)
        at = [f"{1e3 * x:.6g} mm" for x in place]
        if ("displacement", (round(place[0], 4), round(place[1], 4))) not in taken and not case.plate.rigid:
            found[f"{PREFIX}displacement_{name}"] = {"kind": "displacement", "at": at}
    for name in ("centre", "fore", "side") if not case.plate.rigid else ():
        place = (PLACES[name][0] * case.plate.length, PLACES[name][1] * case.plate.width)
        at = [f"{1e3 * x:.6g} mm" for x in place]
        if ("strain", (round(place[0], 4), round(place[1], 4))) not in taken:
            found[f"{PREFIX}strain_{name}"] = {"kind": "strain", "at": at}
    kinds = {sensor.kind for sensor in case.sensors.values()}
    if "reaction_force" not in kinds:
        found[f"{PREFIX}reaction_force"] = {"kind": "reaction_force"}
    return found
