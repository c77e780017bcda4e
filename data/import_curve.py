"""Other people's curves as a record: a nodout, two columns of text, or a CSV with headers of its own."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal
from pathlib import Path
from typing import NoReturn

import numpy as np

from birdstrike.data.curves import Measured, measured_from
from birdstrike.data.errors import MeasuredError, UnitError
from birdstrike.data.exports.nodout import is_nodout, read_nodout
from birdstrike.data.exports.rcforc import is_rcforc, read_rcforc
from birdstrike.data.exports.registry import may_hold_tables, reader_of
from birdstrike.data.storage.files import file_digest
from birdstrike.data.tables.clock import counts_samples, first_clock, first_filled, is_called_time, is_time, runs_evenly
from birdstrike.data.tables.csv_table import NAME, Column, CsvTable
from birdstrike.data.tables.loose_table import (
    MEASURED,
    SIGMA,
    TIME,
    Head,
    LooseTable,
    SeveralColumns,
    read_loose_table,
)
from birdstrike.data.units import ACCEPTED, dimension, factor, is_power, parts, ratio, scaled, si_unit, to_si

RATE_OFF = Decimal("0.02")
"""Share by which a file's own clock and a rate may differ."""
_SAMPLES = re.compile(r"([kKM]?)(?:fps|frames/s|Sa?/s|samples/s|Sa?ps|SPS)")
"""Samples or frames a second, with a thousand or a million of them; pint takes them for feet and siemens."""
_FACTOR = re.compile(
    r"(?:(?<!\w)x|[\u00d7*\u00b7])\s*"
    r"(?:10\s*(?:\^|\*\*)\s*\(?[+-]?\d+|10\s*(?:[-\u2212][369]|[\u207a\u207b]?[\u00b9\u00b2\u00b3\u2070-\u2079]+)"
    r"|10?(?:\.\d*)?[eE][+-]?\d+|10{3}|10{6}|0[.,]0*1)(?!\w)"
)
"""A factor in a head: x10^-3, x10-3, × 1e6, *1000; x100 may be a place."""
_RATE = re.compile(r"sampl|rate|abtast|interval|increment|\bdt\b|\bfs\b|hz\b", re.IGNORECASE)
"""A line of a file's head that says how often was sampled."""


_EXAMPLES = {"force": ("50", "kN"), "pressure": ("10", "MPa"), "strain": ("2000", "um/m")}
"""Part of a sensor's name -> a number and a unit for messages."""
STRAIN = 1.0
"""A strain that no gauge survives: bonded foil ends at 0.2."""
GRAVITIES = ("g", "G", "g_n", "gn", "gee")
"""How heads of accelerometers write the standard gravity."""
_FORCES = {"lb": "lbf", "lbs": "lbf", "t": "tf"}
"""Units of mass that a head may name for a force; all others for kilograms of force."""


@dataclass(frozen=True)
class ImportOptions:
    """What to take from a file.

    sensors: name in the case -> column, "" to find it; time: the clock's column, "" for the first; units: sensor or
    "time" -> unit where the file gives none; scales: sensor -> factor, -1 for a curve that points the other way; per:
    sensor -> unit of the column that the factor multiplies, such as V where the factor is in mm/V; shift: text with a
    unit that is added to the clock; node: of a nodout; simulated: no instrument took this curve; decimal: mark of the
    decimals, "," or ".", where the file leaves it open; table: of a file that holds several; rate: samples a second,
    or the time between two, where the file has no clock: "200 kHz", "5 us"; encoding: of a text, "" to
    find it; stated: sensors whose noise is stated otherwise, so that a column of noise beside theirs is not read.
    """

    sensors: Mapping[str, str]
    time: str = ""
    units: Mapping[str, str] = field(default_factory=dict)
    scales: Mapping[str, float] = field(default_factory=dict)
    shift: str = ""
    node: int | None = None
    simulated: bool = False
    decimal: str = ""
    table: str = ""
    per: Mapping[str, str] = field(default_factory=dict)
    rate: str = ""
    stated: Collection[str] = ()
    encoding: str = ""


def strain_beyond(reached: float) -> str:
    """What is said of a strain as it was read where no gauge survives its largest reading; empty for any other."""
    said = f"it was read as a strain of up to {reached:.4g} (1 is 100 %), which no gauge survives"
    return said if reached > STRAIN else ""


