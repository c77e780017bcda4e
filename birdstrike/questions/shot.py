"""The questions about a shot, in order: record, plate, bird, impact, clock, what is sought, effort."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from birdstrike.data.curves import Measured, measured_from, read_measured
from birdstrike.data.errors import MeasuredError, UnitError, UserError
from birdstrike.data.exports.columns import SeveralTables
from birdstrike.data.formatting import quantity
from birdstrike.data.histories import Array
from birdstrike.data.import_curve import (
    STRAIN,
    ImportOptions,
    factor_of_head,
    import_record,
    is_acceleration,
    read_export,
    stands_for,
    strain_beyond,
)
from birdstrike.data.tables.clock import counts_samples, first_clock
from birdstrike.data.tables.csv_table import read_table
from birdstrike.data.tables.loose_table import NOT_UNICODE, Head, LooseTable
from birdstrike.data.units import ACCEPTED, factor, si_unit, to_si
from birdstrike.questions.answers import Answers, Key, Question
from birdstrike.questions.checks import (
    Check,
    of_case,
    of_choice,
    of_count,
    of_limits,
    of_noise,
    of_pair,
    of_range,
    yes_or_no,
)
from birdstrike.questions.clock import duration
from birdstrike.solver.bird.shape import SHAPES
from birdstrike.solver.case.bird import PARTICLES
from birdstrike.solver.fields import Between
from birdstrike.solver.sensors.registry import SENSORS
from birdstrike.solver.sensors.sensor import PLACE
from birdstrike.solver.sensors.strain import DIRECTION
from birdstrike.solver.target.supports import NAMED

LEAVE, RECORD, FOUND = "leave", "record", "found"
CODES, FEWEST = 2, 20
"""Codes for lost readings that a column may have, and readings from which on one is looked for."""
BY_IMPORT = 'make a record of it by birdstrike import with --rate "200 kHz", and start from that'
"""What to do with a file without a clock, which no question is about."""
NODE_BY_IMPORT = "make a record of one by birdstrike import with --node, and start from that"
"""What to do with a nodout of several nodes, which no question is about."""
KIND_OF_UNIT = {"m": "displacement", "": "strain", "N": "reaction_force", "Pa": "pressure"}
"""SI unit of a column -> what it most likely is."""

UNIT_OF_KIND = {
    "displacement": "mm",
    "strain": "um/m",
    "contact_force": "kN",
    "reaction_force": "kN",
    "pressure": "MPa",
}
NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
LEVELS = {"quick": (600, 24), "standard": (1500, 36), "fine": (4500, 50)}
"""Effort -> particles of the bird, shells along the plate's longer side."""

FEWEST_SHELLS = 12
LONGEST_S = 2.5e-3
"""Of the response that is used by default [s]: each millisecond costs."""

UNTIL = Between("0.05 ms", "100 ms")
"""How much of the record after first contact may be used."""

ROUNDING_S = 1e-9  # [s] by which an answer in decimals may differ from the record's end
LATE_S = 1e-3
"""By which a record may begin after first contact [s]: if later, the clock is another, or little of the response left.
"""

UNKNOWN = "unknown"
VISCOSITY, CUTOFF = "bird.material.viscosity", "bird.material.pressure_cutoff"
Factor = Callable[[str], tuple[float, str, str]]
"""A factor in words, such as "2.5 mm/V" -> number, the unit it gives, the unit it takes."""


@dataclass(frozen=True)
class Column:
    """One column of the record as a sensor. unit: "" where the head gives it; sensor: its table in the case."""

    name: str
    unit: str
    scale: str
    sensor: Mapping[str, Any]


