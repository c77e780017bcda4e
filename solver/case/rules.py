"""Rules between the keys of a case: bird, plate, times, sensors, instruments; each reads the text of the file."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from typing import Any

from birdstrike.data.units import ACCEPTED
from birdstrike.solver.bird.eos.registry import EQUATIONS_OF_STATE
from birdstrike.solver.bird.materials.registry import BIRD_MATERIALS
from birdstrike.solver.bird.shape import SHAPES, volume
from birdstrike.solver.case.bird import DENSITY, derived
from birdstrike.solver.case.overlay import (
    FROM_MASS,
    IDLE_FOR_RIGID,
    IDLE_FOR_SPHERE,
    METHOD,
    ONLY_FOR,
    SIZES,
    Raw,
    at,
    is_direction,
    law_gives_density,
    size_follows_from_mass,
    slope_of,
)
from birdstrike.solver.case.plate import STRESS
from birdstrike.solver.case.sections import quantity_at, quantity_in, said, si
from birdstrike.solver.fields import Between
from birdstrike.solver.sensors.instrument import drift_of_some_kind
from birdstrike.solver.sensors.registry import DEFAULT_SENSORS, SENSORS
from birdstrike.solver.sensors.sensor import PlateText, Sensor
from birdstrike.solver.target.generators.interface import closed_panel
from birdstrike.solver.target.generators.registry import GENERATORS
from birdstrike.solver.target.laws.registry import TARGET_LAWS

SNAPSHOT = Between("0 ms", "100 ms")
SLOPES_AGREE = math.radians(0.1)
"""Between an angle and a direction that are both given: what a user's rounding makes of one slope."""
NAMED_TABLES = ("generator", "parts", "materials", "ties", "rivets")
"""Tables of a target without which none of their quantities can be sought."""
SHIFTED = 0.15
"""Share of the spacing by which two particles may each be shifted and still not repel: (1 - 0.7)/2, by
`bird.sph_strength.REPULSION`."""
BIRD_OF = {"sph": "particles", "hexahedra": "hexahedra"}


def idle_rules(raw: Raw) -> Iterator[str]:
    """One line for every key, given or sought, that this plate or this bird has no use for."""
    if at(raw, "plate.rigid") is True:
        for key in IDLE_FOR_RIGID:
            yield from _idle(raw, key, "a rigid plate", "or leave plate.rigid out")
    if at(raw, "bird.shape") == "sphere":
        for key in IDLE_FOR_SPHERE:
            yield from _idle(raw, key, "a sphere", "or choose another bird.shape")
    method = str(at(raw, "bird.method") or METHOD)
    for other, keys in ONLY_FOR.items():
        if method in ONLY_FOR and other != method:
            for key in keys:
                yield from _idle(raw, key, f"a bird of {BIRD_OF[method]}", f'or choose bird.method = "{other}"')


def _idle(raw: Raw, key: str, whom: str, otherwise: str) -> Iterator[str]:
    value, sought = at(raw, key), at(raw, "inversion.parameters")
    if value is not None:
        yield f"{key} = {value} does nothing to {whom}; leave it out, {otherwise}"
    for name in sought if isinstance(sought, dict) else ():
        if name == key or name.startswith(f"{key}."):
            yield f'inversion.parameters."{name}" does nothing to {whom}; leave it out, {otherwise}'


def bird_rules(raw: Raw) -> Iterator[str]:
    """One line for every broken rule about the bird of a case as read from its file."""
    if isinstance(raw.get("bird"), dict):
        for rule in (_size, _density, _length, _material, _jitter):
            yield from rule(raw)
    yield from _sought(raw)


def _given(raw: Raw, keys: tuple[str, ...]) -> list[str]:
    return [key for key in keys if at(raw, f"bird.{key}") not in (None, False)]


def _size(raw: Raw) -> Iterator[str]:
    sizes, from_mass = _given(raw, SIZES), _given(raw, FROM_MASS)
    if sizes and from_mass:
        yield f"bird.{sizes[0]} and bird.{from_mass[0]} are both given; keep one, the other follows"
    if from_mass and at(raw, "bird.mass") is None:
        yield f'bird.{from_mass[0]} needs bird.mass, such as mass = "1.8 kg"'
    slenderness = si(raw, "bird.slenderness")
    if at(raw, "bird.shape") == "sphere" and slenderness not in (None, 1.0):
        yield f"bird.slenderness = {slenderness:g} is no sphere; leave it out"


