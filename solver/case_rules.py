"""Rules between the fields of a case; each reads the file's own text, so that one broken field hides no other error."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from pydantic_core import PydanticCustomError

from solver.case_fields import Between
from solver.case_sections import quantity_at

Raw = dict[str, Any]


def broken_rules(raw: Raw) -> Iterator[str]:
    """One line for every broken rule of a case as read from its file."""
    for rule in (_mass_or_density, _bird_length, _hardening, _rates, _times):
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
    return None if mark is None else valid(mark, at(raw, key))


def valid(mark: Between, value: Any) -> float | None:
    """SI value of a text; None where it is absent or is itself an error, reported elsewhere."""
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


def _rates(raw: Raw) -> Iterator[str]:
    if si(raw, "plate.material.rate_c"):
        text = at(raw, "plate.material.rate_c")
        yield f"plate.material.rate_c = {text}: rate hardening is not available in this version; leave it out"


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