@dataclass(frozen=True)
class ShotAnswers:
    """All that was answered.

    values: dotted case key -> what the case file says; columns: sensor -> column of the file; contact: time of first
    contact on the record's clock, or "unknown"; sigma: its standard deviation, "" where both share a trigger; until:
    how much of the response is used; time, time_unit, decimal, table, encoding: of an export, as
    `birdstrike import` takes them; measured: whether the file is a measured-data CSV already.
    """

    record: Path
    columns: Mapping[str, Column]
    values: Mapping[str, Any]
    contact: str
    sigma: str
    until: str
    runs: int
    diagnosis: bool
    time: str = ""
    time_unit: str = ""
    decimal: str = ""
    table: str = ""
    encoding: str = ""
    simulated: bool = False
    measured: bool = False

    @property
    def name(self) -> str:
        """Name of the case and of the record, after the file."""
        return name_of(self.record)


def name_of(record: Path) -> str:
    """Name of a shot after its measured file."""
    return re.sub(r"[^A-Za-z0-9_-]+", "_", record.stem).strip("_") or "shot"


@dataclass
class Interview:
    """The questions to one source of answers; factor: reads what a column is multiplied by."""

    answers: Answers
    factor: Factor

    def ask(self, key: Key, text: str, default: Any, check: Check, allowed: str = "", stand_in: Any = None) -> Any:
        """One answer."""
        return self.answers.ask(Question(key, text, default, check, allowed, stand_in))

    def quantity(self, key: str, text: str, default: Any) -> Any:
        """A quantity of the case, asked under its own key."""
        check, allowed = of_case(key)
        return self.ask(tuple(key.split(".")), f"{text} ({allowed})", default, check, allowed)

    def choice(self, key: Key, text: str, default: str, *choices: str) -> str:
        """One of several words."""
        check, allowed = of_choice(*choices)
        return self.ask(key, f"{text} ({allowed})", default, check, allowed)

    def shot(self) -> ShotAnswers:
        """The whole interview; raises UserError with all answers that cannot be."""
        try:
            shot = self._shot()
        except UserError as error:
            self.answers.refuse(error)
            raise
        self.answers.refuse()
        return shot

    def _shot(self) -> ShotAnswers:
        """The questions in order; an answer that cannot be is kept for the end where nobody can correct it."""
        path = self.ask(
            ("record", "file"), "Measured file: CSV, text, TDMS, .mat, .xlsx, UFF58, binout", None, _readable
        )
        record = Path(path)
        text, own = "Is it simulated, not measured? (yes, no)", _says_simulated(record)
        simulated = self.ask(("record", "simulated"), text, own, yes_or_no)
        columns, clock, ready = self._columns(record)
        values = {**self.plate(), **self.bird(), **self.impact()}
        contact, sigma, until = self._clock(record, columns, clock, ready)
        values |= self._sought() | self._effort(values)
        check, allowed = of_count(5, 1000)
        runs = self.ask(("effort", "runs"), f"Effort: simulations of the campaign ({allowed})", 25, check, allowed)
        text = "Effort: look for an effect that the model lacks? (yes, no)"
        return ShotAnswers(
            record=record,
            columns=columns,
            values=values,
            contact=contact,
            sigma=sigma,
            until=until,
            runs=runs,
            diagnosis=self.ask(("effort", "diagnosis"), text, True, yes_or_no),
            simulated=simulated,
            measured=ready,
            **clock,
        )  # fmt: skip

    def _columns(self, record: Path) -> tuple[dict[str, Column], dict[str, str], bool]:
        """Sensor -> column; how clock and file are read; whether the file is a measured-data CSV already."""
        measured = _own_record(record)
        if measured is None:
            return *self._columns_of_export(record), False
        found: dict[str, Column] = {}
        for name, unit in measured.units.items():
            values, noise = measured.points(name)[1], f"{name}_sigma" if name in measured.sigma else ""
            self._column(found, name, name, Head(name, unit), values, ready=True, noise=noise)
        return _some(found, measured.channels), {}, True

    def _columns_of_export(self, record: Path) -> tuple[dict[str, Column], dict[str, str]]:
        """The same of an export, read as `birdstrike import` reads it."""
        reading = {"table": self._which_table(record), "decimal": "", "encoding": ""}
        try:
            table = _table(record, **reading)
        except MeasuredError as error:
            if "--decimal" not in str(error):
                raise
            text = "Mark of decimals, which the file leaves open"
            reading["decimal"] = self.choice(("record", "decimal"), text, ".", ".", ",")
            table = _table(record, **reading)
        reading["encoding"] = self._encoding(record, reading, table)
        if reading["encoding"]:
            table = _table(record, **reading)
        names = _names(table)
        self.answers.rename("columns", {_text(table, i): name for i, name in enumerate(names)})
        clock = self._time(table, names)
        found: dict[str, Column] = {}
        for i, name in enumerate(names):
            if i != table.index(clock["time"]) and i not in table.noises.values() and table.filled(i):
                head = table.heads[i] if table.heads else Head(name)
                counter = not head.unit and counts_samples(table, i)
                noise = _text(table, table.noises[i]) if i in table.noises else ""
                self._column(found, name, "", head, _values(table, i), counter=counter, noise=noise)
        return _some(found, names), clock | reading

    def _which_table(self, record: Path) -> str:
        """The sheet, group, struct or branch to read, "" of a file that holds one table alone."""
        several = _several(record)
        if several is None:
            return ""
        check, allowed = of_choice(*several.tables)

        def readable(value: Any) -> str:
            _refuse_unreadable(record, table=check(value))
            return value

        held = [name for name in several.tables if _can_be_read(record, table=name)]
        likely = held[0] if len(held) == 1 else None
        text = f"Record: the {several.noun} with the curves ({allowed})"
        return self.ask(("record", "table"), text, likely, readable)

    def _encoding(self, record: Path, reading: Mapping[str, str], table: LooseTable) -> str:
        """The encoding of a text whose own could only be guessed, "" where that is right or sure."""
        guessed = next((remark for remark in table.remarks if NOT_UNICODE in remark), "")
        if not guessed:
            return ""

        def check(value: Any) -> str:
            if value != FOUND:
                _table(record, **{**reading, "encoding": str(value)})
            return str(value)

        text = f"{guessed.partition(';')[0]} (columns {', '.join(table.names)}): its encoding ({FOUND}: as it was read)"
        given = self.ask(("record", "encoding"), f"Record: {text}", FOUND, check)
        return "" if given == FOUND else given

    def _time(self, table: LooseTable, names: tuple[str, ...]) -> dict[str, str]:
        """The clock's column and, where its head gives none, its unit."""
        units = [_si(head.unit) for head in table.heads] or [None] * table.width
        place = first_clock(table)
        likely, text = names[place], "Column of the clock"
        if units[place] not in (None, "s"):
            likely, text = None, f"{text} (if the file has none, {BY_IMPORT})"

        def check(value: Any) -> str:
            unit = units[table.index(chosen := _one_of(names)(value))]
            if unit not in (None, "s"):
                raise UserError(
                    f"is no time by its unit; choose the clock's column, or, if the file has none, {BY_IMPORT}"
                )
            return chosen

        name = self.ask(("record", "time"), text, likely, check, ", ".join(names))
        if units[table.index(name)] == "s":
            return {"time": name, "time_unit": ""}
        of_time, allowed = of_choice("s", "ms", "us")
        likely = table.likely_time_unit(table.index(name))
        return {
            "time": name,
            "time_unit": self.ask(("record", "time_unit"), "Unit of the clock", likely, of_time, allowed),
        }

    def _column(
        self,
        found: dict[str, Column],
        column: str,
        name: str,
        head: Head,
        values: Array,
        *,
        ready: bool = False,
        counter: bool = False,
        noise: str = "",
    ) -> None:
        """What one column is, entered under the name of its sensor.

        values: its readings, in SI where the head gives the unit; ready: it has its unit and the name that it is to
        have already; counter: it numbers the rows; noise: name of the record's column with its standard deviation, if
        there is one.
        """
        place, shown = ("columns", column), f'Column "{column}"'
        unit, foreign = _si(head.unit), "" if head.likely else head.foreign
        measured = si_unit(head.likely) if head.likely else unit
        first = measured is None and not found and not is_acceleration(foreign)
        likely = "displacement" if first else KIND_OF_UNIT.get("-" if measured is None else measured, LEAVE)
        plain = column.lower().replace(" ", "_")
        likely = next((kind for kind in SENSORS if plain.startswith(kind)), LEAVE if counter else likely)
        kind = self.choice((*place, "kind"), f"{shown}: what is it?", likely, *SENSORS, LEAVE)
        if kind == LEAVE:
            return
        if not name:
            own = "displacement_centre" if kind == "displacement" else kind
            free = own if own not in found else f"{kind}_{sum(c.sensor['kind'] == kind for c in found.values()) + 1}"
            name = self.ask((*place, "name"), f"{shown}: name of the sensor", free, _new_name(found))
        values = _sound(values)
        reached = float(np.abs(values).max(initial=0.0))
        given = "" if ready else self._unit(place, shown, kind, head, reached)
        turned = kind == "displacement" and _downwards(values)
        doubt = "" if kind != "strain" or foreign else _beyond(reached * float(factor(given or "m/m")))
        if stated := factor_of_head(head):
            doubt = f'its head states a factor, "{stated}"; factor: 1 where the readings are in the unit as they stand'
        asked = not ready or turned or doubt
        scale = str(self._scale(place, shown, kind, foreign, turned, doubt, bare=ready)) if asked else "1"
        sensor: dict[str, Any] = {"kind": kind}
        if "at" in SENSORS[kind].model_fields:
            check = of_pair(of_range(PLACE)[0])
            text = f"{shown}: place from the plate's centre, along length and width (such as 60 mm, 0 mm)"
            sensor["at"] = self.ask((*place, "at"), text, ["0 mm", "0 mm"], check)
        if kind == "strain":
            check, allowed = of_range(DIRECTION)
            text = f"{shown}: direction of the gauge, from the length towards the width"
            sensor["direction"] = self.ask((*place, "direction"), text, "0 deg", check, allowed)
            sensor["side"] = self.choice((*place, "side"), f"{shown}: side of the plate", "back", "back", "impact")
        stated = self._noise((*place, "noise"), shown, kind, noise)
        found[name] = Column(column, given, scale, sensor | ({} if stated == RECORD else {"noise": stated}))

    def _noise(self, key: Key, shown: str, kind: str, column: str) -> Any:
        """The noise that is stated of a sensor; that of the record's `column` counts, where there is one."""
        if column:
            text = f'{shown}: noise, by the record\'s column "{column}"'
            return self.answers.settle(Question(key, text, RECORD, _noise_of(column)))
        check = of_noise(SENSORS[kind])
        text = f"{shown}: noise, 1 sigma, if known ({RECORD}: its own)"
        return self.ask(key, text, RECORD, lambda value: value if value == RECORD else check(value))

    def _unit(self, place: Key, shown: str, kind: str, head: Head, reached: float) -> str:
        """A unit where the head gives none; a factor such as 2.5 mm/V brings its own. reached: largest reading."""
        if head.unit is not None or (head.foreign and not head.likely):
            return ""
        wanted = KINDS_UNIT[kind]
        text = f"{shown}: unit, which its head does not give ({ACCEPTED.get(wanted) or 'um/m, %, -'})"
        likely = "m/m" if kind == "strain" and reached <= STRAIN else UNIT_OF_KIND[kind]
        return self.ask((*place, "unit"), text, head.likely_in((wanted,)) or likely, _unit_of(wanted))

    def _scale(self, place: Key, shown: str, kind: str, foreign: str, turned: bool, doubt: str, bare: bool) -> Any:
        """What the column is multiplied by; a displacement whose largest reading is negative is turned round.

        doubt: why the factor has no default; bare: the column has its unit, and is multiplied by a number alone.
        """
        if doubt:
            text = doubt
        else:
            what = (
                f"it is in {foreign}: factor such as {stands_for(foreign, kind)}"
                if foreign
                else "factor; -1 turns the curve round"
            )
            sign = " (displacement is positive in the direction of the push)" if kind == "displacement" else ""
            text = f"{what}{sign}"
        return self.ask(
            (*place, "scale"),
            f"{shown}: {text}",
            None if foreign or doubt else (-1 if turned else 1),
            self._number_check if bare else self._factor_check,
            stand_in=1,
        )

    def _number_check(self, value: Any) -> Any:
        found = self._factor_check(value)
        if isinstance(found, str):
            raise UserError("has a unit, and so has the record's column already; write a bare number, such as -1")
        return found

    def _factor_check(self, value: Any) -> Any:
        try:
            number, unit, _ = self.factor(str(value))
        except UserError as error:
            raise UserError([line.removeprefix(f"--scale {value} ") for line in error.errors]) from error
        return value if unit else int(number) if number.is_integer() else number

    def plate(self) -> dict[str, Any]:
        """Size, edges and metal of the plate."""
        return {
            "plate.length": self.quantity("plate.length", "Plate: length, along the bird's flight", "525 mm"),
            "plate.width": self.quantity("plate.width", "Plate: width", "430 mm"),
            "plate.thickness": self.quantity("plate.thickness", "Plate: thickness", "10 mm"),
            "plate.edges": self.choice(("plate", "edges"), "Plate: edges", "clamped", *NAMED),
            "plate.material.young": self.quantity("plate.material.young", "Plate: Young's modulus", "71 GPa"),
            "plate.material.poisson": self.quantity("plate.material.poisson", "Plate: Poisson's ratio", 0.3),
            "plate.material.density": self.quantity("plate.material.density", "Plate: density", "2780 kg/m^3"),
            "plate.material.yield_stress": self.quantity(
                "plate.material.yield_stress", "Plate: yield stress", "690 MPa"
            ),
        }

    def bird(self) -> dict[str, Any]:
        """Shape, size and mass of the bird."""
        shape = self.choice(("bird", "shape"), "Bird: shape", "hemispherical_cylinder", *SHAPES)
        found = {
            "bird.shape": shape,
            "bird.diameter": self.quantity("bird.diameter", "Bird: diameter", "106 mm"),
        }
        if shape == "sphere":
            found["bird.length"] = None
        else:
            found["bird.length"] = self.quantity("bird.length", "Bird: length overall, round ends included", "262 mm")
        return found | {"bird.mass": self.quantity("bird.mass", "Bird: mass", "1.8 kg"), "bird.density": None}

    def impact(self) -> dict[str, Any]:
        """Speed, angle and aim."""
        aim = self.choice(("impact", "aim"), "Impact: what meets the plate's centre", "axis", "axis", "first_touch")
        text = "Impact: angle from the plate's SURFACE, 90 deg is head-on"
        return {
            "impact.speed": self.quantity("impact.speed", "Impact: speed", "91.1 m/s"),
            "impact.angle": self.quantity("impact.angle", text, "30 deg"),
            "impact.aim": aim,
        }  # fmt: skip

    def _clock(
        self, record: Path, columns: Mapping[str, Column], clock: Mapping[str, str], ready: bool
    ) -> tuple[str, str, str]:
        """When the bird touches the plate on the record's clock, how well that is known, and how much is used."""
        measured = _record(record, columns, clock, ready)
        text = "Clock: time of first contact in the record, or unknown: then one simulation shows it"
        contact = self.ask(("clock", "contact"), text, UNKNOWN, _contact(measured, record.name))
        check, allowed = of_range(Between("0 ms", "10 ms"))
        text = f"Clock: how well that is known, 1 sigma ({allowed}; 0 ms: exactly)"
        sigma = self.ask(("clock", "sigma"), text, "0.05 ms", check, allowed)
        whole = duration(measured) if contact == UNKNOWN else float(measured.time[-1]) - to_si(contact, "s")
        check, allowed = _until(measured, record.name, contact, min(_tenths(whole), UNTIL.bounds[1]))
        text = f"Clock: how long after first contact the record is used ({allowed})"
        default = f"{1e3 * _tenths(min(LONGEST_S, whole)):.1f} ms"
        until = self.ask(("clock", "until"), text, default, check, allowed)
        return contact, "" if Between("0 ms", "10 ms").validate(sigma) == 0.0 else sigma, until

    def _sought(self) -> dict[str, Any]:
        """The ranges in which the bird's constants are sought."""
        found = {}
        for key, text, default in (
            (VISCOSITY, "Sought: viscosity MU of the bird lies in", ["0 Pa s", "1500 Pa s"]),
            (CUTOFF, "Sought: pressure cutoff PC of the bird lies in", ["-1.25 MPa", "-0.05 MPa"]),
        ):
            check, allowed = of_limits(key)
            found[f'inversion.parameters."{key}".range'] = self.ask(
                ("sought", key.rsplit(".", 1)[-1]), text, default, check, allowed
            )
        return found

    def _effort(self, values: Mapping[str, Any]) -> dict[str, Any]:
        """The meshes of bird and plate."""
        level = self.choice(("effort", "level"), "Effort: detail of the model", "standard", *LEVELS)
        particles, shells = LEVELS[level]
        check, allowed = of_count(PARTICLES.low, PARTICLES.high)
        text = "Effort: particles of the bird"
        found: dict[str, Any] = {
            "bird.particles": self.ask(("effort", "particles"), text, particles, check, allowed),
        }
        pair = of_pair(of_count(2, 400)[0])
        text = "Effort: shells along length and width"
        found["plate.elements"] = self.ask(("effort", "elements"), text, _elements(values, shells), pair, "2 .. 400")
        return found