def import_record(path: str | Path, options: ImportOptions) -> Measured:
    """The curves as a record with its provenance, checked like any record; raises MeasuredError and UnitError.

    A column `<name>_sigma` beside that of a sensor is its noise, in the sensor's unit where it has none.
    """
    _refuse_options(options)
    _refuse_names(options.sensors)
    _refuse_scales(options.scales)
    _refuse_units(options.units)
    if options.rate:
        _interval(options.rate)
    table, nodout = read_export(path, options)
    if options.node is not None and not nodout:
        raise MeasuredError(f"{path} is no nodout: --node has nothing to choose from; name a column instead")
    clock = _clock_place(table, options)
    columns = {name: _place(table, name, column, clock, nodout) for name, column in options.sensors.items()}
    if clock is not None and not options.rate:
        _refuse_other_clocks(table, clock, columns, bool(options.time))
    if clock is not None:
        table = _without_empty_rows(table, (clock, *columns.values()))
    time = _time(table, clock, options)
    sensors = [_column(table, index, name, options) for name, index in columns.items()]
    given = (*options.stated, *(name.removesuffix(SIGMA) for name in columns if name.endswith(SIGMA)))
    noises = {name: table.noises[i] for name, i in columns.items() if i in table.noises and name not in given}
    sensors += [_noise(table, index, columns[name], name, options) for name, index in noises.items()]
    used = [*([] if clock is None else [clock]), *columns.values(), *noises.values()]
    return measured_from(CsvTable((time, *sensors), _provenance(table, options, used, nodout)), path)


def _without_empty_rows(table: LooseTable, columns: Collection[int]) -> LooseTable:
    """The table without the rows that are empty in all of these columns, as below the shorter of two records.

    Raises MeasuredError where no row is left.
    """
    rows = tuple(row for row in table.rows if any(row[1][i] for i in columns))
    if not rows:
        names = ", ".join(f'"{table.names[i]}"' for i in columns)
        raise MeasuredError(
            f"{table.path}: its columns {names} hold no number; choose others: --time NAME, --sensor NAME=COLUMN"
        )
    return replace(table, rows=rows)


def _clock_place(table: LooseTable, options: ImportOptions) -> int | None:
    """Where the clock stands; None where a rate is given and no column counts the samples."""
    named = table.index(options.time) if options.time else None
    if not options.rate:
        return first_clock(table) if named is None else named
    place = first_filled(table) if named is None else named
    own = table.heads[place].unit if table.heads else None
    read = [table.names.index(name) for name in options.sensors if name in table.names]
    read += [table.index(column) for column in options.sensors.values() if column]
    may_count = bool(options.time) or (table.width > 1 and place not in read)
    if own is None and may_count and counts_samples(table, place):
        return place
    if options.time and not is_time(table, place):
        raise MeasuredError(
            f"{table.path}: --time {options.time}: with --rate it counts samples, in whole numbers that increase, and "
            "this column does not; leave --time out, then the rows are counted"
        )
    return None


def _refuse_other_clocks(table: LooseTable, clock: int, columns: Mapping[str, int], named: bool) -> None:
    """Raises MeasuredError for sensors beside a clock of their own, as where each channel is saved with its times.

    named: whether the user has chosen the clock, which is then that of a single sensor.
    """
    clocks = [i for i in range(table.width) if i == clock or _is_a_clock(table, i, clock, columns.values())]
    behind = table.width - 1 in clocks
    wrong = []
    for name, index in columns.items():
        if index == clock:
            wrong.append(
                f'{table.path}: column "{table.names[index]}" is taken for the clock and for {name}; choose the '
                "column of the clock: --time NAME, or, if the file has none, say how often it was sampled: --rate "
                '"200 kHz"'
            )
            continue
        beside = [i for i in clocks if (i > index if behind else i < index)]
        own = (min if behind else max)(beside, default=clock)
        together = all(i in clocks for i in range(clock + 1, own))
        if (named and len(columns) == 1) or _same_times(table, clock, own, together):
            continue
        wrong.append(
            f'{table.path}: column "{table.names[index]}" ({name}) stands {"before" if behind else "behind"} a clock '
            f'of its own, column {own + 1} "{table.names[own]}", whose times are not those of column {clock + 1} '
            f'"{table.names[clock]}"; import it by itself with --time {own + 1}, and --beside the record of the others'
        )
    if wrong:
        raise MeasuredError(wrong)


