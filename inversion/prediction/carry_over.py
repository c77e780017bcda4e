"""What was learnt and what of it belongs to another case: of the bird, the rig, the plate, the shot, a sensor.

What the bird's recipe has stays. A support stays with the rig, and what is wrong with a plate with that plate: on
another one it is drawn anew. So is what is wrong with a shot. A sensor's error stays with the same sensor at the same
place.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from birdstrike.data.errors import UserError
from birdstrike.data.formatting import listing, plain, quantity
from birdstrike.inversion.conditions import same_structure
from birdstrike.inversion.diagnosis.preparation.shots import instrument_effects
from birdstrike.inversion.prediction.distance import other_rig
from birdstrike.inversion.prediction.learnt import Explanation, Learnt
from birdstrike.solver.case.case import Case
from birdstrike.solver.case.sections import quantity_at
from birdstrike.solver.effects.registry import effect_named, effects, kind_of

CARRIED, ANEW, DROPPED = "carried", "drawn anew", "left behind"
SAME_PLACE = 1e-6  # m
PLACE = {"at", "point", "noise"}
"""Fields in which one sensor may differ from itself: its place within `SAME_PLACE`, and what is known of its noise."""


@dataclass(frozen=True)
class Carried:
    """One effect of the explanations in the new case.

    label, name: as in the diagnosis; how: carried with its magnitude, drawn anew from a normal distribution of one
    plausible size (`size`, SI), or left behind; sensors: that an instrument's error acts on, empty for an effect of the
    solver; one_sided: whether its magnitude cannot be negative.
    """

    label: str
    name: str
    how: str
    size: float
    sensors: tuple[str, ...]
    one_sided: bool


def carried_effects(learnt: Learnt, case: Case, left_out: Sequence[str] = ()) -> dict[str, Carried]:
    """Every effect of the explanations by its label; raises UserError for one that the case cannot carry.

    left_out: labels or names that are left behind on the user's word; a name without a place takes all its places.
    """
    found: dict[str, Carried] = {}
    known, errors = effects(), list[str]()
    for label, name, size in _members(learnt.explanations):
        if {label, name, kind_of(name)} & set(left_out):
            found[label] = Carried(label, name, DROPPED, size, (), False)
            continue
        if kind_of(name) not in known:
            errors.append(f"effect {name} is not in the library: load the package or script that registers it first")
            continue
        one = _carried(label, name, size, learnt, case)
        if (effect := effect_named(name)).fault is None and (reason := effect.refuses(case)):
            errors.append(
                f"{case.name} cannot carry {label}, which {learnt.folder} found: {reason}; give a case with that part, "
                f"or leave it behind with --leave-behind {label}"
            )
        found[label] = one
    named = {name for one in found.values() for name in (one.label, one.name, kind_of(one.name))}
    unknown = [name for name in left_out if name not in named]
    errors += [
        f"--leave-behind {name}: no explanation holds it; they hold {', '.join(found) or 'no effect'}"
        for name in unknown
    ]
    if errors:
        raise UserError(errors)
    return found


def _members(explanations: Sequence[Explanation]) -> list[tuple[str, str, float]]:
    """Label, name and plausible size of every effect, each once."""
    found = {
        label: (label, name, size)
        for one in explanations
        for label, name, size in zip(one.members, one.effects, one.sizes, strict=True)
    }
    return list(found.values())


def _carried(label: str, name: str, size: float, learnt: Learnt, case: Case) -> Carried:
    effect = effect_named(name)
    if effect.fault is not None and effect.scope == "sensor":
        faults = {one.label: one.sensors for one in instrument_effects(learnt.case, learnt.sensors)}
        there = tuple(s for s in faults.get(label, ()) if s in case.sensors and same_sensor(learnt.case, case, s))
        how = CARRIED if there else DROPPED
        return Carried(label, name, how, size, there, effect.one_sided(case))
    if effect.fault is not None:
        return Carried(label, name, ANEW, size, tuple(case.sensors), False)
    sided = not effect.refuses(case) and effect.one_sided(case)
    if effect.scope == "shot":
        return Carried(label, name, ANEW, size, (), sided)
    if effect.scope == "bird":
        return Carried(label, name, CARRIED, size, (), sided)
    same = _same(effect.scope, learnt, case)
    own = size if same or effect.refuses(case) else effect.size(case)
    return Carried(label, name, CARRIED if same else ANEW, own, (), sided)


def _same(scope: str, learnt: Learnt, case: Case) -> bool:
    """Whether the new case has what an effect of the solver belongs to: the plate, or the rig, with its sensors."""
    if scope == "plate":
        return same_structure(case, learnt.case)
    sensors = learnt.sensors if scope == "sensor" else ()
    there = all(name in case.sensors and same_sensor(learnt.case, case, name) for name in sensors)
    return there and not other_rig(learnt.case, case)


def same_sensor(learnt: Case, case: Case, name: str) -> bool:
    """Whether a sensor of the new case is the one that was learnt: kind, place and what the kind adds."""
    one, other = learnt.sensors.get(name), case.sensors[name]
    if one is None or one.kind != other.kind:
        return False
    if one.model_dump(exclude=PLACE) != other.model_dump(exclude=PLACE):
        return False
    here, there = (getattr(each, "point", None) or each.place or (0.0, 0.0) for each in (one, other))
    return max(abs(a - b) for a, b in zip(here, there, strict=False)) <= SAME_PLACE


def refuse_another_bird(learnt: Learnt, case: Case) -> None:
    """Raise UserError where what stays of the new case's bird is not what the parameters were calibrated with.

    That is its method and its material with the equation of state, less what was sought; its shape, size, mass and mesh
    may be others.
    """
    if all(one.material for one in learnt.explanations):
        return
    sought = {name for one in learnt.explanations if not one.material for name in one.names}
    there, here = _bird(learnt.case), _bird(case)
    differing = [
        key for key in dict.fromkeys([*there, *here]) if key not in sought and _differ(there.get(key), here.get(key))
    ]
    if differing:
        raise UserError(
            f"{key} is {_stated(key, here)} in {case.name} and {_stated(key, there)} in the case that {learnt.folder} "
            f"learnt from: the learnt parameters belong to that bird; give the new case the same {key}"
            for key in differing
        )


def drawn_instead(learnt: Learnt, case: Case) -> list[str]:
    """What a new case states of its bird and what is drawn from the posterior all the same."""
    sought = {name for one in learnt.explanations for name in one.names}
    there, here = _bird(learnt.case), _bird(case)
    return [
        f"{key} is {_stated(key, here)} in {case.name}; it was calibrated, and is drawn from what {learnt.folder} "
        "learnt"
        for key in here
        if key in sought and key in there and _differ(there[key], here[key])
    ]


def _stated(key: str, values: Mapping[str, Any]) -> str:
    """What a case has under a key, a quantity with its unit."""
    value, mark = values.get(key, "absent"), quantity_at(key)
    return quantity(value, mark.unit) if mark is not None and isinstance(value, float) else str(value)


def _bird(case: Case) -> dict[str, Any]:
    """Dotted key -> value, of the bird's method and material."""
    return {"bird.method": case.bird.method} | _flat("bird.material.", case.bird.material.model_dump(mode="python"))