KINDS_UNIT = {kind: unit for unit, kind in KIND_OF_UNIT.items()} | {"contact_force": "N"}


def _elements(values: Mapping[str, Any], longer: int) -> list[int]:
    """Shells along length and width: `longer` along the longer side, square where that leaves enough of them."""
    mark = Between("1 mm", "100000 mm")
    sides = [mark.si(values[key]) for key in ("plate.length", "plate.width")]
    return [max(FEWEST_SHELLS, round(longer * side / max(sides))) for side in sides]


def _record(record: Path, columns: Mapping[str, Column], clock: Mapping[str, str], ready: bool) -> Measured:
    """The chosen columns as they stand in the file, in whatever unit: only their shape is looked at."""
    if ready:
        return read_measured(record).only(tuple(columns))
    reading = {key: clock[key] for key in ("table", "decimal", "encoding")}
    table = _table(record, **reading)
    heads = {name: table.heads[table.index(column.name)] for name, column in columns.items()} if table.heads else {}
    per = {name: head.foreign for name, head in heads.items() if head.foreign and not head.likely}
    needed = [name for name in columns if name in per or name not in heads or heads[name].unit is None]
    units = {name: columns[name].unit or UNIT_OF_KIND[columns[name].sensor["kind"]] for name in needed}
    units |= {"time": clock["time_unit"]} if clock["time_unit"] else {}
    sensors = {name: column.name for name, column in columns.items()}
    factors = dict.fromkeys(columns, 1.0)  # those of the answers multiply the record
    options = replace(_options(**reading), sensors=sensors, time=clock["time"], units=units, scales=factors, per=per)
    try:
        return import_record(record, options)
    except MeasuredError as error:
        if "--rate" not in str(error):
            raise
        raise MeasuredError([*error.errors, f"{BY_IMPORT[0].upper()}{BY_IMPORT[1:]}"]) from error