def _is_a_clock(table: LooseTable, index: int, clock: int, read: Collection[int]) -> bool:
    """Whether a column is a clock by its head's unit, or by even steps where its head calls it a time or there is none.

    read: columns that are a sensor's, and so none by their steps.
    """
    if is_time(table, index) or (table.heads and table.names[index].lower() == table.names[clock].lower()):
        return True
    may_be = is_called_time(table, index) if table.heads else index not in read
    return may_be and runs_evenly(table, index)


def _same_times(table: LooseTable, first: int, second: int, shifted: bool) -> bool:
    """Whether two clocks show the same times wherever the second one has a value; shifted: but for a constant."""
    sizes = [factor(table.heads[i].unit or "s") if table.heads else Decimal(1) for i in (first, second)]
    cells = [(row[first], row[second]) for _, row in table.rows if row[second]]
    if not all(a for a, _ in cells):
        return False
    apart = {Decimal(a) * sizes[0] - Decimal(b) * sizes[1] for a, b in cells}
    return len(apart) <= 1 and (shifted or apart <= {0})


def _time(table: LooseTable, clock: int | None, options: ImportOptions) -> Column:
    """The clock in seconds, shifted as is asked for; raises MeasuredError and UnitError."""
    lines = tuple(line for line, _ in table.rows)
    texts = tuple(str(i) if clock is None else cells[clock] for i, (_, cells) in enumerate(table.rows))
    name = "sample" if clock is None else table.names[clock]
    step, unit, begin = Decimal(1), "s", Decimal(0)
    if options.rate:
        step = _interval(options.rate)
        begin = _begin(table, step, [int(float(text)) for text in texts])
    else:
        assert clock is not None
        if not table.filled(clock):
            raise MeasuredError(
                f'{table.path}: column "{name}" of the times is empty; name another, --time COLUMN{_rate_hint(table)}'
            )
        unit = _unit(table, clock, "time", options)
        if "time" in options.units and dimension(unit) != "s":
            raise UnitError(f"--time-unit {unit} is no unit of time; accepted: {ACCEPTED['s']}")
        if si_unit(unit) != "s":
            raise MeasuredError(f'{table.path}: "{name}" is no time; choose the clock\'s column: --time NAME')
    begin += _shift(options.shift, unit)
    values = [scaled(str(Decimal(text) * step + begin), unit) if text else np.nan for text in texts]
    return Column(name, lines[0], "time", "s", np.array(values), texts, lines)


def _begin(table: LooseTable, step: Decimal, counted: Sequence[int]) -> Decimal:
    """Time of sample 0 [s] of a clock made of counted samples: by the first instant of the file's own, else 0.

    A file's own clock, whose digits may be too few, must agree with the rate. Raises MeasuredError.
    """
    place = next((i for i in range(table.width) if is_time(table, i)), None)
    if place is None:
        return Decimal(0)
    unit = table.heads[place].unit or ""
    own = [Decimal(cells[place]) * factor(unit) for _, cells in table.rows if cells[place]]
    made = step * (counted[-1] - counted[0])
    if own and abs(own[-1] - own[0] - made) > RATE_OFF * made:
        raise MeasuredError(
            f'{table.path}: its column "{table.names[place]}" spans {1e3 * float(own[-1] - own[0]):g} ms and its '
            f"{len(table.rows)} rows at --rate {1e3 * float(made):g} ms; correct the rate, or leave it out"
        )
    return own[0] - step * counted[0] if own else Decimal(0)


def _interval(rate: str) -> Decimal:
    """Seconds between two samples, by their rate or by that time; raises UnitError."""
    try:
        number, unit = parts(rate)
        if match := _SAMPLES.fullmatch(unit):
            unit = f"{match[1].replace('K', 'k')}Hz"
        size, kind = Decimal(number) * factor(unit), si_unit(unit)
    except UnitError as error:
        raise UnitError(f'--rate {rate}: {error}; write --rate "200 kHz", or --rate "5 us"') from error
    if kind not in ("1/s", "s") or size <= 0:
        raise UnitError(f'--rate {rate} is no rate of samples; write --rate "200 kHz", or --rate "5 us"')
    return 1 / size if kind == "1/s" else size


def _shift(text: str, unit: str) -> Decimal:
    """What is added to the clock, in its own unit, exactly; raises UnitError."""
    if not text:
        return Decimal(0)
    try:
        to_si(text, "s")
    except UnitError as error:
        raise UnitError(f'--shift {text}: {error}; write --shift "-0.2 ms"') from error
    number, given = parts(text)
    return Decimal(number) * ratio(given, unit)


