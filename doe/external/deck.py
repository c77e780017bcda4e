"""What an external solver's deck has a place for: changes of a case that change what its template fills in."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from birdstrike.data.errors import CaseError
from birdstrike.doe.external.template import NAMED, case_values, filled
from birdstrike.solver.case.case import Case
from birdstrike.solver.case.overlay import at
from birdstrike.solver.effects.registry import effect_named


def missing_in_deck(case: Case, changed: Case) -> tuple[str, ...]:
    """Dotted keys in which two cases differ and for which the deck has no place; none: all have one.

    Our own solver has a place for every key. A key has one where another value of it alone changes the filled template:
    through whatever arithmetic, condition or component of the velocity. Each entry of a list needs a place of its own.
    """
    if case.solver.name != "external":
        return ()
    before, after = case_values(case), case_values(changed)
    deck = filled(case, before)
    return tuple(
        name
        for key in _changed_keys(case, changed)
        for entry in _entries(before, after, key)
        if _text(case, _with(before, after, key, entry)) == deck
        for name in _spelt(after, key, entry)
    )


def has_place(case: Case, key: str, value: Any) -> bool:
    """Whether the deck of an external solver has a place for a dotted key: another `value` of it changes the deck."""
    values = case_values(case)
    return _text(case, _replaced(values, key.split("."), value)) != filled(case, values)


def refuse_missing_in_deck(case: Case, changed: Case) -> None:
    """Raise CaseError where the deck of `case` cannot become that of `changed`: it would be run as it is."""
    if missing := missing_in_deck(case, changed):
        raise CaseError(f"the deck of {_template_of(case)} has no place for {', '.join(missing)}")


def _template_of(case: Case) -> str:
    assert case.external is not None
    return Path(case.external.template).name


def unsupported_by_deck(case: Case, name: str) -> str:
    """Why the deck cannot carry an effect of a plausible size; empty where it can, and for our own solver."""
    if case.solver.name != "external":
        return ""
    bare = case.with_effects({other: size for other, size in case.effects.items() if other != name})
    size = case.effects.get(name, effect_named(name).size(bare))
    try:
        changed = bare.with_effects({**bare.effects, name: size})
        missing = missing_in_deck(bare, changed)
        if not missing:
            filled(changed, case_values(changed))
    except CaseError as error:
        return "; ".join(error.errors)
    return f"the deck has no place for {', '.join(missing)}" if missing else ""


def _kept(case: Case) -> dict[str, Any]:
    """What defines the simulation; instruments act on what the solver has written."""
    return {name: table for name, table in case.canonical().items() if name in NAMED}


def _differing(before: Mapping[str, Any], after: Mapping[str, Any], place: str = "") -> Iterator[str]:
    """Dotted keys of `after` under which something else stands than in `before`."""
    for name, value in after.items():
        other = before.get(name)
        if isinstance(value, Mapping) and isinstance(other, Mapping):
            yield from _differing(other, value, f"{place}{name}.")
        elif not _same(other, value) and not (other is None and value == []):
            yield f"{place}{name}"


def _same(one: Any, other: Any) -> bool:
    """Equal but for the rounding of a conversion."""
    if isinstance(one, float) and isinstance(other, float):
        return math.isclose(one, other, rel_tol=1e-12)
    return one == other


def _entries(before: Mapping[str, Any], after: Mapping[str, Any], key: str) -> Iterator[int | None]:
    """Entries in which two lists of one length differ; None: the whole value. A direction is one thing."""
    old, new = at(before, key), at(after, key)
    lists = isinstance(old, list | tuple) and isinstance(new, list | tuple) and len(old) == len(new)
    if not lists or key == "impact.direction":
        yield None
        return
    yield from (i for i, (one, other) in enumerate(zip(old, new, strict=True)) if not _same(one, other))


def _with(before: Mapping[str, Any], after: Mapping[str, Any], key: str, entry: int | None) -> Mapping[str, Any]:
    """The values before with those after under one key, or in one entry of the list under it.

    Another density is also another mass of the same bird, another angle also the slope of a direction.
    """
    if key == "impact.angle":
        before = _replaced(before, ["impact", "direction"], after["impact"]["direction"])
    value = at(after, key)
    if entry is not None:
        value = [*at(before, key)]
        value[entry] = at(after, key)[entry]
    changed = _replaced(before, key.split("."), value)
    if key != "bird.density":
        return changed
    mass = before["bird"]["mass"] * after["bird"]["density"] / before["bird"]["density"]
    return _replaced(changed, ["bird", "mass"], mass)


def _changed_keys(one: Case, other: Case) -> Iterator[str]:
    """Dotted keys in which two cases differ; directions on one way over the plate differ by their angle."""
    turned = not math.isclose(one.impact.heading, other.impact.heading, abs_tol=1e-9)
    yield from (key for key in _differing(_kept(one), _kept(other)) if turned or key != "impact.direction")


def _replaced(table: Mapping[str, Any], parts: Sequence[str], value: Any) -> dict[str, Any]:
    """The table with a value under a key given in parts."""
    first, *rest = parts
    return {**table, first: _replaced(table.get(first, {}), rest, value) if rest else value}


def _text(case: Case, values: Mapping[str, Any]) -> str | None:
    """The filled template; None where the values do not fit each other in it, so that it does name the key."""
    try:
        return filled(case, values)
    except CaseError:
        return None


def _spelt(after: Mapping[str, Any], key: str, entry: int | None) -> Iterator[str]:
    """The key, with the list's entry as a template names it; of a table the keys of what it states."""
    value = at(after, key)
    if entry is not None:
        yield f"{key}[{entry}]"
        return
    if not isinstance(value, Mapping):
        yield key
        return
    yield from (f"{key}.{name}" for name, entry in value.items() if entry is not None)