def _table(record: Path, *, table: str = "", decimal: str = "", encoding: str = "") -> LooseTable:
    """The table in the file, as `birdstrike import` reads it: once, for several questions look at it."""
    return _read_once(record, record.stat().st_mtime_ns, table, decimal, encoding)


@lru_cache(maxsize=1)
def _read_once(record: Path, _written_ns: int, table: str, decimal: str, encoding: str) -> LooseTable:
    """The table in a file as it was written at an instant."""
    return read_export(record, _options(table, decimal, encoding))[0]


def _options(table: str, decimal: str, encoding: str) -> ImportOptions:
    """How a file is read, whatever is taken from it."""
    return ImportOptions({}, table=table, decimal=decimal, encoding=encoding)


def _several(record: Path) -> SeveralTables | None:
    """What a file says that holds several tables; None for any other."""
    try:
        _refuse_unreadable(record)
    except SeveralTables as several:
        return several
    return None


def _can_be_read(record: Path, **reading: str) -> bool:
    """Whether there is a table, its mark of decimals aside, which is asked for."""
    try:
        _refuse_unreadable(record, **reading)
    except MeasuredError:
        return False
    return True


def _refuse_unreadable(record: Path, **reading: str) -> None:
    """Raises MeasuredError where no answer makes a table of the file: its mark of decimals is asked for."""
    try:
        _table(record, **reading)
    except MeasuredError as error:
        if "--decimal" not in str(error):
            raise


