"""What a user reads when a field of a case is wrong: one line each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, get_args

from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from birdstrike.data.nearest import did_you_mean
from birdstrike.solver.case.overlay import SIZES, size_follows_from_mass
from birdstrike.solver.case.sections import metadata_of, quantity_at, sections_of
from birdstrike.solver.case.target import unknown_part
from birdstrike.solver.fields import Between, OneOf, shortened
from birdstrike.solver.registry import Kinds

LONG = 4  # of a list: beyond it the message must say which entry it means
Place = tuple[str | int, ...]

OWN_MESH = 'a mesh of your own goes into the deck of another solver (solver = "external")'
INSTEAD = {
    "plate.mesh": "plate.elements = [50, 40] divides a rectangle into shells; a mesh of your own is a [target]: "
    'target.mesh = "panel.inp", see docs/targets.md',
    "bird.mesh": f"no mesh file is read: bird.method, lattice and particles make the bird's; {OWN_MESH}",
}
"""Keys that users look for and a case has not -> what can be had in their place."""


def error_lines(
    case: type[BaseModel], errors: Sequence[ErrorDetails], broken: list[str], table: Mapping[str, Any]
) -> list[str]:
    """One line for each of pydantic's errors, then the `broken` rules between fields.

    A bird's size that would follow from its mass is not called missing: another line says why it does not follow.
    """
    follows = {("bird", key) for key in SIZES} if size_follows_from_mass(table.get("bird")) else set()
    due = [error for error in errors if error["type"] != "missing" or error["loc"] not in follows]
    lines = (error_line(case, error, table) for error in (due if due or broken else errors))
    return [*dict.fromkeys(lines), *broken]


def error_line(case: type[BaseModel], error: ErrorDetails, table: Mapping[str, Any]) -> str:
    """One of pydantic's errors about a `case` read from `table`: field, value, what is wrong, remedy."""
    kind, loc, message, value = error["type"], error["loc"], error["msg"], error["input"]
    key = ".".join(f'"{part}"' if "." in str(part) else str(part) for part in loc)
    if why := _of_no_part(loc, table) or _without_quotes(loc, table):
        return why
    known, kinds = _place(case, loc[:-1], table)
    if kind == "extra_forbidden" and kinds is not None and (why := kinds.foreign(str(loc[-1]))):
        return f"{key} = {value}: {why}"
    if kind == "extra_forbidden" and key in INSTEAD:
        return f"{key} is not a key of a case; {INSTEAD[key]}"
    if kind == "extra_forbidden":
        return f"{key} is not a key of a case; {_did_you_mean(list(known), str(loc[-1]))}"
    if kind == "missing" and isinstance(loc[-1], int):
        listed = ".".join(map(str, loc[:-1]))
        return f"{listed} = {shortened(str(value))} lacks entries: {len(value)} given; write all of them"
    if kind == "too_long":
        most = error.get("ctx", {}).get("max_length")
        return f"{key} = {shortened(str(value))} has {len(value)} entries; write {most}"
    if kind == "missing":
        return f"{key} is missing{_expected(known.get(str(loc[-1])))}"
    if kind in ("model_type", "model_attributes_type", "dict_type"):
        return f"{key} = {value} must be a table of keys"
    if kind == "tuple_type":
        return f"{key} = {value} must be a list in brackets"
    shown = not isinstance(value, dict) and not (isinstance(value, list | tuple) and len(value) > LONG)
    return f"{key} = {shortened(str(value))} {message}" if shown else f"{key} {message}"


def _of_no_part(loc: Place, table: Mapping[str, Any]) -> str:
    """Of an error within a table under `target.parts`: that the mesh has no such part, where that is so."""
    within, name = loc[:2], next(iter(loc[2:-1]), None)
    return unknown_part(table.get("target"), str(name)) if within == ("target", "parts") and name is not None else ""


def _without_quotes(loc: Place, table: Mapping[str, Any]) -> str:
    """Of an error within a sought parameter: that its key lacks quotes, so that TOML reads tables within tables."""
    first = str(next(iter(loc[2:]), ""))
    if loc[:2] != ("inversion", "parameters") or not first or "." in first:
        return ""
    key = _quantity_within(first, table["inversion"]["parameters"].get(first))
    return (
        f'inversion.parameters.{key} lacks quotes: a key with dots is written inversion.parameters."{key}"'
        if key
        else ""
    )


def _quantity_within(key: str, found: Any) -> str:
    """The first dotted key at or below `key` that is a quantity of a case; empty for none."""
    if quantity_at(key) is not None:
        return key
    inner = found.items() if isinstance(found, Mapping) else ()
    return next((text for name, one in inner if (text := _quantity_within(f"{key}.{name}", one))), "")


def _did_you_mean(known: list[str], key: str) -> str:
    """The nearest key that the section knows, or all of them."""
    return did_you_mean(key, known, f"known here: {', '.join(known)}")


def _expected(field: FieldInfo | None) -> str:
    """What a missing field would hold."""
    marks = metadata_of(field) if field is not None else []
    for mark in marks:
        if isinstance(mark, Between):
            return f"; give a value in {mark.low} .. {mark.high}"
        if isinstance(mark, OneOf):
            return f"; {mark.here}"
    return ""


def _place(case: type[BaseModel], loc: Place, table: Any) -> tuple[Mapping[str, FieldInfo], Kinds[Any] | None]:
    """Fields of the section at a place in the case as read, and the registry of which it is a kind.

    The names of sensors and parameters are the user's.
    """
    model: Any = case
    kinds: Kinds[Any] | None = None
    for part in loc:
        table = table.get(part) if isinstance(table, Mapping) else None
        kinds = None
        if isinstance(model, type) and issubclass(model, BaseModel):
            field = model.model_fields[str(part)]
            sections, marks, model = list(sections_of(field, table)), field.metadata, field.annotation
            if len(sections) == 1:
                model = sections[0]
        else:
            model, marks = get_args(model)[-1], getattr(get_args(model)[-1], "__metadata__", ())
        kinds = next((mark for mark in marks if isinstance(mark, Kinds)), None)
        if kinds is not None:
            model = kinds.chosen(table)
    return (model.model_fields if isinstance(model, type) and issubclass(model, BaseModel) else {}), kinds
