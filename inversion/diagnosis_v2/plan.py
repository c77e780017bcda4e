"""Which simulations a diagnosis needs: a coarse campaign, a few fine ones of its points, and designs over the effects.

The campaign may be coarser than the case, because a mesh correction carries its curves to a fine mesh (co-kriging:
Kennedy & O'Hagan, Biometrika 87 (2000) 1). Two-sided effects are varied together by a folded-over two-level design (Box,
Hunter & Hunter, Statistics for Experimenters, 2nd ed. 2005, ch. 6): half the difference of a pair at one point of the
campaign holds no even term and no error of the emulator. One-sided effects are varied alone, because the middle of
their range is another rig.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import hadamard
from scipy.spatial.distance import cdist

from birdstrike.data.histories import Array
from birdstrike.doe.external.deck import uncarried
from birdstrike.doe.designs.registry import make_design
from birdstrike.doe.designs.space import ParameterSpace
from birdstrike.inversion.diagnosis_v2.candidate_sensors import with_probes
from birdstrike.solver.case.case import Case
from birdstrike.solver.effects.effect import Effect
from birdstrike.solver.effects.registry import effects

COARSE_PARTICLES, COARSEST_SHELLS = 1000, 12
"""Particles of the campaign (a quarter of a second a particle-millisecond is bought here), least shells a side."""
FINER_PARTICLES, FINER_SHELLS = 8, 2  # half the spacing in bird and plate, so that Richardson's argument applies
RUNS, FINE_RUNS = 25, 10  # campaign; fine simulations: two parameters' linear trend and seven degrees of freedom
LEVEL = 2.0  # plausible sizes of a two-sided effect in the design: large beside the particles' scatter, still linear
GENTLER = {"plate_preload": 0.5}
"""Plausible sizes where LEVEL leaves the linear range: a fifth of the buckling load is the size of a preload, and the
first frequency's square changes by a tenth at half of that (Leissa 1969, sect. 10.4)."""
ONE_SIDED = ((1.0, 0), (3.0, 0), (3.0, 1), (3.0, 2), (3.0, 3))
"""(plausible sizes, number of the point): how the response bends, and its mean over four points: two would leave a
signature of friction a third of a run's scatter, which is as large as the signature."""
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

    case: as declared; coarse, fine: the case on the two meshes, with the candidate sensors; space: the parameters;
    unit: (n, k) the campaign's points as fractions of the ranges; spread: indices of the points, most spread first;
    known: effects by simulation; refused: effect -> why the case cannot carry it; signs: (pairs, effects) two-level
    design of the two-sided effects.
    """

    case: Case
    coarse: Case
    fine: Case
    space: ParameterSpace
    unit: Array
    spread: tuple[int, ...]
    known: tuple[Known, ...]
    refused: Mapping[str, str]
    signs: Array

    @property
    def two_sided(self) -> tuple[Known, ...]:
        """Effects in the order of the design's columns."""
        return tuple(one for one in self.known if not one.one_sided)

    @property
    def one_sided(self) -> tuple[Known, ...]:
        """Effects varied alone."""
        return tuple(one for one in self.known if one.one_sided)

    def at(self, base: Case, point: int) -> Case:
        """A case with the parameters of a point of the campaign."""
        return base.with_values(self.values(self.unit[point]))

    def values(self, unit: Array) -> dict[str, float]:
        """SI values by dotted key of fractions (k,) of the ranges."""
        return dict(zip(self.space.names, map(float, self.space.to_physical(unit[None])[0]), strict=True))

    def pair_point(self, pair: int) -> int:
        """Point of the campaign at which a pair of the two-level design stands."""
        return self.spread[pair % len(self.spread)]

    def near_centre(self, number: int) -> int:
        """The campaign's points by their distance from the middle of the ranges."""
        return int(np.argsort(((self.unit - 0.5) ** 2).sum(axis=1), kind="stable")[number])

    def campaign(self) -> dict[str, Case]:
        """The coarse campaign."""
        return {f"coarse {i}": self.at(self.coarse, i) for i in range(len(self.unit))}

    def fine_points(self) -> tuple[int, ...]:
        """Points of the campaign that are simulated on the fine mesh."""
        return self.spread[:FINE_RUNS]

    def meshes(self) -> dict[str, Case]:
        """The fine simulations."""
        return {f"fine {i}": self.at(self.fine, i) for i in self.fine_points()}

    def responses(self) -> dict[str, Case]:
        """The simulations with effects."""
        cases: dict[str, Case] = {}
        for pair, row in enumerate(self.signs):
            base = self.at(self.coarse, self.pair_point(pair))
            for sign in (1, -1):
                own = {k.name: sign * s * level(k) * k.size for k, s in zip(self.two_sided, row, strict=True)}
                cases[f"pair {pair} {sign:+d}"] = base.with_effects({**base.effects, **own})
        for one in self.one_sided:
            for b, point in ONE_SIDED:
                base = self.at(self.coarse, self.near_centre(point))
                cases[f"{one.name} {b:g} {point}"] = base.with_effects({**base.effects, one.name: b * one.size})
        return cases


def level(known: Known) -> float:
    """Plausible sizes by which an effect is moved in the two-level design."""
    return min(GENTLER.get(known.name, LEVEL), 0.5 * abs(known.least))


def make_plan(case: Case, runs: int = RUNS, seed: int = 0) -> Plan:
    """The plan of a case."""
    probed = with_probes(case)
    coarse, fine = meshes(probed)
    space = ParameterSpace.of(case.parameters())
    unit = make_design("uniform", space, runs, seed).unit
    known, refused = library(case)
    columns = sum(not one.one_sided for one in known)
    return Plan(case, coarse, fine, space, unit, spread(unit), known, refused, two_level(columns))


def meshes(case: Case) -> tuple[Case, Case]:
    """The case on the campaign's mesh and on the fine one, never coarser than declared."""
    if case.solver.name == "external":
        return case, case
    particles = min(case.bird.particles, COARSE_PARTICLES)
    shells = [max(min(n, COARSEST_SHELLS), math.ceil(n / FINER_SHELLS)) for n in case.plate.elements]
    finest = max(FINER_PARTICLES * particles, case.bird.particles)
    finer = [max(FINER_SHELLS * n, declared) for n, declared in zip(shells, case.plate.elements, strict=True)]
    return case.with_mesh(particles, (shells[0], shells[1])), case.with_mesh(finest, (finer[0], finer[1]))


def library(case: Case) -> tuple[tuple[Known, ...], dict[str, str]]:
    """Effects that take a simulation and that the case can carry, and why it cannot carry the others."""
    known, refused = [], dict[str, str]()
    for name, effect in effects().items():
        if name in INSTRUMENT:
            continue
        if reason := effect.refuses(case) or _declared(case, name) or uncarried(case, name):
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


def spread(unit: Array) -> tuple[int, ...]:
    """Indices of points (n, k): the one nearest the middle, then always the one farthest from those chosen."""
    chosen = [int(((unit - 0.5) ** 2).sum(axis=1).argmin())]
    distances = cdist(unit, unit)
    while len(chosen) < len(unit):
        nearest = distances[:, chosen].min(axis=1)
        chosen.append(int(nearest.argmax()))
    return tuple(chosen)


def labelled(cases: Sequence[Mapping[str, Case]]) -> dict[str, Case]:
    """Several sets of cases as one."""
    return {label: case for part in cases for label, case in part.items()}
