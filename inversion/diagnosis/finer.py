"""Strikes that tell the numerical error: finer meshes at several parameters, and single numerical choices changed.

The finer birds are of another lattice than the declared one: on the same lattice they share much of its error, and
the draws would be too small.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.stats import qmc

from birdstrike.data.errors import CaseError
from birdstrike.data.histories import Array
from birdstrike.doe.external.deck import no_place
from birdstrike.inversion.estimation.coordinates import Box, Coordinates
from birdstrike.solver.case.case import Case
from birdstrike.solver.case.overlay import Raw

DRAWS = 10
PARTICLES = (1.5, 2.5)  # times the declared ones
SHELLS = 1.5  # times the declared ones a side
JITTER = 0.05, 0.1  # of the particle spacing
INSIDE = 0.9  # share of the box, about its middle, from which the draws' parameters are taken
ELSEWHERE, AS_MANY = (0.25, 0.75), (1.2, 0.85)  # shares of the box's ranges, times the declared particles
FEWEST, MOST = 100, 200_000  # particles
SHOCK, SMOOTHING = "artificial viscosity halved", "smoothing length 1.1 times"
CHOICES = (SHOCK, SMOOTHING)
SMOOTHEST = 2.5


@dataclass(frozen=True)
class Pair:
    """A strike as declared and on a finer mesh, at parameters theta (k,) SI."""

    theta: Array
    declared: Case
    finer: Case


def pairs(case: Case, coordinates: Coordinates) -> dict[str, Pair]:
    """The draws of the numerical error by name.

    One is left out where the finer case cannot be built; nothing is left where a case has nothing to refine.
    """
    found: dict[str, Pair] = {}
    for i, theta in enumerate(_places(coordinates)):
        declared = case.with_values(dict(zip(coordinates.names, map(float, theta), strict=True)))
        finer = _changed(declared, _finer(case, i))
        if finer is not None:
            found[f"finer mesh {i + 1}"] = Pair(theta, declared, finer)
    return found


def elsewhere(case: Case, coordinates: Coordinates) -> dict[str, Case]:
    """Two more strikes of about the declared cost, by name: off the box's middle to either side, on other lattices."""
    box = _largest(coordinates)
    found: dict[str, Case] = {}
    for i, (share, many) in enumerate(zip(ELSEWHERE, AS_MANY, strict=True)):
        theta = coordinates.theta(box.lows + share * (box.highs - box.lows), box)
        base = case.with_values(dict(zip(coordinates.names, map(float, theta), strict=True)))
        found[f"place {i + 1}"] = _changed(base, {"bird": _lattice(case, many, i)}) or base
    return found


def choices(case: Case, theta: Mapping[str, float]) -> dict[str, Case]:
    """Choice's name -> the case at theta with it changed; those that a case does not have are left out."""
    solver = case.solver
    shock = {"shock_linear": 0.5 * solver.shock_linear, "shock_quadratic": 0.5 * solver.shock_quadratic}
    changes: dict[str, Raw] = {SHOCK: {"solver": shock}}
    if case.bird.method == "sph":
        changes[SMOOTHING] = {"solver": {"smoothing": min(1.1 * solver.smoothing, SMOOTHEST)}}
    base = case.with_values(dict(theta))
    cases = {name: _changed(base, change) for name, change in changes.items()}
    return {name: changed for name, changed in cases.items() if changed is not None}


def _places(coordinates: Coordinates) -> Array:
    """(DRAWS, k) parameters spread over the largest box, SI."""
    box = _largest(coordinates)
    with np.errstate(all="ignore"):
        shares = qmc.Halton(len(box.lows), rng=0).random(DRAWS)
    shares = 0.5 + INSIDE * (shares - 0.5)
    return coordinates.theta(box.lows + shares * (box.highs - box.lows), box)


def _largest(coordinates: Coordinates) -> Box:
    return max(coordinates.boxes, key=lambda b: float(np.prod(b.highs - b.lows)))


def _finer(case: Case, number: int) -> Raw:
    """More particles, more shells a side."""
    share = PARTICLES[0] + (PARTICLES[1] - PARTICLES[0]) * ((0.5 + number * 0.618034) % 1.0)
    plate = {} if case.plate.rigid else {"elements": [max(2, round(SHELLS * n)) for n in case.plate.elements]}
    return {"bird": _lattice(case, share, number), "plate": plate} if plate else {"bird": _lattice(case, share, number)}


def _lattice(case: Case, share: float, number: int) -> dict[str, object]:
    """Another number of particles on the other lattice, disturbed and so lying otherwise each time."""
    bird: dict[str, object] = {"particles": min(max(round(share * case.bird.particles), FEWEST), MOST)}
    if case.bird.method != "sph" or case.solver.name == "external":
        return bird
    other = "cubic" if case.bird.lattice == "fcc" else "fcc"
    return {**bird, "lattice": other, "jitter": JITTER[number % 2], "seed": number + 1}


def unrefined(case: Case, seen: Collection[str]) -> list[str]:
    """A warning where an external solver's deck lets only some of its numerical error be seen; seen: names of that."""
    if case.solver.name != "external":
        return []
    found = f"is known from {', '.join(seen)} alone" if seen else "is not known at all"
    return [
        f"the other solver's numerical error {found}, because its deck has a place for no other numerical choice "
        "(bird.particles, plate.elements, solver.*); what it does to the curves may be taken for an effect"
    ]


def _changed(case: Case, changes: Raw) -> Case | None:
    """The case with keys changed; None where it cannot be built, or where an external solver's deck would not tell."""
    try:
        changed = case.overlaid(changes)
    except CaseError:
        return None
    return None if no_place(case, changed) else changed