def _own_record(record: Path) -> Measured | None:
    """A measured-data CSV; None for any other file."""
    try:
        return measured_from(read_table(record), record)
    except (MeasuredError, UnitError):
        return None


def _beyond(reached: float) -> str:
    """What is asked of a strain that no gauge survives; empty for one that it does."""
    said = strain_beyond(reached)
    return f"{said}; factor: 1e-6 if it is microstrain, 0.01 if per cent" if said else ""


def _some(found: dict[str, Column], names: Any) -> dict[str, Column]:
    """Raises UserError where every column was left out."""
    if not found:
        raise UserError(f"every column was left out; at least one must be a sensor: {', '.join(names)}")
    return found


def _names(table: LooseTable) -> tuple[str, ...]:
    """A spelling of every column that means it alone: its name, with its unit where that is needed, else its number."""

    def spelt(column: int) -> str:
        for text in (table.names[column], _text(table, column)):
            with suppress(MeasuredError):
                if table.index(text) == column:
                    return text
        return str(column + 1)

    return tuple(spelt(column) for column in range(table.width))


def _text(table: LooseTable, column: int) -> str:
    """A column's head as it stands in the file, its unit included."""
    return table.heads[column].text if table.heads else table.names[column]


def _values(table: LooseTable, column: int) -> Array:
    """A column's readings, gaps left out, in SI where its head gives the unit."""
    unit = table.heads[column].unit if table.heads else None
    size = 1.0 if _si(unit) is None else float(factor(unit or "m/m"))
    return np.array([size * float(cells[column]) for _, cells in table.rows if cells[column]])


