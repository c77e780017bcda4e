"""How far a case lies from what was learnt: in speed, energy, pressure and thickness, and what that does to the error.

The model's error d = P g w, P the peak, is a Gaussian process of unit variance times the amplitude. Between a learnt
shot and the new case its correlation is rho = Matern 5/2 of the distance r,

    r^2 = (ln v'/v / ln 3)^2 + (ln m'/m / ln 4)^2 + (ln h'/h / ln 2)^2,

with normal speed v, bird's mass m and thickness h; on another rig rho = 0. Outside what was learnt it grows: what the
data leave of its standard deviation is (1 + q) times as large, q the distance, measured in the same way, to the nearest
end of the range. The lengths are choices, by a factor of 8 or 9 in what the plate feels: a factor of 3 in speed changes
pressure and energy by 9, of 2 in thickness the bending stiffness by 8.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from birdstrike.data.formatting import quantity
from birdstrike.data.histories import Array
from birdstrike.inversion.conditions import conditions
from birdstrike.inversion.diagnosis.preparation.discrepancy import matern52
from birdstrike.inversion.prediction.learnt import Learnt, LearntShot
from birdstrike.solver.case.case import Case
from birdstrike.solver.case.target import Target

LENGTHS = {"speed": np.log(3.0), "mass": np.log(4.0), "thickness": np.log(2.0)}
UNITS = {"speed": "m/s", "energy": "J", "pressure": "Pa", "thickness": "m"}
WORDS = {
    "speed": "normal speed",
    "energy": "kinetic energy normal to the plate",
    "pressure": "stagnation pressure",
    "thickness": "thickness",
}
OUTSIDE = 0.01  # relative distance from the range that is worth a sentence


@dataclass(frozen=True)
class Reach:
    """One condition: value of the new case, range of what was learnt, outside: relative distance beyond it, signed."""

    value: float
    low: float
    high: float
    outside: float
    unit: str


@dataclass(frozen=True)
class Distance:
    """reaches: by condition; shots: that were learnt; correlations: (shots,) of the model's error with theirs; between:
    (shots, shots) of theirs among each other; growth: factor on its standard deviation; sentences: what lies outside.
    """

    reaches: dict[str, Reach]
    shots: tuple[LearntShot, ...]
    correlations: Array
    between: Array
    growth: float
    sentences: tuple[str, ...]

    @property
    def correlation(self) -> float:
        """With the nearest shot's."""
        return float(self.correlations.max())

    @property
    def nearest(self) -> LearntShot:
        """The shot whose error is most alike."""
        return self.shots[int(self.correlations.argmax())]


def distance(learnt: Learnt, case: Case) -> Distance:
    """Of a case from the shots that were learnt."""
    here = conditions(case)
    reaches = {name: _reach(name, here[name], [shot.conditions[name] for shot in learnt.shots]) for name in UNITS}
    places, own = np.array([_place(shot.conditions) for shot in learnt.shots]), _place(here)
    correlations = matern52(np.linalg.norm(places - own, axis=1))
    between = matern52(np.linalg.norm(places[:, None] - places[None], axis=2))
    sentences = [_sentence(name, one) for name, one in _in_order(reaches) if abs(one.outside) > OUTSIDE]
    beyond = _beyond(places, own)
    if other := other_rig(learnt.case, case):
        correlations, beyond = np.zeros(len(places)), max(beyond, 1.0)
        sentences.insert(
            0, f"the structure is another one ({other}): the model's error there is not known from a record"
        )
    return Distance(reaches, learnt.shots, correlations, between, 1.0 + beyond, tuple(sentences))


def other_rig(learnt: Case, case: Case) -> str:
    """What makes the structure another rig than the learnt one's, thickness apart; empty where it is the same."""
    if (case.target is None) != (learnt.target is None):
        return "a plate and an assembly"
    if case.target is not None and learnt.target is not None:
        own, theirs = _but_for_thickness(case.target), _but_for_thickness(learnt.target)
        return ", ".join(f"target.{key}" for key in {**theirs, **own} if own.get(key) != theirs.get(key))
    differing = [
        key for key in ("length", "width", "edges", "rigid") if getattr(case.plate, key) != getattr(learnt.plate, key)
    ]
    if case.plate.material != learnt.plate.material:
        differing.append("material")
    return ", ".join(f"plate.{key}" for key in differing)


def _but_for_thickness(target: Target) -> dict[str, Any]:
    """A target's content without the thickness of the struck part, which is a condition of its own."""
    content = target.content
    del content["parts"][target.struck_name]["thickness"]
    return content


def _mass(where: Mapping[str, float]) -> float:
    speed, energy = where["speed"], where["energy"]
    return 2.0 * energy / speed**2


def _place(where: Mapping[str, float]) -> Array:
    """(3,) speed, mass and thickness in lengths."""
    values = {"speed": where["speed"], "mass": _mass(where), "thickness": where["thickness"]}
    return np.array([np.log(values[name]) / length for name, length in LENGTHS.items()])


def _beyond(places: Array, own: Array) -> float:
    """Distance outside the range that the shots span; places: (shots, 3), own: (3,) in lengths."""
    return float(np.linalg.norm(own - np.clip(own, places.min(axis=0), places.max(axis=0))))


def _reach(name: str, value: float, learnt: Sequence[float]) -> Reach:
    low, high = min(learnt), max(learnt)
    outside = value / high - 1.0 if value > high else value / low - 1.0 if value < low else 0.0
    return Reach(value, low, high, outside, UNITS[name])


def _in_order(reaches: dict[str, Reach]) -> list[tuple[str, Reach]]:
    order = {"speed": 0, "thickness": 1, "energy": 2, "pressure": 3}
    return sorted(reaches.items(), key=lambda entry: order[entry[0]])


def _sentence(name: str, one: Reach) -> str:
    side = "above" if one.outside > 0.0 else "below"
    end = one.high if one.outside > 0.0 else one.low
    many = "the learnt shot" if one.low == one.high else "what was learnt"
    return (
        f"{WORDS[name]} {quantity(one.value, one.unit, 4)} is {100.0 * abs(one.outside):.0f} % {side} {many} "
        f"({quantity(end, one.unit, 4)})"
    )
