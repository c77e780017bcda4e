"""Rules between a case's sensors, their instruments and the plate; each reads the file's own text."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator

from data.units import ACCEPTED
from solver.case_overlay import Raw, at
from solver.case_sections import si, valid
from solver.case_sensors import DEFAULT_SENSORS, DIRECTION, DRIFT, LENGTH, OF_KIND, OFFSET, PLACED


def broken_sensor_rules(raw: Raw) -> Iterator[str]:
    """One line for every broken rule about sensors and instruments of a case as read from its file."""
    sensors = raw.get("sensors")
    for name, sensor in sensors.items() if isinstance(sensors, dict) else []:
        if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name) or name in ("time", "run") or name.endswith("_sigma"):
            yield f'sensors."{name}" cannot be a column\'s name; use letters, digits and _ (not time, run or ..._sigma)'
        if isinstance(sensor, dict):
            yield from _unit_in_name(name, sensor)
            yield from _fields_of_its_kind(name, sensor)
            yield from _place(raw, name, sensor)
            yield from _ends(raw, name, sensor)
            yield from _on_rigid(raw, name, sensor)
    yield from _instruments(raw)


def _unit_in_name(name: str, sensor: Raw) -> Iterator[str]:
    """A strain's column carries no unit, so that its name must not look as if it did."""
    last = name.rpartition("_")[2]
    if sensor.get("kind") == "strain" and last != name and last in ACCEPTED:
        yield f'sensors.{name}: a strain\'s column would be read as one in the unit "{last}"; use another name'


def _fields_of_its_kind(name: str, sensor: Raw) -> Iterator[str]:
    for field, kind in OF_KIND.items():
        if field in sensor and sensor.get("kind") != kind:
            yield f"sensors.{name}.{field} = {sensor[field]}: only a {kind} sensor has a {field}; leave it out"


def _place(raw: Raw, name: str, sensor: Raw) -> Iterator[str]:
    place = sensor.get("at")
    if place is None or not isinstance(place, list):
        return
    if sensor.get("kind") not in PLACED:
        which = f"{', '.join(PLACED[:-1])} and {PLACED[-1]}"
        yield f"sensors.{name}.at = {place}: only {which} sensors have a place; leave it out"
    for text, key in zip(place, ("plate.length", "plate.width"), strict=False):
        offset, size = valid(OFFSET, text), si(raw, key)
        if offset is not None and size is not None and abs(offset) > 0.5 * size:
            yield f'sensors.{name}.at: "{text}" is off the plate; within half of {key} = {at(raw, key)} of its centre'


def _ends(raw: Raw, name: str, sensor: Raw) -> Iterator[str]:
    """Both ends of a strain gauge lie on the plate, as its middle does."""
    length, turned = valid(LENGTH, sensor.get("length")), valid(DIRECTION, sensor.get("direction", "0 deg"))
    place = sensor.get("at", ["0 mm", "0 mm"])
    if sensor.get("kind") != "strain" or length is None or turned is None or not isinstance(place, list):
        return
    for text, key, reach in zip(
        place, ("plate.length", "plate.width"), (math.cos(turned), math.sin(turned)), strict=False
    ):
        offset, size = valid(OFFSET, text), si(raw, key)
        if offset is None or size is None or abs(offset) > 0.5 * size:
            continue
        beyond = abs(offset) + 0.5 * length * abs(reach) - 0.5 * size
        if beyond > 1e-9 * size:
            yield (
                f"sensors.{name}.length = {sensor['length']}: an end of the gauge is {1e3 * beyond:.3g} mm beyond the "
                f"plate ({key} = {at(raw, key)}); a shorter gauge, or another place or direction?"
            )


def _on_rigid(raw: Raw, name: str, sensor: Raw) -> Iterator[str]:
    if at(raw, "plate.rigid") is True and sensor.get("kind") == "strain":
        yield f"sensors.{name}.kind = strain: a rigid plate has no strain; leave the sensor or plate.rigid out"


def _instruments(raw: Raw) -> Iterator[str]:
    """An instrument belongs to a sensor, and its drift has the unit of that sensor's channel per second."""
    instruments, known = raw.get("instrument"), _kinds(raw)
    for name, own in instruments.items() if isinstance(instruments, dict) else []:
        if name not in known:
            yield f"instrument.{name} belongs to no sensor of the case; its sensors: {', '.join(known)}"
            continue
        mark, drift = DRIFT.get(known[name]), own.get("drift") if isinstance(own, dict) else None
        if mark and drift is not None and valid(mark, drift) is None and _some_kinds(drift):
            kind = known[name]
            yield f"instrument.{name}.drift = {drift} is no drift of a {kind} sensor; write {mark.low} .. {mark.high}"


def _kinds(raw: Raw) -> dict[str, str]:
    """Kind of each sensor as the file has it, the default ones where it names none."""
    sensors = raw.get("sensors")
    if not isinstance(sensors, dict) or not sensors:
        return {name: sensor.kind for name, sensor in DEFAULT_SENSORS.items()}
    return {name: str(sensor.get("kind")) if isinstance(sensor, dict) else "" for name, sensor in sensors.items()}


def _some_kinds(drift: object) -> bool:
    """Whether another kind of sensor may drift so; else the field itself has complained."""
    return any(valid(mark, drift) is not None for mark in DRIFT.values())