def _sound(values: Array) -> Array:
    """Readings (n,) without a code for lost ones, such as -999: one value, farther off all others than they differ."""
    for _ in range(CODES):
        if len(values) < FEWEST:
            break
        code = values[int(np.argmax(np.abs(values - np.median(values))))]
        others = values[values != code]
        if not len(others) or float(np.abs(others - code).min()) <= float(np.ptp(others)):
            break
        values = others
    return values


def _downwards(values: Array) -> bool:
    """Whether the reading that differs most from the first ones is below them."""
    if not len(values):
        return False
    off = values - float(np.median(values[:5]))
    return bool(off[int(np.argmax(np.abs(off)))] < 0.0)


def _si(unit: str | None) -> str | None:
    """SI unit of a column's head, None for none."""
    try:
        return None if unit is None else si_unit(unit)
    except UnitError:
        return None


def _says_simulated(record: Path) -> bool:
    """Whether a record in our own format says so; what a laboratory wrote is for its owner to say."""
    own = _own_record(record)
    return own is not None and own.simulated


def _readable(value: Any) -> str:
    path = Path(str(value)).expanduser()
    if not path.is_file():
        raise UserError("is no file here; give its path")
    if _own_record(path) is None:
        try:
            _refuse_unreadable(path)
        except SeveralTables:
            pass
        except MeasuredError as error:
            remedies = {"--rate": BY_IMPORT, "--node": NODE_BY_IMPORT}
            remedy = next((f"; {text}" for option, text in remedies.items() if option in str(error)), "")
            raise UserError([f"cannot be read: {line}{remedy}" for line in error.errors]) from error
    return str(path)