def _density(raw: Raw) -> Iterator[str]:
    mass, density = at(raw, "bird.mass"), at(raw, "bird.density")
    known = _given(raw, ("statistics",)) or law_gives_density(raw["bird"])
    if _given(raw, FROM_MASS):
        if density is not None and _given(raw, ("statistics",)):
            yield f"bird.density = {density} and bird.statistics are both given; the statistics give the density"
        if density is None and not known:
            yield 'bird.slenderness needs bird.density beside the mass, such as density = "938 kg/m^3"'
        return
    if mass is not None and density is not None and not size_follows_from_mass(raw["bird"]):
        yield f"bird.mass = {mass} and bird.density = {density} are both given; keep one, the shape gives the other"
    if mass is None and density is None and not known:
        yield 'bird.mass or bird.density is missing; give one, such as density = "938 kg/m^3"'
    if mass is not None and density is None:
        yield from _implied_density(raw)


def _implied_density(raw: Raw) -> Iterator[str]:
    """A mass in the bird's volume makes a density that a bird can have."""
    shape, mass, diameter, length = (
        at(raw, "bird.shape"),
        *(si(raw, f"bird.{k}") for k in ("mass", "diameter", "length")),
    )
    if shape == "sphere":
        length = diameter
    if shape not in SHAPES or mass is None or diameter is None or length is None:
        return
    if shape == "hemispherical_cylinder" and length < diameter:
        return  # there is no such shape
    size, (low, high) = volume(shape, diameter, length), DENSITY.bounds
    if not low <= mass / size <= high:
        yield (
            f"bird.mass = {at(raw, 'bird.mass')} in a volume of {1e3 * size:.4g} l makes a density of "
            f"{mass / size:.4g} kg/m^3, beyond {DENSITY.low} .. {DENSITY.high}; correct "
            + ("bird.mass or bird.diameter" if shape == "sphere" else "bird.mass, bird.diameter or bird.length")
        )


def _length(raw: Raw) -> Iterator[str]:
    shape, length, diameter = at(raw, "bird.shape"), si(raw, "bird.length"), si(raw, "bird.diameter")
    found = derived(raw["bird"]) if shape == "hemispherical_cylinder" else {}
    if "length" in found and float(found["length"].split()[0]) < float(found["diameter"].split()[0]):
        yield f"bird.mass = {at(raw, 'bird.mass')} makes a bird shorter than wide; use another shape or slenderness"
    if length is None or diameter is None:
        return
    given = f"bird.length = {at(raw, 'bird.length')}"
    if shape == "hemispherical_cylinder" and length < diameter:
        yield f"{given} is less than the diameter; length is overall, hemispheres included"
    if shape == "sphere" and length != diameter:
        yield f"{given} differs from the sphere's diameter; leave it out"


def _material(raw: Raw) -> Iterator[str]:
    """What the chosen material and its equation of state refuse."""
    for key, kinds in (("bird.material", BIRD_MATERIALS), ("bird.material.eos", EQUATIONS_OF_STATE)):
        table = at(raw, key)
        kind = kinds.chosen(table)
        if kind is not None:
            yield from kind.broken_rules(table, key)


def _jitter(raw: Raw) -> Iterator[str]:
    """Particles with strength repel each other when they clump; shifted farther, they would at rest."""
    kind, jitter = BIRD_MATERIALS.chosen(at(raw, "bird.material")), si(raw, "bird.jitter")
    if kind is not None and kind.body == "strength" and jitter is not None and jitter > SHIFTED:
        yield (
            f"bird.jitter = {jitter:g} shifts particles of a {at(raw, 'bird.material.model')} bird so near to each "
            f"other that they repel before the impact; at most {SHIFTED:g}"
        )


def _sought(raw: Raw) -> Iterator[str]:
    parameters: Any = at(raw, "inversion.parameters")
    for key in parameters if isinstance(parameters, dict) else ():
        if absent := _absent(raw, key):
            yield f'inversion.parameters."{key}" is of {absent}; correct the key, or leave it out'
        elif quantity_in(raw, key) is None and quantity_at(key) is not None:
            yield f'inversion.parameters."{key}" is no key of {_owner(raw, key)}; leave it out'


