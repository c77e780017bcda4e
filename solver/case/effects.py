"""The case's section `effects`: physical magnitudes of effects, and the case with them put in place."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import partial
from typing import Annotated, Any, Protocol, TypeVar

from pydantic import GetCoreSchemaHandler
from pydantic_core import core_schema

from birdstrike.data.errors import CaseError
from birdstrike.data.nearest import did_you_mean
from birdstrike.data.units import UnitError, from_si, quantity_text, rounded, to_si
from birdstrike.solver.case.overlay import Raw, by_place, overlay
from birdstrike.solver.effects.effect import SECTIONS, Declared, Effect, failed
from birdstrike.solver.effects.registry import effect_named, effects, kind_of
from birdstrike.solver.fields import checked, complaint, each_of
from birdstrike.solver.sensors.registry import DEFAULT_SENSORS

SHOWN = {"m": "mm", "s": "ms", "Pa": "MPa", "rad": "deg", "kg": "kg", "m/s": "m/s", "1/s": "1/s", "": ""}
SHOWN |= {"rad/N": "mrad/kN", "m^2/N": "mm²/kN", "kg/m^3": "kg/m³"}
"""SI unit of a magnitude -> the unit in which engineers write it."""
NARROW = 1e-4  # share of a limit up to which it is looked for
MOST = 80  # cases that are tried for it


class Stating(Declared, Protocol):
    """A case that states effects, each with its magnitude in SI."""

    @property
    def effects(self) -> Mapping[str, float]:
        """Section `effects`."""
        ...


C = TypeVar("C", bound=Stating)
Act = Callable[[float], object]
"""Puts an effect of some magnitude into the case; raises CaseError where that makes the case wrong."""


def shown(value: float, unit: str, digits: int = 3) -> str:
    """A magnitude of an SI unit in that of engineers, with its sign: "+0.2 mm", "+5480 MPa"; "0 mm" of none."""
    theirs = SHOWN.get(unit, unit)
    number = from_si(value, theirs) if theirs else value
    sign = "+" if number > 0.0 else ""
    return f"{sign}{rounded(number or 0.0, digits)} {theirs}".strip()


def effect_limit_error(effect: Effect, case: Declared, value: float, error: CaseError, act: Act) -> list[str]:
    """The lines of an error that an effect has made, with the nearest magnitude that fits the case."""
    given = f"effects.{effect.name} = {shown(value, effect.unit, 6)}"
    limit = nearest(value, effect.size(case), partial(fits, act))
    if limit is None:
        return [f"{given} makes the case wrong: {line}" for line in error.errors]
    text = limit_text(effect, limit, value, partial(fits, act))
    closer = abs(value) < abs(limit)
    side = f"nearer to 0 than {text}, the smallest" if closer else f"beyond {text}, the largest"
    first, *more = (line.split("; ")[0] for line in error.errors)
    why = f"{first}, and {len(more)} more" if more else first
    return [f"{given} is {side} that fits this case; write {text}, or leave the effect out ({why})"]


def fits(act: Act, value: float) -> bool:
    """Whether the case can carry a magnitude."""
    try:
        act(value)
    except CaseError:
        return False
    return True


def nearest(value: float, size: float, fit: Callable[[float], bool]) -> float | None:
    """The magnitude nearest to `value` that fits, on the way to the plausible `size` of its sign, by bisection.

    None where that size does not fit either.
    """
    good, bad = math.copysign(size, value), value
    if not fit(good):
        return None
    for _ in range(MOST):
        if abs(good - bad) <= NARROW * min(abs(good), abs(bad)):
            break
        between = 0.5 * (good + bad)
        good, bad = (between, bad) if fit(between) else (good, between)
    return good


def limit_text(effect: Effect, limit: float, beyond: float, fit: Callable[[float], bool]) -> str:
    """A limit in the engineers' unit, in the fewest digits with which it still fits; beyond: what does not."""
    safer = limit * (1.0 + NARROW if abs(beyond) < abs(limit) else 1.0 - NARROW)
    for value in (limit, safer):
        for digits in (2, 3, 4, 5):
            text = shown(value, effect.unit, digits)
            if fit(to_si(text, effect.unit) if effect.unit else float(text)):
                return text
    return quantity_text(limit, effect.unit) if effect.unit else repr(limit)