def _one_of(names: tuple[str, ...]) -> Check:
    def check(value: Any) -> str:
        if value not in names:
            raise UserError(f"is no column; its columns: {', '.join(names)}")
        return value

    return check


def _new_name(found: Mapping[str, Column]) -> Check:
    def check(value: Any) -> str:
        if not NAME.fullmatch(str(value)) or str(value) in ("time", "run") or str(value).endswith("_sigma"):
            raise UserError("cannot be a sensor's name; use letters, digits and _ (not time, run or ..._sigma)")
        if value in found:
            raise UserError(f'is the name of column "{found[value].name}" already')
        return str(value)

    return check


def _noise_of(column: str) -> Check:
    """Check of a noise that the record's column gives."""

    def check(value: Any) -> str:
        if value != RECORD:
            raise UserError(
                f'would not be used: the noise in the record\'s column "{column}" is; leave this answer out'
            )
        return RECORD

    return check


def _unit_of(wanted: str) -> Check:
    def check(value: Any) -> str:
        if _si(str(value)) != wanted:
            raise UserError(f"is no unit of this; accepted: {ACCEPTED.get(wanted) or 'um/m, microstrain, %, -'}")
        return str(value)

    return check


def _tenths(length: float) -> float:
    """A length [s] rounded up to a tenth of a millisecond."""
    return float(np.ceil(1e4 * (length - ROUNDING_S)) / 1e4)


