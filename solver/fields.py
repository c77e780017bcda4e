"""Fields of a case: a quantity with its plausible range and unit, and a choice among what this version can do."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeVar, get_args

from pydantic import BaseModel, ConfigDict, GetCoreSchemaHandler, ValidationError
from pydantic_core import InitErrorDetails, PydanticCustomError, core_schema

from birdstrike.data.nearest import did_you_mean
from birdstrike.data.units import ACCEPTED, PLURALS, UnitError, decimal_comma, from_si, parts, si_unit, to_si

NEAR = 0.75
"""Similarity (difflib's ratio) from which on an unknown word is taken for a misspelt one; gelatine is no elastic."""


WIDE = 200
"""Characters of a value that a line shows whole."""


def complaint(message: str) -> PydanticCustomError:
    """An error whose text is `message` as it stands (pydantic would read braces in a template)."""
    return PydanticCustomError("case", "{message}", {"message": message})


def shortened(text: str) -> str:
    """A value as a line has room for it."""
    return text if len(text) <= WIDE else f"{text[: WIDE // 2]} ... ({len(text)} characters)"


class Section(BaseModel):
    """Part of a case: immutable, and closed to keys that it does not know."""

    model_config = ConfigDict(frozen=True, extra="forbid")


Key = TypeVar("Key", int, str)


def each_of(entries: Mapping[Key, Any], check: Callable[[Key, Any], float]) -> dict[Key, float]:
    """Every entry as `check` finds it; raises ValidationError with the complaints about all of them."""
    found: dict[Key, float] = {}
    wrong: list[InitErrorDetails] = []
    for key, value in entries.items():
        try:
            found[key] = check(key, value)
        except PydanticCustomError as error:
            wrong.append(InitErrorDetails(type=error, loc=(key,), input=value))
    if wrong:
        raise ValidationError.from_exception_data("case", wrong)
    return found


def checked(check: Callable[[Any], Any]) -> core_schema.CoreSchema:
    """Schema of a value that only `check` accepts."""
    return core_schema.no_info_plain_validator_function(check)


def _has_unit(text: str) -> bool:
    """Whether a text is a number with a unit behind it."""
    try:
        return bool(parts(text)[1])
    except UnitError:
        return False


@dataclass(frozen=True)
class Between:
    """A physical quantity in low .. high, written with its unit ("0.1 mm"); numbers mean a dimensionless one.

    The unit of `low` is the engineers' one, in which errors speak. After validation the value is SI.
    """

    low: str | float
    high: str | float

    @property
    def shown(self) -> str:
        """Unit of the bounds: "0.1 mm" -> "mm"."""
        return self.low.split(" ", 1)[1] if isinstance(self.low, str) else ""

    @cached_property
    def unit(self) -> str:
        """SI unit of the value."""
        return si_unit(self.shown) if self.shown else ""

    @cached_property
    def bounds(self) -> tuple[float, float]:
        """Plausible range in SI."""
        return self.si(self.low), self.si(self.high)

    def si(self, value: Any) -> float:
        """SI value of what stands in the file; raises PydanticCustomError that says what to write instead."""
        if self.unit:
            if not isinstance(value, str):
                raise complaint(self._bare(value))
            try:
                return to_si(value, self.unit)
            except UnitError as error:
                raise complaint(f"is not understood: {error}") from error
        if isinstance(value, str) and _has_unit(value):
            try:
                return to_si(value, "")
            except UnitError as error:
                raise complaint(f"is not understood: {error}") from error
        if isinstance(value, bool) or not isinstance(value, int | float):
            comma = decimal_comma(value).replace('"', "") if isinstance(value, str) else ""
            raise complaint(comma or "is dimensionless: write a bare number")
        try:
            number = float(value)
        except OverflowError:  # of a whole number
            number = math.inf
        if not math.isfinite(number):
            raise complaint("is not a finite number")
        return number

    def _bare(self, value: Any) -> str:
        accepted = f"accepted units: {ACCEPTED[self.unit]}"
        if isinstance(value, int | float) and not isinstance(value, bool):
            units = (self.shown, *ACCEPTED[self.unit].split(", "))
            if unit := next((unit for unit in units if self.valid(f"{value} {unit}") is not None), ""):
                return f'has no unit; write "{value} {unit}" ({accepted})'
        return f'must be text with a unit such as "{self.low}" ({accepted})'

    def validate(self, value: Any) -> float:
        """SI value inside the bounds; raises PydanticCustomError with the range and a remedy."""
        si = self.si(value)
        low, high = self.bounds
        if not low <= si <= high:
            raise complaint(f"is outside {self.low} .. {self.high}; {self.remedy(value, si)}")
        return si + 0.0  # -0.0 would be another hash

    def valid(self, value: Any) -> float | None:
        """SI value of what stands in the file; None where nothing does, or what is itself an error."""
        try:
            return None if value is None else self.validate(value)
        except PydanticCustomError:
            return None

    def remedy(self, value: Any, si: float) -> str:
        """What the user probably meant."""
        low, high = self.bounds
        if si < 0.0 <= low or low <= -si <= high:
            return "without the minus sign?" if si < 0.0 else "with a minus sign?"
        if self.unit and low <= to_si(f"{parts(value)[0]} {self.shown}", self.unit) <= high:
            return f"{PLURALS.get(self.shown, self.shown)}?"
        return "a wrong unit or a slipped digit?"

    def display(self, si: float) -> str:
        """An SI value as the engineers write it: "10 mm"."""
        return f"{from_si(si, self.shown):.6g} {self.shown}".strip()

    def written(self, si: float) -> str:
        """An SI value as it stands in a case: \'"10 mm"\', 0.1."""
        return f'"{self.display(si)}"' if self.shown else self.display(si)

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        return checked(self.validate)


EDGE_SPRINGS = {
    "rotational": Between("0 kN*m/rad/m", "1e6 kN*m/rad/m"),
    "in_plane": Between("0 N/mm^2", "1e7 N/mm^2"),
    "transverse": Between("0 N/mm^2", "1e7 N/mm^2"),
}
"""Freedom of a support -> its stiffness per length of edge, which a case states and effects change."""


@dataclass(frozen=True)
class Count:
    """A whole number in low .. high."""

    low: int
    high: int

    def validate(self, value: Any) -> int:
        """The number itself; raises PydanticCustomError."""
        if isinstance(value, bool) or not isinstance(value, int):
            raise complaint(f"must be a whole number in {self.low} .. {self.high}{self._remedy(value)}")
        if not self.low <= value <= self.high:
            raise complaint(f"is outside {self.low} .. {self.high}")
        return value

    def _remedy(self, value: Any) -> str:
        """What the user probably meant."""
        text = value.strip() if isinstance(value, str) else value
        if isinstance(text, bool) or not isinstance(text, str | int | float):
            return ""
        with suppress(ValueError, OverflowError):
            whole = float(text)
            if whole == int(whole) and self.low <= whole <= self.high:
                return f"; write {int(whole)}{', without quotes' if isinstance(value, str) else ''}"
        return ""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        return checked(self.validate)


@dataclass(frozen=True)
class Switch:
    """true or false."""

    def validate(self, value: Any) -> bool:
        """The switch itself; raises PydanticCustomError."""
        if not isinstance(value, bool):
            raise complaint("must be true or false, without quotes")
        return value

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        return checked(self.validate)


@dataclass(frozen=True)
class OneOf:
    """A choice: what this version can do, and what later ones will (`planned`: refused, but by name).

    more: what an error adds to the list of what can be chosen.
    """

    available: tuple[str, ...]
    planned: tuple[str, ...] = ()
    more: str = ""

    @property
    def here(self) -> str:
        """What can be chosen."""
        return f"available: {', '.join(self.available)}"

    def validate(self, value: Any) -> str:
        """The choice itself; raises PydanticCustomError."""
        if value in self.available:
            return value
        if value in self.planned:
            raise complaint(f"is not available in this version; {self.here}")
        hint = did_you_mean(str(value), self.available, f"{self.here}{self.more}", alike=NEAR, quote='"')
        raise complaint(f"is unknown; {hint}")

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        return checked(self.validate)


@dataclass(frozen=True)
class WordOr:
    """A word among a few, or a table that spells out what the word would mean."""

    words: tuple[str, ...]
    table: type[Section]

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        words = OneOf(self.words)

        def validate(value: Any, as_table: Callable[[Any], Any]) -> Any:
            return as_table(value) if isinstance(value, dict | self.table) else words.validate(value)

        def plain(value: Any) -> Any:
            return value.model_dump(mode="json") if isinstance(value, Section) else value

        written = core_schema.plain_serializer_function_ser_schema(plain)
        return core_schema.no_info_wrap_validator_function(validate, handler(self.table), serialization=written)


def si_in(section: type[Section], raw: Mapping[str, Any], key: str) -> float | None:
    """SI value under a key of a table as read; None where it is absent or is itself an error, reported elsewhere."""
    field = section.model_fields[key]
    optional = (mark for part in get_args(field.annotation) for mark in getattr(part, "__metadata__", ()))
    mark = next(mark for mark in (*field.metadata, *optional) if isinstance(mark, Between))
    return mark.valid(raw.get(key))


def does_nothing_alone(
    raw: Mapping[str, Any], prefix: str, key: str, users: Sequence[str], joined: str = " or "
) -> Iterator[str]:
    """One line for a key of a table as read that only `users` make use of, where none of them is given.

    joined: " and " where all of them are needed.
    """
    if key in raw and not any(user in raw for user in users):
        needed = joined.join(users)
        yield f"{prefix}.{key} = {raw[key]} does nothing alone; give {prefix}.{needed} too, or leave it out"
