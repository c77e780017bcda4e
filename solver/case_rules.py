"""Rules between the fields of a case; each reads the file's own text, so that one broken field hides no other error."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from typing import Any

from pydantic_core import PydanticCustomError

from solver.case_fields import Between
from solver.case_plate import STRESS
from solver.case_sections import quantity_at
from solver.case_settings import OFFSET

Raw = dict[str, Any]


def broken_rules(raw: Raw) -> Iterator[str]:
    """One line for every broken rule of a case as read from its file."""
    for rule in (_mass_or_density, _bird_length, _hardening, _panel, _preload, _friction, _times, _sensors):
        yield from rule(raw)


def at(raw: Raw, key: str) -> Any:
    """What stands under a dotted key; None where nothing does."""
    value: Any = raw
    for part in key.split("."):
        value = value.get(part) if isinstance(value, dict) else None
    return value


def si(raw: Raw, key: str) -> float | None:
    """SI value under a dotted key; None where it is absent or is itself an error, reported elsewhere."""
    mark = quantity_at(key)
    return None if mark is None else _valid(mark, at(raw, key))


def _valid(mark: Between, value: Any) -> float | None:
    try:
        return None if value is None else mark.validate(value)
    except PydanticCustomError:
        return None


def _mass_or_density(raw: Raw) -> Iterator[str]:
    mass, density = at(raw, "bird.mass"), at(raw, "bird.density")
    if mass is not None and density is not None:
        yield f"bird.mass = {mass} and bird.density = {density} are both given; keep one, the shape gives the other"
    if mass is None and density is None and isinstance(raw.get("bird"), dict):
        yield 'bird.mass or bird.density is missing; give one, such as density = "938 kg/m^3"'


def _bird_length(raw: Raw) -> Iterator[str]:
    shape, length, diameter = at(raw, "bird.shape"), si(raw, "bird.length"), si(raw, "bird.diameter")
    if length is None or diameter is None:
        return
    given = f"bird.length = {at(raw, 'bird.length')}"
    if shape == "hemispherical_cylinder" and length < diameter:
        yield f"{given} is less than the diameter; length is overall, hemispheres included"
    if shape == "sphere" and length != diameter:
        yield f"{given} differs from the sphere's diameter; leave it out"


def _hardening(raw: Raw) -> Iterator[str]:
    young, tangent = si(raw, "plate.material.young"), si(raw, "plate.material.tangent_modulus")
    if young is not None and tangent is not None and tangent >= young:
        text = at(raw, "plate.material.tangent_modulus")
        yield f"plate.material.tangent_modulus = {text} is not below young; megapascals?"


def _panel(raw: Raw) -> Iterator[str]:
    radius, length = si(raw, "plate.radius"), si(raw, "plate.length")
    if radius is not None and length is not None and length > math.pi * radius:
        given = f"plate.radius = {at(raw, 'plate.radius')}"
        yield f"{given} closes the panel beyond half a circle; length is along the arc, at most pi times the radius"


def _preload(raw: Raw) -> Iterator[str]:
    texts = at(raw, "plate.preload")
    if not isinstance(texts, list) or len(texts) != 2:
        return
    along, across = (_valid(STRESS, text) or 0.0 for text in texts)
    given = f"plate.preload = {texts}"
    if (along or across) and (at(raw, "plate.edges") == "free" or si(raw, "plate.edges.in_plane") == 0.0):
        yield f"{given} needs edges that hold it in the plane; clamp or pin them, or give plate.edges.in_plane"
    if along and at(raw, "plate.radius") is not None:
        yield f"{given}: a curved panel cannot hold a tension along its arc without a pressure; leave the first at 0"
    limit = si(raw, "plate.material.yield_stress")
    if limit is not None and math.sqrt(along**2 - along * across + across**2) >= limit:
        yield f"{given} is not below plate.material.yield_stress = {at(raw, 'plate.material.yield_stress')}"


def _friction(raw: Raw) -> Iterator[str]:
    if si(raw, "impact.friction"):
        yield f"impact.friction = {at(raw, 'impact.friction')}: friction is not available in this version; leave it out"


def _times(raw: Raw) -> Iterator[str]:
    end, interval = si(raw, "time.end"), si(raw, "time.output_interval")
    if end is None:
        return
    if interval is not None and interval > 0.5 * end:
        yield f"time.output_interval = {at(raw, 'time.output_interval')} leaves fewer than 3 outputs before time.end"
    snapshots = at(raw, "time.snapshots")
    for text in snapshots if isinstance(snapshots, list) else []:
        instant = _valid(Between("0 ms", "100 ms"), text)
        if instant is not None and instant > end:
            yield f'time.snapshots: "{text}" is after time.end = {at(raw, "time.end")}'


def _sensors(raw: Raw) -> Iterator[str]:
    sensors = raw.get("sensors")
    for name, sensor in sensors.items() if isinstance(sensors, dict) else []:
        if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name) or name in ("time", "run") or name.endswith("_sigma"):
            yield f'sensors."{name}" cannot be a column\'s name; use letters, digits and _ (not time, run or ..._sigma)'
        if isinstance(sensor, dict):
            yield from _place(raw, name, sensor)


def _place(raw: Raw, name: str, sensor: Raw) -> Iterator[str]:
    place = sensor.get("at")
    if place is None or not isinstance(place, list):
        return
    if sensor.get("kind") != "displacement":
        yield f"sensors.{name}.at = {place}: only a displacement sensor has a place; leave it out"
    for text, key in zip(place, ("plate.length", "plate.width"), strict=False):
        offset, size = _valid(OFFSET, text), si(raw, key)
        if offset is not None and size is not None and abs(offset) > 0.5 * size:
            yield f'sensors.{name}.at: "{text}" is off the plate; within half of {key} = {at(raw, key)} of its centre'