def read_export(path: str | Path, options: ImportOptions) -> tuple[LooseTable, bool]:
    """The table in a file of any format that can be read, and whether it is a nodout; raises MeasuredError."""
    if options.table and not may_hold_tables(path):
        raise MeasuredError(f"--table {options.table}: {path} holds a single table; leave it out")
    reader = reader_of(path, options.decimal)
    if reader is not None and options.encoding:
        raise MeasuredError(f"--encoding {options.encoding}: {path} is no text file; leave it out")
    if reader is not None:
        return reader(Path(path), options.table), False
    if is_nodout(path):
        return read_nodout(path, options.node), True
    if is_rcforc(path):
        return read_rcforc(path), False
    return read_loose_table(path, options.decimal, bool(options.rate), options.encoding), False


def _refuse_names(sensors: Collection[str]) -> None:
    """Raises MeasuredError for names that no column of a record can have."""
    wrong = [name for name in sensors if name == "time" or not re.fullmatch(NAME, name)]
    if wrong:
        raise MeasuredError(
            [
                f"--sensor {name} cannot be a sensor's name: one begins with a letter, has unaccented letters, digits "
                'and _ alone, and is not "time"; write the name that its case has: --sensor displacement_centre=COLUMN'
                for name in wrong
            ]
        )


def _refuse_options(options: ImportOptions) -> None:
    """Raises MeasuredError for options that say nothing of the file, and would be passed over."""
    if not isinstance(options.sensors, Mapping) or not options.sensors:
        raise MeasuredError(
            f'sensors = {options.sensors!r}: name at least one, with its column or "" to find it, such as '
            '{"displacement_centre": ""}'
        )
    if options.decimal not in ("", ",", "."):
        raise MeasuredError(f'--decimal {options.decimal} is no mark of decimals; write --decimal "," or --decimal "."')
    named = {
        "--unit": {*options.units} - {"time"},
        "--scale": {*options.scales, *options.per},
        "--sigma": {*options.stated},
    }
    wrong = [(option, name) for option, names in named.items() for name in sorted(names - options.sensors.keys())]
    if wrong:
        known = ", ".join(options.sensors)
        raise MeasuredError(
            f"{option} {name}: {name} is no sensor that is read; named: {known}" for option, name in wrong
        )


def _refuse_units(units: Mapping[str, str]) -> None:
    """Raises UnitError for what is no unit at all."""
    for name, unit in units.items():
        option = "--time-unit " if name == "time" else f"--unit {name}="
        known = [ACCEPTED["s"]] if name == "time" else [ACCEPTED[kind] for kind in MEASURED]
        try:
            dimension(unit)
        except UnitError as error:
            raise UnitError(f"{option}{unit}: {error}; accepted: {'; '.join(known)}") from error


def _refuse_scales(scales: Mapping[str, float]) -> None:
    """Raises MeasuredError for a factor that leaves nothing of a curve."""
    wrong = [name for name, scale in scales.items() if not np.isfinite(scale) or scale == 0.0]
    if wrong:
        raise MeasuredError(
            [
                f"--scale {name}={scales[name]:g} leaves nothing of the curve; give the factor by which it is "
                "multiplied, such as -1"
                for name in wrong
            ]
        )


def _place(table: LooseTable, sensor: str, column: str, clock: int | None, nodout: bool) -> int:
    """Where a sensor's column stands: as named, by its own name, or the only one beside the clock."""
    if column:
        return table.index(column)
    counter = None if clock in (None, 0) or not counts_samples(table, 0) else 0
    others = [i for i in range(table.width) if i not in (clock, counter) and not is_time(table, i)]
    others = [i for i in others if table.filled(i)] or others
    if len(others) == 1:
        return others[0]
    try:
        return table.index(sensor)
    except SeveralColumns:
        raise
    except MeasuredError:
        if not others:
            raise MeasuredError(
                f'{table.path} has no column beside its clock that could be "{sensor}"; export the curve beside its '
                f"clock; its columns: {', '.join(table.names)}{table.left_out}"
            ) from None
        likely = [i for i in others if table.heads and table.heads[i].unit and si_unit(table.heads[i].unit) in MEASURED]
        example = "z-disp" if nodout else table.names[(likely or others)[0]]
        raise MeasuredError(
            f'{table.path}: which column is "{sensor}"? Write --sensor {sensor}="{example}"; '
            f"its columns: {', '.join(table.names)}"
        ) from None