def _flat(prefix: str, content: Mapping[str, Any]) -> dict[str, Any]:
    found = dict[str, Any]()
    for key, value in content.items():
        found |= _flat(f"{prefix}{key}.", value) if isinstance(value, Mapping) else {f"{prefix}{key}": value}
    return found


def _differ(one: Any, other: Any) -> bool:
    if isinstance(one, float) and isinstance(other, float):
        return not np.isclose(one, other, rtol=1e-9, atol=0.0, equal_nan=True)
    return bool(one != other)


def refuse_other_sensors(learnt: Learnt, case: Case) -> list[str]:
    """Warnings about sensors that were not learnt; raises UserError where none of the case's was."""
    shared = [name for name in case.sensors if name in learnt.sensors]
    if not shared:
        raise UserError(
            f"{case.name} has none of the sensors that {learnt.folder} learnt from ({', '.join(learnt.sensors)}), only "
            f"{', '.join(case.sensors)}: the model's error is known for those sensors alone; give the case at least "
            "one of them under sensors"
        )
    elsewhere = [name for name in case.sensors if name not in shared or not same_sensor(learnt.case, case, name)]
    if not elsewhere:
        return []
    one = len(elsewhere) == 1
    subject = "was not learnt from, or sits" if one else "were not learnt from, or sit"
    error = "its model error is that of its" if one else "the model error of each is that of its"
    bands = "its bands are wider than a record of it" if one else "their bands are wider than records of them"
    return [
        f"{listing(list(map(plain, elsewhere)))} {subject} elsewhere: {error} kind of sensor, not of its own record; "
        f"{bands} would make them"
    ]
