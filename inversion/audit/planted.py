"""What is planted: parameters, effects and meshes of virtual experiments, all drawn at random."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import cycle, islice

from numpy.random import Generator

from birdstrike.data.errors import UserError
from birdstrike.inversion.audit.outside import Outside, bolted, second_impact, tumbling, yawed
from birdstrike.solver.build import build_plate
from birdstrike.solver.case.case import Case
from birdstrike.solver.effects.registry import effects
from birdstrike.solver.plate.modes import natural_frequencies
from birdstrike.solver.plate.shell import Plate

CLEAN, SINGLE, PAIR, OUTSIDE = "clean", "single", "pair", "outside"
COUNTS = {CLEAN: 12, SINGLE: 19, PAIR: 4, OUTSIDE: 4}
SMALLEST, LARGEST = 0.8, 3.0  # plausible sizes
OF_BUCKLING = 0.8  # of the buckling load: what a compressed plate is loaded with at most
TRIES = 50
SPARE = 1e-4  # s beyond the declared end, for records that start early


@dataclass(frozen=True)
class Planted:
    """One truth: kind, parameters and effects in SI, the finer mesh, what is outside the library."""

    kind: str
    parameters: Mapping[str, float]
    effects: Mapping[str, float]
    mesh: Mapping[str, str]
    outside: Outside | None = field(default=None)


def draw(case: Case, rng: Generator) -> list[Planted]:
    """All truths of a set, in random order."""
    singles = _different(case, rng, COUNTS[SINGLE])
    pairs = [_several(case, rng, 2) for _ in range(COUNTS[PAIR])]
    kinds = [(CLEAN, {}) for _ in range(COUNTS[CLEAN])]
    kinds += [(SINGLE, one) for one in singles] + [(PAIR, two) for two in pairs]
    found = [Planted(kind, _parameters(case, rng), acting, _mesh(case, rng)) for kind, acting in kinds]
    found += [Planted(OUTSIDE, _parameters(case, rng), {}, _mesh(case, rng), one) for one in _outside(case, rng)]
    return [found[i] for i in rng.permutation(len(found))]


def redraw(case: Case, planted: Planted, rng: Generator) -> Planted:
    """A truth of the same kind, with the same effects at other sizes, in place of one whose strike failed."""
    acting = _bearable(case, tuple(planted.effects), rng)
    anew = {one.name: one for one in _outside(case, rng)}
    outside = anew[planted.outside.name] if planted.outside else None
    return Planted(planted.kind, _parameters(case, rng), acting, _mesh(case, rng), outside)


def _parameters(case: Case, rng: Generator) -> dict[str, float]:
    """Inside the ranges, a twentieth away from their ends."""
    return {p.name: float(p.low + rng.uniform(0.05, 0.95) * (p.high - p.low)) for p in case.parameters()}


def _mesh(case: Case, rng: Generator) -> dict[str, str]:
    """At least twice the particles on another lattice, at least 1.5 times the shells a side."""
    share = rng.uniform(1.5, 1.65)
    shells = [math.ceil(share * n) for n in case.plate.elements]
    return {
        "bird.particles": str(int(rng.uniform(2.0, 2.8) * case.bird.particles)),
        "bird.lattice": "cubic" if case.bird.lattice == "fcc" else "fcc",
        "bird.jitter": "0.05",
        "bird.seed": str(int(rng.integers(1_000_000))),
        "plate.elements": str(shells),
    }


def _different(case: Case, rng: Generator, count: int) -> list[dict[str, float]]:
    """Single effects, each of another name while there are names left."""
    names = _names(case)
    order = [names[i] for i in rng.permutation(len(names))]
    return [_bearable(case, (name,), rng) for name in islice(cycle(order), count)]


def _several(case: Case, rng: Generator, count: int) -> dict[str, float]:
    return _bearable(case, tuple(map(str, rng.choice(_names(case), count, replace=False))), rng)


def _names(case: Case) -> list[str]:
    return [name for name, effect in effects().items() if not effect.refuses(case)]


def _bearable(case: Case, names: tuple[str, ...], rng: Generator) -> dict[str, float]:
    """Sizes and signs of effects, drawn again where the case cannot bear them together."""
    for _ in range(TRIES):
        acting = {name: _magnitude(case, name, rng) for name in names}
        if bears(case, acting):
            return acting
    raise UserError(f"{case.name} cannot bear {', '.join(names)} at {SMALLEST:g} to {LARGEST:g} plausible sizes")


def bears(case: Case, acting: Mapping[str, float]) -> bool:
    """Whether a case with these effects (SI) is valid and its plate well away from buckling.

    Under membrane compression a mode's squared frequency falls in proportion and reaches zero where the plate buckles
    (Timoshenko & Gere, Theory of Elastic Stability, 1961): a fifth of it is left at 80 % of the buckling load.
    """
    try:
        resolved = case.with_effects(acting).resolved()
    except UserError:
        return False
    preload = resolved.plate.preload
    if resolved.plate.rigid or min(preload) >= 0.0:
        return True
    plate = build_plate(resolved)
    unloaded = build_plate(resolved.overlaid({"plate": {"preload": ["0 Pa", "0 Pa"]}}))
    assert isinstance(plate, Plate)
    assert isinstance(unloaded, Plate)
    squared = [float(natural_frequencies(one, 1)[0][0]) ** 2 for one in (plate, unloaded)]
    return squared[0] >= (1.0 - OF_BUCKLING) * squared[1]


def _magnitude(case: Case, name: str, rng: Generator) -> float:
    """Size and sign at random."""
    effect = effects()[name]
    sign = 1.0 if effect.one_sided(case) else float(rng.choice([-1.0, 1.0]))
    return sign * float(rng.uniform(SMALLEST, LARGEST)) * effect.size(case)


def _outside(case: Case, rng: Generator) -> list[Outside]:
    sign = float(rng.choice([-1.0, 1.0]))
    place = (float(rng.uniform(-0.2, 0.2)) * case.plate.length, float(rng.uniform(-0.2, 0.2)) * case.plate.width)
    late = float(rng.uniform(0.4, 0.6)) * case.time.end
    found = [
        bolted(int(rng.integers(3, 6))),
        tumbling(sign * float(rng.uniform(40.0, 120.0))),
        yawed(sign * math.radians(float(rng.uniform(8.0, 20.0)))),
        second_impact(late, float(rng.uniform(1.0, 4.0)), place),
    ]
    return found[: COUNTS[OUTSIDE]]