def _owner(raw: Raw, key: str) -> str:
    """The bird, or the target's generator or law, that the case has chosen and a dotted key would belong to."""
    if key.startswith("bird."):
        return f"the {at(raw, 'bird.material.model')} bird"
    table = key.rpartition(".")[0]
    chosen = [f'{table}.{word} = "{found}"' for word in ("kind", "law") if (found := at(raw, f"{table}.{word}"))]
    return chosen[0] if chosen else table


def _absent(raw: Raw, key: str) -> str:
    """Which table of a sought key the case has not, and what it has instead; empty where it has them all."""
    first, kind, name = [*key.split("."), "", ""][:3]
    other = {"plate": "target", "target": "plate"}.get(first, "")
    if at(raw, first) is None and at(raw, other) is not None:
        return f"a {first}, and the case has a {other}"
    if first != "target" or kind not in NAMED_TABLES or at(raw, "target") is None:
        return ""
    held = at(raw, f"target.{kind}")
    if kind == "generator":
        return "target.generator, and the case has a mesh from a file" if held is None else ""
    names = list(held) if isinstance(held, dict) else []
    return "" if name in names else f"{name}, which is not in target.{kind}: {', '.join(names) or 'none'}"


def broken_rules(raw: Raw) -> Iterator[str]:
    """One line for every broken rule of a case as read from its file."""
    for rule in (bird_rules, idle_rules, _plate_hardening, _panel, _preload, _target, _two_slopes, _times):
        yield from rule(raw)


def _plate_hardening(raw: Raw) -> Iterator[str]:
    young, tangent = si(raw, "plate.material.young"), si(raw, "plate.material.tangent_modulus")
    if young is not None and tangent is not None and tangent >= young:
        text = at(raw, "plate.material.tangent_modulus")
        yield f"plate.material.tangent_modulus = {text} is not below young; megapascals?"


def _panel(raw: Raw) -> Iterator[str]:
    yield from closed_panel(
        si(raw, "plate.length"), si(raw, "plate.radius"), f"plate.radius = {at(raw, 'plate.radius')}"
    )


def _preload(raw: Raw) -> Iterator[str]:
    texts = at(raw, "plate.preload")
    if not isinstance(texts, list) or len(texts) != 2:
        return
    along, across = (STRESS.valid(text) or 0.0 for text in texts)
    given = f"plate.preload = {texts}"
    if (along or across) and (at(raw, "plate.edges") == "free" or si(raw, "plate.edges.in_plane") == 0.0):
        yield f"{given} needs edges that hold it in the plane; clamp or pin them, or give plate.edges.in_plane"
    if along and at(raw, "plate.radius") is not None:
        yield f"{given}: a curved panel cannot hold a tension along its arc without a pressure; leave the first at 0"
    limit = si(raw, "plate.material.yield_stress")
    if limit is not None and math.sqrt(along**2 - along * across + across**2) >= limit:
        yield f"{given} is not below plate.material.yield_stress = {at(raw, 'plate.material.yield_stress')}"


def _target(raw: Raw) -> Iterator[str]:
    """Of a target of several parts: no plate beside it, and the rules of its generator and its laws."""
    if at(raw, "target") is None:
        return
    if at(raw, "plate") is not None:
        yield (
            "plate and target are both given; keep one: a target has its own parts, materials and supports, and a case "
            "with one extends no case with the other"
        )
    generator, materials = at(raw, "target.generator"), at(raw, "target.materials")
    if (kind := GENERATORS.chosen(generator)) is not None:
        yield from kind.broken_rules(generator, "target.generator")
    for name, table in materials.items() if isinstance(materials, dict) else ():
        if (law := TARGET_LAWS.chosen(table)) is not None:
            yield from law.broken_rules(table, f"target.materials.{name}")


def _two_slopes(raw: Raw) -> Iterator[str]:
    """The direction of the velocity and its angle from the surface agree where both are given."""
    direction, angle = at(raw, "impact.direction"), si(raw, "impact.angle")
    if angle is None or not is_direction(direction) or abs(slope_of(direction) - angle) <= SLOPES_AGREE:
        return
    own = f"{math.degrees(slope_of(direction)):.4g} deg"
    yield (
        f"impact.direction = {direction} makes an angle of {own} with the plate, and impact.angle = "
        f"{at(raw, 'impact.angle')} is given too; leave impact.angle out, for the direction gives it, or leave "
        "impact.direction out"
    )


