"""Laying one case's table over another: what replaces what, and what a new choice makes void."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, cast

from birdstrike.solver.bird.eos.registry import EQUATIONS_OF_STATE
from birdstrike.solver.bird.materials.registry import BIRD_MATERIALS
from birdstrike.solver.effects.registry import effects
from birdstrike.solver.fields import Between

Raw = dict[str, Any]

CHOICES = {("bird", "material"): BIRD_MATERIALS.key, ("bird", "material", "eos"): EQUATIONS_OF_STATE.key}
"""Tables whose keys depend on one of them: where an overlay makes another choice, the base's keys are void."""
SIZES, FROM_MASS = ("diameter", "length"), ("slenderness", "statistics")
IDLE_FOR_RIGID = ("plate.edges", "plate.damping", "plate.preload", "plate.material.failure_strain")
"""What a rigid plate has no use for; its other keys are tolerated, because a case is often made rigid for a trial."""
ONLY_FOR = {
    "sph": ("bird.lattice", "bird.jitter", "bird.seed", "solver.smoothing"),
    "hexahedra": ("solver.hourglass", "solver.hourglass_coefficient", "solver.smallest_step"),
}
"""What only one of the bird's methods has a use for."""
IDLE_FOR_SPHERE = ("impact.yaw", "impact.pitch")
OF_A_FILE = ("mesh", "mesh_unit", "origin", "struck")
"""Keys of a target that go with a mesh from a file."""
OF_ONE_MESH = ("parts", "supports", "ties", "rivets")
"""Tables of a target whose keys are names of its mesh."""
TOLD_TWICE = (("at", "point"), ("at", "part"), ("direction", "along"))
"""Keys of a sensor of which one replaces the other."""
METHOD = "sph"  # where none stands
INSTANT = Between("0 ms", "100 ms")
"""Range and unit of the times of a case."""
ANGLE = Between("1 deg", "90 deg")
"""Of the velocity, from the plate's surface."""
SAME_SLOPE = 1e-9
"""Difference of two slopes that is rounding [rad]."""
CHOOSING = (
    *("bird.slenderness", "bird.statistics", "bird.material", "bird.method", "bird.shape", "plate.rigid"),
    *("target.mesh", "target.generator.kind"),
)
"""Keys whose value makes others void: of several overrides these come first."""


def law_gives_density(bird: Any) -> bool:
    """Whether the bird's equation of state, as its table names it, is one that fixes the density."""
    law = EQUATIONS_OF_STATE.chosen(at(bird, "material.eos"))
    return law is not None and law.gives_density


def size_follows_from_mass(bird: Any) -> bool:
    """Whether a bird's table leaves its size to its mass: by slenderness, statistics, or a sphere's density."""
    if any(at(bird, key) not in (None, False) for key in FROM_MASS):
        return True
    stated = [at(bird, key) is not None for key in ("mass", "density")]
    return all(stated) and at(bird, "shape") == "sphere" and not any(at(bird, key) is not None for key in SIZES)


def at(raw: Any, key: str) -> Any:
    """What stands under a dotted key; None where nothing does."""
    value: Any = raw
    for part in key.split("."):
        value = value.get(part) if isinstance(value, Mapping) else None
    return value


def overlay(base: Raw, over: Mapping[str, Any], place: tuple[str, ...] = ()) -> Raw:
    """`base` with `over` laid on it, table by table; neither is changed."""
    base, over = (base, over) if place else (_effects_apart(base), _effects_apart(over))
    base = base if place else _without_other_mesh(_without_idle(base, over), over)
    over = _with_slope(base, over) if place == ("impact",) else over
    merged = {key: value for key, value in base.items() if key not in _replaced(base, over, place)}
    if not place:
        merged = _without_void_parameters(merged, over)
    for key, value in over.items():
        below = merged.get(key)
        nested = isinstance(value, Mapping) and isinstance(below, dict)
        merged[key] = overlay(cast(Raw, below), value, (*place, key)) if nested else value
    return merged


