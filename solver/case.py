"""A case: everything that defines one strike, its sensors and instruments, and what an inversion may vary."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, PrivateAttr, ValidationError, field_validator

from data.errors import CaseError
from data.units import quantity_text
from solver.case_bird import Bird
from solver.case_fields import Later, Section
from solver.case_files import override_table, read_case
from solver.case_messages import error_line
from solver.case_overlay import Raw, overlay
from solver.case_plate import Plate
from solver.case_rules import broken_rules
from solver.case_sections import Impact, Time, quantity_at
from solver.case_sensor_rules import broken_sensor_rules
from solver.case_sensors import DEFAULT_SENSORS, Instrument, Sensor
from solver.case_settings import InversionSettings, SolverSettings
from solver.case_table import with_table


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
    instrument: dict[str, Instrument] = Field(default_factory=dict)

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
        return self.overlaid(_table(values))

    def overlaid(self, table: Raw) -> Case:
        """The case with a table, as TOML gives it, laid over its own, validated anew; raises CaseError."""
        return case_from_table(overlay(self._raw, table), self._name)

    def with_mesh(self, particles: int, elements: tuple[int, int]) -> Case:
        """The case with another bird and plate mesh, validated anew; raises CaseError."""
        return self.overlaid({"bird": {"particles": particles}, "plate": {"elements": list(elements)}})

    def canonical(self) -> dict[str, Any]:
        """Nested SI values of everything that changes a history; no noise, inversion or threads."""
        tree = self.model_dump(mode="json", include={"plate", "bird", "impact", "time", "solver"})
        del tree["solver"]["threads"]
        for key in ("mass", "slenderness", "statistics"):
            del tree["bird"][key]
        tree["bird"]["density"] = self.bird.actual_density
        if not self.plate.rigid:
            del tree["plate"]["rigid"]
        tree["sensors"] = {name: sensor.canonical() for name, sensor in self.sensors.items()}
        acting = {name: own.model_dump(mode="json") for name, own in self.instrument.items() if own != Instrument()}
        return tree | ({"instrument": acting} if acting else {})


def load_case(path: str | Path, overrides: Mapping[str, str] | None = None) -> Case:
    """Case from a TOML file or a shipped case's name, `--set` texts laid over it; raises CaseError with all errors."""
    table = with_table(overlay(read_case(path), override_table(overrides or {})), Path.cwd())
    return case_from_table(table, Path(path).stem)


def case_from_table(table: Raw, name: str = "case") -> Case:
    """Case from a table as TOML gives it; raises CaseError with all errors."""
    errors: list[str] = []
    case = None
    try:
        case = Case.model_validate(table)
    except ValidationError as error:
        errors = [error_line(Case, entry, table) for entry in error.errors()]
    errors += [*broken_rules(table), *broken_sensor_rules(table)]
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
