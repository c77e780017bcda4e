"""A case: everything that defines one strike, its sensors, and what an inversion may vary."""

from __future__ import annotations

import difflib
import hashlib
import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, get_args

from pydantic import BaseModel, PrivateAttr, ValidationError, field_validator

from data.errors import CaseError
from data.units import quantity_text
from solver.case_fields import Between, Later
from solver.case_files import Raw, overlay, override_table, read_case
from solver.case_rules import broken_rules
from solver.case_sections import Bird, Impact, Plate, Section, Time, metadata_of, quantity_at
from solver.case_settings import DEFAULT_SENSORS, InversionSettings, Sensor, SolverSettings


@dataclass(frozen=True)
class Parameter:
    """A parameter that an inversion seeks: dotted case key, limits in SI, SI unit."""

    name: str
    low: float
    high: float
    unit: str


class Case(Section):
    """One strike, every value in SI; made by `load_case`."""

    plate: Plate
    bird: Bird
    impact: Impact
    time: Time
    sensors: dict[str, Sensor] = DEFAULT_SENSORS
    solver: SolverSettings = SolverSettings()
    inversion: InversionSettings = InversionSettings()
    effects: Annotated[None, Later("leave the section out")] = None
    instrument: Annotated[None, Later("leave the section out")] = None

    _raw: Raw = PrivateAttr(default_factory=dict)
    _name: str = PrivateAttr(default="case")

    @field_validator("sensors", mode="after")
    @classmethod
    def _no_sensors_mean_the_default_three(cls, value: dict[str, Sensor]) -> dict[str, Sensor]:
        return value or DEFAULT_SENSORS

    @property
    def name(self) -> str:
        """Name of the file that the case was read from, without its ending."""
        return self._name

    @property
    def normal_speed(self) -> float:
        """Component of the velocity normal to the plate [m/s]."""
        return self.impact.speed * math.sin(self.impact.angle)

    @property
    def first_contact(self) -> float:
        """Time at which the stand-off has been flown [s]."""
        return self.impact.standoff / self.impact.speed

    def parameters(self) -> tuple[Parameter, ...]:
        """What an inversion seeks, in the order of the file."""
        entries = ((name, entry.range, quantity_at(name)) for name, entry in self.inversion.parameters.items())
        return tuple(Parameter(name, *span, mark.unit) for name, span, mark in entries if mark is not None)

    def with_values(self, values: Mapping[str, float]) -> Case:
        """The case with SI values under dotted keys, validated anew; raises CaseError."""
        unknown = [f"{key} is no quantity of a case" for key in values if quantity_at(key) is None]
        if unknown:
            raise CaseError(unknown)
        return case_from_table(overlay(self._raw, _table(values)), self._name)

    def canonical(self) -> dict[str, Any]:
        """Nested SI values of everything that changes a history; no noise, inversion or threads."""
        tree = self.model_dump(mode="json", include={"plate", "bird", "impact", "time", "sensors", "solver"})
        del tree["solver"]["threads"], tree["bird"]["mass"]
        tree["bird"]["density"] = self.bird.actual_density
        for sensor in tree["sensors"].values():
            del sensor["noise"]
        return tree


def load_case(path: str | Path, overrides: Mapping[str, str] | None = None) -> Case:
    """Case from a TOML file or a shipped case's name, `--set` texts laid over it; raises CaseError with all errors."""
    table = overlay(read_case(path), override_table(overrides or {}))
    return case_from_table(table, Path(path).stem)


def case_from_table(table: Raw, name: str = "case") -> Case:
    """Case from a table as TOML gives it; raises CaseError with all errors."""
    errors: list[str] = []
    case = None
    try:
        case = Case.model_validate(table)
    except ValidationError as error:
        errors = [_line(entry["type"], entry["loc"], entry["msg"], entry["input"]) for entry in error.errors()]
    errors += broken_rules(table)
    if case is None or errors:
        raise CaseError(errors, f"case {name}: {len(errors)} error{'s' if len(errors) > 1 else ''}")
    case._raw, case._name = table, name
    return case


def case_hash(case: Case) -> str:
    """First 16 hex digits of the SHA-256 of the canonical case; floats by their shortest exact text."""
    text = json.dumps(case.canonical(), sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _table(values: Mapping[str, float]) -> Raw:
    """Nested table of dotted keys with SI values as texts that the case's fields accept."""
    table: Raw = {}
    for key, value in values.items():
        mark = quantity_at(key)
        content: Any = quantity_text(value, mark.unit) if mark is not None and mark.unit else float(value)
        for part in reversed(key.split(".")):
            content = {part: content}
        table = overlay(table, content)
    return table


def _line(kind: str, loc: tuple[str | int, ...], message: str, value: Any) -> str:
    """One error as one line: field, value, what is wrong, remedy."""
    key = ".".join(f'"{part}"' if "." in str(part) else str(part) for part in loc)
    if kind == "extra_forbidden":
        return f"{key} is not a key of a case; {_did_you_mean(loc)}"
    if kind == "missing":
        mark = next((m for m in _metadata(loc) if isinstance(m, Between)), None)
        return f"{key} is missing" + (f"; give a value in {mark.low} .. {mark.high}" if mark else "")
    if kind in ("model_type", "model_attributes_type", "dict_type"):
        return f"{key} = {value} must be a table of keys"
    if kind == "tuple_type":
        return f"{key} = {value} must be a list in brackets"
    return f"{key} = {value} {message}" if not isinstance(value, dict) else f"{key} {message}"


def _did_you_mean(loc: tuple[str | int, ...]) -> str:
    """The nearest key that the section knows, or all of them."""
    known = list(_fields(loc[:-1]))
    close = difflib.get_close_matches(str(loc[-1]), known, n=1)
    return f"did you mean {close[0]}?" if close else f"known here: {', '.join(known)}"


def _fields(loc: tuple[str | int, ...]) -> Mapping[str, Any]:
    """Fields of the section at a place in the case; the names of sensors and parameters are the user's."""
    model: Any = Case
    for part in loc:
        if isinstance(model, type) and issubclass(model, BaseModel):
            model = model.model_fields[str(part)].annotation
        else:
            model = get_args(model)[-1]
    return model.model_fields if isinstance(model, type) and issubclass(model, BaseModel) else {}


def _metadata(loc: tuple[str | int, ...]) -> Iterator[Any]:
    field = _fields(loc[:-1]).get(str(loc[-1]))
    return iter(metadata_of(field) if field is not None else ())