def _column(table: LooseTable, index: int, name: str, options: ImportOptions) -> Column:
    """A column in SI, times its scale; an empty cell is NaN."""
    unit, scale = _unit(table, index, name, options), Decimal(repr(options.scales.get(name, 1.0)))
    if name in options.per:
        scale *= _per(table, index, name, options.per[name])
    texts = tuple(cells[index] for _, cells in table.rows)
    values = np.array([scaled(str(Decimal(text) * scale), unit) if text else np.nan for text in texts])
    lines = tuple(line for line, _ in table.rows)
    return Column(table.names[index], lines[0], name, si_unit(unit), values, texts, lines)


def _noise(table: LooseTable, index: int, beside: int, sensor: str, options: ImportOptions) -> Column:
    """The noise of a sensor, of a column, in the unit of the sensor's own `beside` it where it has none."""
    heads = list(table.heads)
    if heads[index].unit is None and not heads[index].foreign:
        heads[index] = replace(heads[beside], name=heads[index].name, fault=heads[index].fault)
    column = _column(replace(table, heads=tuple(heads)), index, sensor, options)
    sign = np.sign(options.scales.get(sensor, 1.0))
    return replace(column, name=f"{sensor}{SIGMA}", values=sign * column.values)


def _unit(table: LooseTable, index: int, name: str, options: ImportOptions) -> str:
    """The unit of a column from its head or from the user; raises where there is none, or where the two disagree."""
    given = options.units.get(name)
    head = table.heads[index] if table.heads else Head(table.names[index])
    own, column = head.unit, f'{table.path}: column "{table.names[index]}"'
    option = (
        f"--time-unit {head.likely_in(TIME) or table.likely_time_unit(index)}"
        if name == "time"
        else f"--unit {name}={head.likely_in(MEASURED) or _example(name)[1]}"
    )
    if head.fault:
        raise MeasuredError(head.fault)
    if name != "time" and not head.likely:
        _refuse_acceleration(column, name, head.foreign)
    _refuse_factor_of_head(column, name, head, options.scales)
    if own is None and given is None:
        _refuse_without_unit(table, head, column, name, option)
    if name in options.per:
        return given or ""
    if own is not None and given is not None and scaled("1", own) != scaled("1", given):
        called = f"in {own}" if own else 'a ratio ("-" in its head)'
        raise UnitError(
            f"{column} is {called}, and {option.split()[0]} says {given}; leave the option out (a factor is stated by "
            f"--scale {name}=NUMBER), or correct the file"
        )
    said = given or own or ""
    if name != "time":
        _refuse_unit(column, name, said)
    return said


def _refuse_without_unit(table: LooseTable, head: Head, column: str, name: str, option: str) -> NoReturn:
    """Raises UnitError that says what a head without a unit of a case gives, and the option that states one."""
    if head.likely_in(TIME if name == "time" else MEASURED):
        raise UnitError(f'{column} is in {head.foreign}; is "{head.likely}" meant? Correct the head, or write {option}')
    if head.foreign and name == "time":
        raise UnitError(f"{column} is in {head.foreign}, which is no unit of time; say which it is: {option}")
    if head.likely:
        _refuse_unit(column, name, head.likely)
    if head.foreign:
        raise UnitError(
            f"{column} is in {head.foreign}, which is no unit of a sensor; say what it stands for: "
            f'--scale {name}="{stands_for(head.foreign, name)}" (or {option} with a --scale)'
        )
    hint = _rate_hint(table) if name == "time" else ""
    raise UnitError(f"{column} has no unit; say which: {option}{hint}")


def stands_for(unit: str, sensor: str = "") -> str:
    """An example of what one of an instrument's own units stands for."""
    number, own = _example(sensor)
    return f"{number} {own}/({unit})" if "/" in unit else f"{number} {own}/{unit}"


def _example(sensor: str) -> tuple[str, str]:
    """A number and the unit of what a sensor gives, by its name."""
    return next((found for kind, found in _EXAMPLES.items() if kind in sensor), ("2.5", "mm"))


