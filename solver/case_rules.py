"""Rules between the fields of a case; each reads the file's own text, so that one broken field hides no other error."""

from __future__ import annotations

import re
from collections.abc import Iterator

from solver.case_bird_rules import bird_rules
from solver.case_fields import Between
from solver.case_overlay import Raw
from solver.case_sections import at, si, valid
from solver.case_settings import OFFSET


def broken_rules(raw: Raw) -> Iterator[str]:
    """One line for every broken rule of a case as read from its file."""
    for rule in (bird_rules, _hardening, _rates, _friction, _times, _sensors):
        yield from rule(raw)


def _hardening(raw: Raw) -> Iterator[str]:
    young, tangent = si(raw, "plate.material.young"), si(raw, "plate.material.tangent_modulus")
    if young is not None and tangent is not None and tangent >= young:
        text = at(raw, "plate.material.tangent_modulus")
        yield f"plate.material.tangent_modulus = {text} is not below young; megapascals?"


def _rates(raw: Raw) -> Iterator[str]:
    if si(raw, "plate.material.rate_c"):
        text = at(raw, "plate.material.rate_c")
        yield f"plate.material.rate_c = {text}: rate hardening is not available in this version; leave it out"


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
        instant = valid(Between("0 ms", "100 ms"), text)
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
        offset, size = valid(OFFSET, text), si(raw, key)
        if offset is not None and size is not None and abs(offset) > 0.5 * size:
            yield f'sensors.{name}.at: "{text}" is off the plate; within half of {key} = {at(raw, key)} of its centre'
