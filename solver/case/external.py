"""What a case says of somebody else's solver: its command, the deck's template, and where its sensors are read."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, field_validator
from pydantic_core import PydanticCustomError, core_schema

from birdstrike.data.errors import CaseError
from birdstrike.data.paths import is_file
from birdstrike.data.units import ACCEPTED, UnitError, si_unit
from birdstrike.solver.case.overlay import Raw
from birdstrike.solver.case.sections import at
from birdstrike.solver.fields import Between, Count, OneOf, Section, checked, complaint, shortened
from birdstrike.solver.registry import Kinds
from birdstrike.solver.sensors.registry import DEFAULT_SENSORS, SENSORS


@dataclass(frozen=True)
class Text:
    """A text that is not empty; hint: what it might be."""

    hint: str

    def validate(self, value: Any) -> str:
        """The text itself; raises PydanticCustomError."""
        if not isinstance(value, str) or not value.strip():
            raise complaint(f"must be a text such as {self.hint}")
        return value

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> core_schema.CoreSchema:
        return checked(self.validate)


LONGEST_NAME = 255
"""Bytes of a file's name on any common file system."""


@dataclass(frozen=True)
class FileText(Text):
    """The name of a file, such that there can be one."""

    def validate(self, value: Any) -> str:
        """The text itself; raises PydanticCustomError."""
        text = super().validate(value)
        if "\0" in text:
            raise complaint("holds a NUL character, which no file's name does; leave it out")
        longest = max(len(part.encode()) for part in Path(text).parts or ("",))
        if longest > LONGEST_NAME:
            raise complaint(f"is longer than any file's name: {longest} bytes, at most {LONGEST_NAME}; shorten it")
        return text


@dataclass(frozen=True)
class UnitText:
    """A unit's name; dimension: the SI unit that it must measure, None for any that the project uses."""

    dimension: str | None = None

    def validate(self, value: Any) -> str:
        """The unit itself; raises PydanticCustomError."""
        try:
            found = si_unit(value) if isinstance(value, str) else None
        except UnitError as error:
            raise complaint(f"is not understood: {error}") from error
        if found is None or self.dimension not in (None, found):
            accepted = ACCEPTED[self.dimension or "m"]
            raise complaint(f"must be a unit in quotes; accepted units: {accepted}")
        return value

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> core_schema.CoreSchema:
        return checked(self.validate)


class Reading(Section):
    """Where one sensor stands in the solver's output: file, the units in it, and a factor such as -1 for the sign."""

    format: Annotated[str, OneOf(("csv", "columns", "nodout"))]
    file: Annotated[str, FileText('"sensors.csv"')]
    unit: Annotated[str, UnitText()] = ""
    time_unit: Annotated[str, UnitText("s")] = "s"
    factor: Annotated[float, Between(-1e12, 1e12)] = 1.0

    @field_validator("file", mode="after")
    @classmethod
    def _file_of_the_run_alone(cls, value: str) -> str:
        if Path(value).is_absolute() or ".." in Path(value).parts:
            raise complaint(
                "leaves the folder of the run, and other runs would read and write it too; let the solver write to the "
                'folder that it is run in, and give a name there, such as "sensors.csv"'
            )
        return value

    @field_validator("factor", mode="after")
    @classmethod
    def _factor_leaves_something(cls, value: float) -> float:
        if value == 0.0:
            raise complaint("would make every reading 0; write 1, or -1 to change the sign")
        return value


class CsvReading(Reading):
    """A CSV with a header; column, time: names in the header (time: the first column unless named)."""

    column: Annotated[str, Text('"z_disp"')]
    time: Annotated[str, Text('"time"')] | None = None


class ColumnsReading(Reading):
    """Numbers in columns, apart by blanks or commas; column: its number, the time's being 1."""

    column: Annotated[int, Count(2, 1000)] = 2


class NodoutReading(Reading):
    """LS-DYNA's nodout: a block of nodes for every instant; component: as its header names it, such as z-disp."""

    node: Annotated[int, Count(1, 10**10)]
    component: Annotated[str, Text('"z-disp"')]


FORMATS = Kinds(
    "format of a solver's output",
    "format",
    None,
    {"csv": CsvReading, "columns": ColumnsReading, "nodout": NodoutReading},
    Reading,
)