def _contact(measured: Measured, name: str) -> Check:
    """Check of the time of first contact on the clock of the record `name`, or of `unknown`."""
    number, _ = of_range(Between("-10000 ms", "10000 ms"))
    earliest, latest = float(measured.time[0]) - LATE_S, float(measured.time[-1]) - UNTIL.bounds[0]

    def check(value: Any) -> Any:
        if value == UNKNOWN:
            return value
        given = number(value)
        if not earliest <= to_si(given, "s") <= latest:
            raise UserError(
                f"is outside {quantity(earliest, 's', 4)} .. {quantity(latest, 's', 4)}: {name} {_runs(measured)}, "
                f'and its response follows first contact; correct the time, or write "{UNKNOWN}": then one simulation '
                "shows it"
            )
        return given

    return check


def _until(measured: Measured, name: str, contact: str, longest: float) -> tuple[Check, str]:
    """Check of how much of the record `name` is used after first contact; longest: until its end [s]."""
    number, _ = of_range(UNTIL)
    begins = "its response begins" if contact == UNKNOWN else "first contact"
    second = 0.0 if contact == UNKNOWN else float(measured.time[1]) - to_si(contact, "s")
    shortest = max(UNTIL.bounds[0], second)
    allowed = f"{quantity(shortest, 's', 4)} .. {1e3 * longest:.1f} ms"

    def check(value: Any) -> Any:
        given = number(value)
        if not shortest <= to_si(given, "s") <= longest + ROUNDING_S:
            raise UserError(
                f"is outside {allowed}: {name} {_runs(measured)}, {1e3 * longest:.1f} ms after {begins}; write a "
                "time in between, or leave the answer out"
            )
        return given

    return check, allowed


def _runs(measured: Measured) -> str:
    """From when to when a record goes."""
    return f"runs from {quantity(float(measured.time[0]), 's', 4)} to {quantity(float(measured.time[-1]), 's', 4)}"