class Magnitudes:
    """Schema of the section: name -> magnitude in SI; zeros are absent effects and are left out."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        return checked(_section)


Effects = Annotated[dict[str, float], Magnitudes()]


def _section(value: Any) -> dict[str, float]:
    if not isinstance(value, Mapping):
        raise complaint('must be a table such as { plate_thickness = "0.2 mm" }')
    found = each_of(by_place(value), magnitude)
    return {name: size for name, size in found.items() if size}


def magnitude(name: str, value: Any) -> float:
    """SI magnitude of an effect as a case states it; raises PydanticCustomError."""
    known, (kind, dot, place) = effects(), name.partition(".")
    if kind not in known:
        hint = did_you_mean(kind, known, f"known: {', '.join(known)}")
        raise complaint(f"is no effect; {hint}")
    if dot and known[kind].alone is None:
        raise complaint(_no_table(kind, {place: value}))
    if dot and not place:
        raise complaint("names no set of nodes behind its dot")
    unit = known[kind].unit
    if isinstance(value, Mapping):
        raise complaint(_no_table(name, value))
    if not unit:
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            raise complaint("is dimensionless: write a bare number")
        return float(value)
    if not isinstance(value, str):
        raise complaint(f'has no unit; write text such as "1 {SHOWN.get(unit, unit)}"')
    return _in_unit(known[kind], value)


def _no_table(name: str, value: Mapping[str, Any]) -> str:
    """What to write where a table stands in place of an effect's magnitude."""
    effect = effects().get(name)
    if effect is not None and effect.alone is not None:  # of one place in both ways: `by_place` leaves it
        return "names a set of nodes that is also named behind a dot, in quotes; keep one of the two"
    if effect is None or effect.fault is None:
        return "must be one magnitude, not a table"
    key = effect.fault.key
    places = ", ".join(f"instrument.{sensor}.{key}" for sensor in value) or f"instrument.<sensor>.{key}"
    such = f"(such as {effect.fault.example})"
    return f"must be one magnitude, for all sensors alike; of one sensor alone write {places} {such}"


def _in_unit(effect: Effect, text: str) -> float:
    """The text in SI, in the effect's unit or in its alternative one."""
    try:
        return to_si(text, effect.unit)
    except UnitError as error:
        if effect.alternative is not None:
            unit, magnitude_of = effect.alternative
            with suppress(UnitError, ZeroDivisionError):
                return magnitude_of(to_si(text, unit))
        raise complaint(f"is not understood: {error}") from error


def magnitude_text(effect: Effect, value: float) -> str | float:
    """A magnitude as a case file states it."""
    return quantity_text(value, effect.unit) if effect.unit else float(value)


def stated(case: Stating) -> list[str]:
    """One line an effect of the case: `effects.plate_thickness = +0.2 mm: a thicker plate`."""
    return [
        f"effects.{name} = {shown(size, (one := effect_named(name)).unit)}: {one.meaning}"
        for name, size in case.effects.items()
    ]


def with_effects(case: C, raw: Raw, rebuild: Callable[[Raw], C]) -> C:
    """The case with every effect put in place and the section gone; rebuild: from a table to its case.

    Effects act one after the other, in the order of the library. Raises CaseError for one that the case cannot carry.
    """
    table = {key: value for key, value in raw.items() if key != "effects"}
    acted, sizes = rebuild(table), case.effects
    order = list(effects())
    for effect in map(effect_named, sorted(sizes, key=lambda name: order.index(kind_of(name)))):
        size = sizes[effect.name]
        errors = _refusals(effect, acted, size)
        if errors:
            raise CaseError(errors)
        act = partial(_with_one, effect, acted, table, rebuild)
        try:
            acted, table = act(size)
        except CaseError as error:
            raise CaseError(effect_limit_error(effect, acted, size, error, act)) from error
    return acted


def _with_one(effect: Effect, case: C, table: Raw, rebuild: Callable[[Raw], C], size: float) -> tuple[C, Raw]:
    """The case and its table with one effect put in place; raises CaseError, also where the effect itself fails."""
    try:
        changes = effect.change(case, size)
        changes = changes if case.target is None else case.target.changed(changes)
        changed = overlay(_spelt_out(table, changes), changes)
    except CaseError:
        raise
    except Exception as error:  # whatever a function from outside may raise
        raise CaseError(failed("change", effect.change, error)) from error
    beyond = [section for section in changes if section not in SECTIONS]
    if beyond:
        sections = f"{', '.join(SECTIONS[:-1])} and {SECTIONS[-1]}"
        raise CaseError(f"its function `change` sets {beyond[0]}; an effect acts on {sections} alone")
    return rebuild(changed), changed


def _spelt_out(table: Raw, changes: Mapping[str, Any]) -> Raw:
    """The case's table with what it says for short, or does not say, where an effect changes a part of that."""
    if "sensors" in changes and not table.get("sensors"):
        table = table | {"sensors": {name: {"kind": sensor.kind} for name, sensor in DEFAULT_SENSORS.items()}}
    if "solver" in changes and isinstance(table.get("solver"), str):
        table = table | {"solver": {"name": table["solver"]}}
    return table


def _refusals(effect: Effect, case: Declared, value: float) -> list[str]:
    if reason := effect.refuses(case):
        return [f"effects.{effect.name}: {reason}"]
    if value < effect.least(case):
        least = shown(effect.least(case), effect.unit)
        return [
            f"effects.{effect.name} = {shown(value, effect.unit)} is below {least}, the least that means anything here"
        ]
    return []