class External(Section):
    """A command that is run in a folder of its own over the rendered template.

    command: words; `{input}` stands for the deck's name. template: the deck with {{ placeholders }}; files: others that
    it needs beside it. version: solver and release, part of every run's name in the store. success: text without which
    the solver's output does not count as a normal end. time_limit [s]. keep: which runs' folders stay. scratch: where
    they are made, the system's temporary folder by default.
    """

    command: tuple[Annotated[str, Text('"lsdyna"')], ...]
    template: Annotated[str, FileText('"strike.k.j2"')]
    version: Annotated[str, Text('"LS-DYNA R14.1 double"')]
    sensors: dict[str, Annotated[Reading, FORMATS]]
    files: tuple[Annotated[str, FileText('"mesh.k"')], ...] = ()
    success: Annotated[str, Text('"N o r m a l    t e r m i n a t i o n"')] | None = None
    time_limit: Annotated[float, Between("0.1 s", "1e7 s")] = Field(default=86400.0)
    keep: Annotated[str, OneOf(("failed", "all", "none"))] = "failed"
    scratch: Annotated[str, FileText('"/scratch"')] | None = None

    @field_validator("command", mode="after")
    @classmethod
    def _some_word(cls, value: tuple[str, ...]) -> tuple[str, ...]:
        if not value:
            raise complaint('is empty; write a list of words such as ["lsdyna", "i={input}"]')
        return value

    @property
    def inputs(self) -> tuple[Path, ...]:
        """Template and files."""
        return tuple(map(Path, (self.template, *self.files)))

    def canonical(self) -> dict[str, Any]:
        """What changes a history: contents in place of paths, the command without its folder."""
        program, *words = self.command
        return {
            "command": [Path(program).name, *words],
            "inputs": {path.name: _digest(path, path.stat().st_mtime_ns) for path in self.inputs},
            "sensors": {name: reading.model_dump(mode="json") for name, reading in self.sensors.items()},
            "success": self.success,
        }


@cache
def _digest(path: Path, _changed_ns: int) -> str:
    """SHA-256 of a file's content, read again only when the file has changed."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def with_deck(raw: Raw, folder: Path) -> Raw:
    """The case's table with the paths of `external` made absolute; raises CaseError for a file that is not there.

    folder: that of the file in which the case stands; a path is relative to it. What is no text is left to the fields.
    """
    external = raw.get("external")
    if not isinstance(external, dict):
        return raw
    given = external | {}
    if isinstance(external.get("template"), str):
        given["template"] = str(_found(folder, external["template"], "template"))
    if isinstance(external.get("files"), list):
        given["files"] = [
            str(_found(folder, name, "files")) if isinstance(name, str) else name for name in external["files"]
        ]
    files = given["files"] if isinstance(given.get("files"), list) else []
    names = [Path(name).name for name in (given.get("template"), *files) if isinstance(name, str)]
    if len(set(names)) < len(names):
        raise CaseError("external.template and external.files hold one name twice; they share a folder when they run")
    return raw | {"external": given}


def _found(folder: Path, name: str, key: str) -> Path:
    path = folder / Path(name).expanduser()
    if not is_file(path):
        given, where = shortened(f"external.{key} = {name}"), shortened(str(path.parent))
        raise CaseError(f"{given} is no file in {where}; a path is relative to the case's file")
    return path.resolve()


def broken_external_rules(raw: Raw) -> Iterator[str]:
    """One line for every sensor of an external case that cannot be read, and every reading of no sensor."""
    external, name = raw.get("external"), raw.get("solver")
    if (name if isinstance(name, str) else at(raw, "solver.name")) != "external":
        return
    if not isinstance(external, dict):
        yield 'solver = "external" needs a section [external]: command, template, version and sensors'
        return
    readings = external.get("sensors")
    sensors = raw.get("sensors") or {key: {"kind": own.kind} for key, own in DEFAULT_SENSORS.items()}
    if not isinstance(readings, dict) or not isinstance(sensors, dict):
        return
    for sensor, fields in sensors.items():
        if sensor not in readings:
            yield f"external.sensors.{sensor} is missing: where does the solver write the sensor {sensor}?"
        elif isinstance(fields, dict) and isinstance(readings[sensor], dict):
            yield from _other_dimension(sensor, fields, readings[sensor])
    inputs = external.get("files")
    given = [Path(one).name for one in inputs if isinstance(one, str)] if isinstance(inputs, list) else []
    for sensor, reading in readings.items():
        if sensor not in sensors:
            yield f"external.sensors.{sensor} is no sensor of the case; its sensors: {', '.join(sensors)}"
        elif (file := at(reading, "file")) in given:
            yield (
                f'external.sensors.{sensor}.file = "{file}" is among external.files: where the solver writes none, the '
                "old one would be read as its result; leave it out of external.files"
            )


def _other_dimension(sensor: str, fields: Raw, reading: Raw) -> Iterator[str]:
    """The unit of a reading that does not fit the kind of its sensor."""
    kind, unit = SENSORS.chosen(fields), reading.get("unit", "")
    try:
        UnitText().validate(unit)
    except PydanticCustomError:
        return  # an error of the field itself
    if kind is not None and si_unit(unit) != (own := kind.noise_range.unit):
        given = f'external.sensors.{sensor}.unit = "{unit}"'
        yield f"{given} does not fit a sensor of kind {fields['kind']}; accepted units: {ACCEPTED[own]}"
