"""Arguments of the Python functions: what the commands' parser refuses, a call from a script may give all the same."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence, Set
from dataclasses import fields
from numbers import Integral, Real
from os import PathLike
from pathlib import Path
from types import NoneType
from typing import Any, TypeVar

from birdstrike.data.errors import UserError

T = TypeVar("T")

KINDS: dict[str, tuple[type | tuple[type, ...], str]] = {
    "bool": (bool, "True or False"),
    "int": (Integral, "a whole number"),
    "float": (Real, "a number"),
    "str": (str, "text"),
    "Path": ((str, PathLike), "a path"),
    "Mapping[str, str]": (Mapping, "a dict of texts"),
    "None": (NoneType, "None"),
}
"""Annotation of a field -> classes of its values, and the same in words; other annotations are not looked at."""


def as_list(given: Any) -> list[Any]:
    """What was given once or several times, such as records or names of channels, as a list; None is none.

    A text is one thing, not a sequence of letters.
    """
    if given is None:
        return []
    several = isinstance(given, Sequence | Set | Iterator) and not isinstance(given, str | bytes)
    return list(given) if several else [given]


def as_names(argument: str, given: Any) -> tuple[str, ...]:
    """Names given once or several times; raises UserError for what is no name."""
    names = tuple(as_list(given))
    if wrong := [one for one in names if not isinstance(one, str)]:
        raise UserError(f"{argument} = {given!r}: {wrong[0]!r} is no name; give text, or a list of texts")
    return names


def as_path(argument: str, given: Any) -> Path:
    """A path; raises UserError for anything else."""
    if not isinstance(given, str | PathLike):
        raise UserError(f"{argument} = {given!r} is no path; give text or a pathlib.Path")
    return Path(given)


def as_options(argument: str, given: T | None, kind: type[T]) -> T:
    """Options as given, the usual ones where none are; raises UserError for another thing, such as a dict."""
    if given is None:
        return kind()
    if not isinstance(given, kind):
        raise UserError(f"{argument} = {given!r} is no {kind.__name__}; write birdstrike.{kind.__name__}(NAME=VALUE)")
    return given


def refuse_other_kinds(options: Any) -> None:
    """Raise UserError for every field of a dataclass whose value is not of the kind that the class declares."""
    errors: list[str] = []
    for one in fields(options):
        declared, value = str(one.type).split(" | "), getattr(options, one.name)
        if all(part in KINDS for part in declared) and not any(isinstance(value, KINDS[part][0]) for part in declared):
            wanted = " or ".join(KINDS[part][1] for part in declared)
            errors.append(f"{type(options).__name__}: {one.name} = {value!r} must be {wanted}")
    if errors:
        raise UserError(errors)


def refuse_no_function(argument: str, given: Callable[..., Any] | None, wanted: str) -> None:
    """Raise UserError for what cannot be called; wanted: what the function takes and returns."""
    if given is not None and not callable(given):
        raise UserError(f"{argument} = {given!r} is no function; give one of {wanted}, or leave it out")