def _refuse_unit(column: str, name: str, unit: str) -> None:
    """Raises UnitError for a unit in which no sensor measures; column: as messages call it."""
    kind = dimension(unit)
    _refuse_acceleration(column, name, unit)
    if kind == "kg":
        raise UnitError(
            f"{column} is in {unit}, a mass, which no sensor measures; if a force in pounds or kilograms is meant, say "
            f'what one of them is: --scale {name}="1 {_FORCES.get(unit, "kgf")}/{unit}"'
        )
    if kind not in MEASURED:
        raise UnitError(
            f"{column} is in {unit}, which no sensor of a case measures (they give mm, kN, MPa or um/m); import "
            "another column, or convert the readings before"
        )


def factor_of_head(head: Head) -> str:
    """The factor that a column's head states, x10^-3 of Weg x10^-3 [m]; empty where it states none.

    A power of ten in the unit's own place, DMS [x10^-6], is a strain's unit.
    """
    match = None if is_power(head.unit or "") else _FACTOR.search(head.text)
    return match[0].strip() if match else ""


def _refuse_factor_of_head(column: str, name: str, head: Head, scales: Mapping[str, float]) -> None:
    """Raises MeasuredError where a head states a factor, Weg x10^-3 [m], and nobody says what it does."""
    stated = factor_of_head(head)
    if not stated or name in scales:
        return
    remedy = f"say what the readings are still to be multiplied by: --scale {name}=NUMBER, 1 where they are in the unit"
    if name == "time":
        remedy = "put into the head the unit of its numbers alone, without a factor"
    raise MeasuredError(f'{column}: its head "{head.text}" states a factor, "{stated}"; {remedy}')


def is_acceleration(unit: str) -> bool:
    """Whether a unit is one in which accelerometers give their readings."""
    return unit in GRAVITIES or (bool(unit) and dimension(unit) == dimension("m/s^2"))


def _refuse_acceleration(column: str, name: str, unit: str) -> None:
    """Raises UnitError for the unit of an accelerometer; g, a gram elsewhere, is the standard gravity there."""
    if not is_acceleration(unit):
        return
    gravity = unit in GRAVITIES
    said = f"in {unit}: of an accelerometer, 9.80665 m/s^2" if gravity else f"in {unit}, an acceleration"
    raise UnitError(
        f"{column} is {said}; no sensor of a case measures an acceleration (they give mm, kN, MPa or um/m), none is a "
        "displacement by a factor: integrate it twice over time, from rest and without its drift, to a displacement "
        f"(g times 9.80665 is m/s^2), and import that: --sensor {name}=COLUMN --unit mm"
    )


def _rate_hint(table: LooseTable) -> str:
    """What to write where a column counts samples, or there is no clock, with the line of the head that says more."""
    said = next((note for note in table.notes if _RATE.search(note)), "")
    found = f' (its head says "{said[:60]}")' if said else ""
    return f', or, if the file has no clock, how often it was sampled: --rate "200 kHz"{found}'


def _per(table: LooseTable, index: int, name: str, unit: str) -> Decimal:
    """How many of a factor's own unit, such as mV, are in one of the column's; raises UnitError."""
    head = table.heads[index] if table.heads else Head(table.names[index])
    own = head.foreign or head.unit
    try:
        return ratio(own, unit) if own else Decimal(1)
    except UnitError as error:
        raise UnitError(
            f'{table.path}: column "{table.names[index]}" is in {own}, and --scale {name} is per {unit}: {error}'
        ) from error


def _provenance(table: LooseTable, options: ImportOptions, used: Sequence[int], nodout: bool) -> tuple[str, ...]:
    """Where the curves came from and what was done to them; a solver's output counts as simulated."""
    digest = file_digest(table.path)[:16]
    columns = ", ".join(f'"{table.names[i]}"' for i in dict.fromkeys(used))
    lines = [f"Imported by birdstrike from {table.path.name} (SHA-256 {digest}), columns {columns}."]
    if nodout or options.simulated:
        lines.insert(0, f"SIMULATED{' (nodout of LS-DYNA)' if nodout else ''}, NOT MEASURED.")
    for name, scale in options.scales.items():
        per = f" {options.units.get(name, '')}/{options.per[name]}" if name in options.per else ""
        lines += [f"{name} was multiplied by {scale:g}{per}."] if scale != 1.0 or per else []
    if options.rate:
        lines.append(f"The clock was made of the samples' number, {options.rate} by the user.")
    lines += [f"{options.shift} was added to the clock."] if options.shift else []
    lines += [f"{text}." for text in table.remarks]
    notes = [note for note in table.notes if re.search(r"\w", note)]  # some oscilloscopes write lines of commas alone
    return (*lines, *(f"its head: {note[:120]}" for note in notes[:12]))
