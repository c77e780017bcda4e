"""Uncertain quantities of the impact that a case states under `inversion.nuisance`, and where their values stand."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Protocol

from birdstrike.solver.case.sections import quantity_at
from birdstrike.solver.case.settings import NUISANCE
from birdstrike.solver.effects.effect import Declared


class Inverted(Declared, Protocol):
    """A case as far as its uncertain quantities are concerned."""

    @property
    def inversion(self) -> Any:
        """Section `inversion`."""
        ...


@dataclass(frozen=True)
class Nuisance:
    """An uncertain quantity of the impact: its name in the case, dotted key, value and standard deviation, SI."""

    name: str
    key: str
    value: float
    sigma: float


def case_nuisances(case: Inverted) -> tuple[Nuisance, ...]:
    """Those of `inversion.nuisance` that are quantities of the impact and are not themselves sought."""
    sigmas = {name: sigma for name, sigma in case.inversion.nuisance.items() if name != "time_offset" and sigma > 0.0}
    found = (_nuisance(case, name, sigma) for name, sigma in sigmas.items())
    return tuple(nuisance for nuisance in found if nuisance.key not in case.inversion.parameters)


def _nuisance(case: Inverted, name: str, sigma: float) -> Nuisance:
    if name == "mass" and case.bird.mass is None:  # a bird given by its density
        density = case.bird.actual_density
        return Nuisance(name, "bird.density", density, sigma * density / case.bird.actual_mass)
    struck = "plate" if case.target is None else f"target.parts.{case.target.struck_name}"
    places = {
        "speed": ("impact.speed", case.impact.speed),
        "mass": ("bird.mass", case.bird.mass),
        "thickness": (f"{struck}.thickness", case.plate.thickness),
        "angle": ("impact.angle", case.impact.angle),
    }
    key, value = places[name]
    return Nuisance(name, key, float(value or 0.0), sigma)


def beyond_their_ranges(case: Inverted) -> Iterator[str]:
    """One line for each that is no case at a standard deviation on either side, where an inversion simulates it."""
    for one in case_nuisances(case):
        mark, stated = quantity_at(one.key), NUISANCE[one.name]
        if mark is None:
            continue
        low, high = mark.bounds
        if low <= one.value - one.sigma and one.value + one.sigma <= high:
            continue
        remedy = "state a smaller one, or leave it out"
        if one.name == "angle" and one.value + one.sigma > high:
            remedy = "leave it out: no angle is beyond that of a normal impact"
        yield (
            f"inversion.nuisance.{one.name} = {stated.display(case.inversion.nuisance[one.name])}: {one.key} = "
            f"{mark.display(one.value)} and a standard deviation more or less leave {mark.low} .. {mark.high}; {remedy}"
        )