def by_place(section: Mapping[str, Any]) -> Raw:
    """The section `effects` with `clamp_rotation = { frame = "..." }` as `clamp_rotation.frame`.

    Of effects that may act in one place alone: there the effect without a place is another one, which may stand beside
    it. A place that the section names in both ways is left as it stands.
    """
    known, found = effects(), Raw()
    for name, given in section.items():
        effect = known.get(name)
        placed = isinstance(given, Mapping) and effect is not None and effect.alone is not None
        apart = {f"{name}.{place}": one for place, one in given.items()} if placed else {}
        found |= {name: given} if not placed or apart.keys() & section.keys() else apart
    return found


def _effects_apart(raw: Mapping[str, Any]) -> Raw:
    """The table with every effect of its section `effects` under a key of its own."""
    section = raw.get("effects")
    return {**raw, "effects": by_place(section)} if isinstance(section, Mapping) else dict(raw)


def _replaced(base: Raw, over: Mapping[str, Any], place: tuple[str, ...]) -> set[str]:
    """Keys of the base that `over` makes void."""
    if place == ("bird",):
        return _replaced_size(base, over)
    if place == ("impact",):
        return {"angle"} if over.get("direction") is not None else set()
    if len(place) == 2 and place[0] == "sensors":
        return {one for pair in TOLD_TWICE for one, other in (pair, pair[::-1]) if other in over}
    return set(base) if _chooses_anew(base, over, place) else set()


def _chooses_anew(base: Any, over: Any, place: tuple[str, ...]) -> bool:
    key = CHOICES.get(place, "")
    return isinstance(base, Mapping) and key in base and over.get(key, base[key]) != base[key]


def _replaced_size(base: Raw, over: Mapping[str, Any]) -> set[str]:
    """Of a bird: mass and density replace each other unless the size follows from both; so do the two ways of size."""
    void: set[str] = set()
    if any(key in over for key in FROM_MASS) or size_follows_from_mass({"shape": base.get("shape"), **over}):
        void |= set(SIZES)
    elif any(key in over for key in SIZES):
        void |= set(FROM_MASS)
    if over.get("statistics") or (law_gives_density(over) and not law_gives_density(base)):
        void.add("density")
    kept = {key: value for key, value in base.items() if key not in void}
    by_mass = any(key in {**kept, **over} for key in FROM_MASS) or size_follows_from_mass({**kept, **over})
    if not by_mass and ("mass" in over or "density" in over):
        void |= {"mass", "density"}
    return void


def is_direction(value: Any) -> bool:
    """Whether a value is a direction of the velocity: three finite numbers, the third negative."""
    numbers = isinstance(value, list | tuple) and len(value) == 3 and all(type(c) in (int, float) for c in value)
    return numbers and all(math.isfinite(c) for c in value) and value[2] < 0.0


def slope_of(direction: Any) -> float:
    """Angle of a direction from the plate's surface [rad]."""
    return math.atan2(-direction[2], math.hypot(direction[0], direction[1]))


def _with_slope(base: Raw, over: Mapping[str, Any]) -> Mapping[str, Any]:
    """An impact's table whose angle is the new slope of an inherited direction, the way over the plate kept."""
    direction, angle = base.get("direction"), ANGLE.valid(over.get("angle"))
    if angle is None or "direction" in over or not is_direction(direction):
        return over
    assert direction is not None
    if abs(slope_of(direction) - angle) <= SAME_SLOPE:
        return over
    x, y, _ = map(float, direction)
    along = math.hypot(x, y)
    x, y = (x / along, y / along) if along > 0.0 else (1.0, 0.0)
    return {**over, "direction": [math.cos(angle) * x, math.cos(angle) * y, -math.sin(angle)]}


