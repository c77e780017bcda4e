"""A table whose keys depend on one of them: the bird's material by `model`, its equation of state by `kind`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from types import UnionType
from typing import Any, Union, get_args, get_origin

from pydantic import BaseModel, GetCoreSchemaHandler, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import InitErrorDetails, PydanticCustomError, core_schema

from birdstrike.solver.fields import OneOf, Section, checked, complaint


@dataclass(frozen=True)
class Choice:
    """One table out of several: the value of `key` says which, and the errors are that table's own."""

    key: str
    tables: Mapping[str, type[Section]]

    def validate(self, value: Any) -> Section:
        """The chosen table; raises PydanticCustomError or ValidationError."""
        if isinstance(value, Section):
            return value
        if not isinstance(value, Mapping):
            raise complaint("must be a table of keys")
        choices = OneOf(tuple(self.tables))
        if self.key not in value:
            raise _error(complaint(f"is missing; {choices.here}"), self.key, dict(value))
        try:
            chosen = choices.validate(value[self.key])
        except PydanticCustomError as error:
            raise _error(error, self.key, value[self.key]) from error
        return self.tables[chosen].model_validate(value)

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        return checked(self.validate)


def _error(kind: PydanticCustomError, key: str, value: Any) -> ValidationError:
    return ValidationError.from_exception_data("case", [InitErrorDetails(type=kind, loc=(key,), input=value)])


def sections_of(field: FieldInfo, content: Any = None) -> Iterator[type[Section]]:
    """The tables that a field may hold: all of a choice, or the one that `content`, as read, has chosen."""
    choice = next((mark for mark in field.metadata if isinstance(mark, Choice)), None)
    if choice is not None:
        named = choice.tables.get(str(content.get(choice.key))) if isinstance(content, Mapping) else None
        yield from choice.tables.values() if named is None else (named,)
    elif isinstance(field.annotation, type) and issubclass(field.annotation, BaseModel):
        yield field.annotation  # pyright: ignore[reportReturnType] (every table of a case is a Section)
    elif get_origin(field.annotation) in (Union, UnionType):
        yield from (part for part in get_args(field.annotation) if isinstance(part, type) and issubclass(part, Section))
