"""What a user reads when a field of a case is wrong: one line each."""

from __future__ import annotations

import difflib
from collections.abc import Iterator, Mapping
from typing import Any, get_args

from pydantic import BaseModel
from pydantic_core import ErrorDetails

from solver.case_fields import Between
from solver.case_sections import metadata_of, section_of

Place = tuple[str | int, ...]


def error_line(case: type[BaseModel], error: ErrorDetails) -> str:
    """One of pydantic's errors about a `case`: field, value, what is wrong, remedy."""
    kind, loc, message, value = error["type"], error["loc"], error["msg"], error["input"]
    key = ".".join(f'"{part}"' if "." in str(part) else str(part) for part in loc)
    if kind == "extra_forbidden":
        return f"{key} is not a key of a case; {_did_you_mean(case, loc)}"
    if kind == "missing":
        mark = next((m for m in _metadata(case, loc) if isinstance(m, Between)), None)
        return f"{key} is missing" + (f"; give a value in {mark.low} .. {mark.high}" if mark else "")
    if kind in ("model_type", "model_attributes_type", "dict_type"):
        return f"{key} = {value} must be a table of keys"
    if kind == "tuple_type":
        return f"{key} = {value} must be a list in brackets"
    return f"{key} = {value} {message}" if not isinstance(value, dict) else f"{key} {message}"


def _did_you_mean(case: type[BaseModel], loc: Place) -> str:
    """The nearest key that the section knows, or all of them."""
    known = list(_fields(case, loc[:-1]))
    close = difflib.get_close_matches(str(loc[-1]), known, n=1)
    return f"did you mean {close[0]}?" if close else f"known here: {', '.join(known)}"


def _fields(case: type[BaseModel], loc: Place) -> Mapping[str, Any]:
    """Fields of the section at a place in the case; the names of sensors and parameters are the user's."""
    model: Any = case
    for part in loc:
        if isinstance(model, type) and issubclass(model, BaseModel):
            model = section_of(model.model_fields[str(part)].annotation)
        else:
            model = get_args(model)[-1]
    return model.model_fields if isinstance(model, type) and issubclass(model, BaseModel) else {}


def _metadata(case: type[BaseModel], loc: Place) -> Iterator[Any]:
    field = _fields(case, loc[:-1]).get(str(loc[-1]))
    return iter(metadata_of(field) if field is not None else ())