def _without_idle(base: Raw, over: Mapping[str, Any]) -> Raw:
    """The base without what the overlay makes idle.

    That is what a rigid plate, a sphere or a bird of another method has no use for, and snapshots after the end of a
    simulation that the overlay shortens.
    """
    void: tuple[str, ...] = ()
    if at(over, "plate.rigid") is True and at(base, "plate.rigid") is not True:
        void += IDLE_FOR_RIGID
    if at(over, "bird.shape") == "sphere" and at(base, "bird.shape") != "sphere":
        void += IDLE_FOR_SPHERE
    before, after = (str(at(raw, "bird.method") or METHOD) for raw in (base, over))
    if at(over, "bird.method") is not None and after in ONLY_FOR and after != before:
        void += ONLY_FOR.get(before, ())
    for key in void:
        base = _without(without_key(base, key.split(".")), key)
    return _without_late_snapshots(base, over)


def _without_other_mesh(base: Raw, over: Mapping[str, Any]) -> Raw:
    """The base without the mesh of its target where the overlay gives the other kind, a file or a generator.

    Of its parts, supports, ties and rivets, whose names are those of the mesh, those stay that the overlay names; all
    where it names none. So do sensors on a part or a support.
    """
    target, own = base.get("target"), over.get("target")
    if not isinstance(target, Mapping) or not isinstance(own, Mapping):
        return base
    to_file = "mesh" in own and "generator" not in own and "generator" in target
    to_generator = at(own, "generator.kind") is not None and "mesh" not in own and "mesh" in target
    if not to_file and not to_generator:
        return base
    left = {key: value for key, value in target.items() if key not in (("generator",) if to_file else OF_A_FILE)}
    for key in OF_ONE_MESH:
        if isinstance(left.get(key), Mapping) and isinstance(own.get(key), Mapping):
            left[key] = {name: value for name, value in left[key].items() if name in own[key]}
    base = base | {"target": left}
    given, sensors = base.get("sensors"), over.get("sensors")
    if isinstance(given, Mapping) and isinstance(sensors, Mapping):
        base["sensors"] = {name: one for name, one in given.items() if name in sensors or not _on_a_name(one)}
    return _without(base, "target.generator.") if to_file else base


def _on_a_name(sensor: Any) -> bool:
    """Whether a sensor names a part or a support of its target."""
    return isinstance(sensor, Mapping) and ("part" in sensor or "support" in sensor)


def _without_late_snapshots(base: Raw, over: Mapping[str, Any]) -> Raw:
    """The base without snapshots after the end of a simulation that the overlay shortens and names no snapshots for."""
    before, end = INSTANT.valid(at(base, "time.end")), INSTANT.valid(at(over, "time.end"))
    instants = at(base, "time.snapshots")
    if before is None or end is None or end >= before:
        return base
    if not isinstance(instants, list) or at(over, "time.snapshots") is not None:
        return base
    valid = ((text, INSTANT.valid(text)) for text in instants)
    kept = [text for text, instant in valid if instant is None or instant <= end]
    return base | {"time": dict(base["time"]) | {"snapshots": kept}}


def without_key(table: Any, parts: list[str]) -> Any:
    """The table without what stands under a dotted key, given in parts."""
    first, *rest = parts
    if not isinstance(table, Mapping) or first not in table:
        return table
    left = {key: value for key, value in table.items() if key != first}
    return left | {first: without_key(table[first], rest)} if rest else left


def _without_void_parameters(base: Raw, over: Mapping[str, Any]) -> Raw:
    """The base without the sought parameters of a material or a law that `over` replaces."""
    table, other = base, over
    for depth, name in enumerate(("bird", "material", "eos")):
        table, other = table.get(name), other.get(name)
        if not isinstance(table, Mapping) or not isinstance(other, Mapping):
            return base
        place = ("bird", "material", "eos")[: depth + 1]
        if _chooses_anew(table, other, place):
            return _without(base, ".".join(place) + ".")
    return base


def _without(base: Raw, prefix: str) -> Raw:
    inversion = base.get("inversion")
    sought = inversion.get("parameters") if isinstance(inversion, Mapping) else None
    if not isinstance(inversion, Mapping) or not isinstance(sought, Mapping):
        return base
    kept = {key: value for key, value in sought.items() if not key.startswith(prefix)}
    return base | {"inversion": dict(inversion) | {"parameters": kept}}