def _times(raw: Raw) -> Iterator[str]:
    end, interval = si(raw, "time.end"), si(raw, "time.output_interval")
    if end is None:
        return
    if interval is not None and interval > 0.5 * end:
        yield (
            f"time.output_interval = {said(raw, 'time.output_interval')} leaves fewer than 3 outputs before time.end = "
            f"{at(raw, 'time.end')}; write at most half of time.end, such as {1e6 * end / 20.0:.3g} us"
        )
    snapshots = at(raw, "time.snapshots")
    early: list[str] = []
    for text in snapshots if isinstance(snapshots, list) else []:
        instant = SNAPSHOT.valid(text)
        if instant is None or instant <= end:
            early.append(f'"{text}"')
            continue
        yield (
            f'time.snapshots: "{text}" is after time.end = {at(raw, "time.end")}; leave it out, such as '
            f"--set time.snapshots='[{', '.join(early)}]'"
        )


def broken_sensor_rules(raw: Raw) -> Iterator[str]:
    """One line for every broken rule about sensors and instruments of a case as read from its file."""
    sensors, plate = raw.get("sensors"), _plate(raw)
    for name, sensor in sensors.items() if isinstance(sensors, dict) else []:
        if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name) or name in ("time", "run") or name.endswith("_sigma"):
            yield f'sensors."{name}" cannot be a column\'s name; use letters, digits and _ (not time, run or ..._sigma)'
        kind = SENSORS.chosen(sensor)
        if kind is not None:
            yield from _column_of_another(name, kind)
            yield from kind.broken_rules(name, sensor, plate)
    yield from _instruments(raw)
    yield from _discrepancies(raw)


def _column_of_another(name: str, kind: type[Sensor]) -> Iterator[str]:
    """A name that ends in a unit, or in _, of a sensor without a unit: its column is the name alone."""
    stem, _, last = name.rpartition("_")
    if stem and last in ACCEPTED and not kind.noise_range.unit:
        read = f'"{stem}" in the unit "{last}"' if last else f'"{name.rstrip("_")}"'
        yield f"sensors.{name}: its column, which has no unit, would be read as that of {read}; use another name"


def _plate(raw: Raw) -> PlateText:
    sizes = {key: si(raw, f"plate.{key}") for key in ("length", "width")}
    return PlateText({key: at(raw, f"plate.{key}") for key in sizes}, sizes, at(raw, "plate.rigid") is True)


def _instruments(raw: Raw) -> Iterator[str]:
    """An instrument belongs to a sensor, and its drift has the unit of that sensor's channel per second."""
    instruments, known = raw.get("instrument"), _kinds(raw)
    for name, own in instruments.items() if isinstance(instruments, dict) else []:
        if name not in known:
            yield f"instrument.{name} belongs to no sensor of the case; its sensors: {', '.join(known)}"
            continue
        kind, drift = known[name], own.get("drift") if isinstance(own, dict) else None
        if kind in SENSORS and drift is not None:
            mark = SENSORS[kind].drift_range
            if mark.valid(drift) is None and drift_of_some_kind(drift) is not None:  # else the field has complained
                given = f"instrument.{name}.drift = {drift}"
                yield f"{given} is no drift of a {kind} sensor; write {mark.low} .. {mark.high}"


def _discrepancies(raw: Raw) -> Iterator[str]:
    """A stated error of the model belongs to a sensor."""
    stated, known = at(raw, "inversion.discrepancy"), _kinds(raw)
    for name in stated if isinstance(stated, dict) else ():
        if name not in known:
            yield f"inversion.discrepancy.{name} belongs to no sensor of the case; its sensors: {', '.join(known)}"


def _kinds(raw: Raw) -> dict[str, str]:
    """Kind of each sensor as the file has it, the default ones where it names none."""
    sensors = raw.get("sensors")
    if not isinstance(sensors, dict) or not sensors:
        return {name: sensor.kind for name, sensor in DEFAULT_SENSORS.items()}
    return {name: str(sensor.get("kind")) if isinstance(sensor, dict) else "" for name, sensor in sensors.items()}
