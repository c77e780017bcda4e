"""Other people's curves as a record: a nodout, two columns of text, or a CSV with headers of its own."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from decimal import Decimal
from pathlib import Path

import numpy as np

from birdstrike.data.csv_table import Column, CsvTable
from birdstrike.data.curves import Measured, measured_from
from birdstrike.data.errors import MeasuredError, UnitError
from birdstrike.data.exports.registry import reader_of
from birdstrike.data.loose_table import Head, LooseTable, read_loose_table
from birdstrike.data.nodout import is_nodout, read_nodout
from birdstrike.data.units import ratio, scaled, si_unit, to_si


@dataclass(frozen=True)
class ImportOptions:
    """What to take from a file.

    sensors: name in the case -> column, "" to find it; time: the clock's column, "" for the first; units: sensor or
    "time" -> unit where the file gives none; scales: sensor -> factor, -1 for a curve that points the other way; per:
    sensor -> unit of the column that the factor multiplies, such as V where the factor is in mm/V; shift: text with a
    unit that is added to the clock; node: of a nodout; simulated: no instrument took this curve; decimal: mark of the
    decimals, "," or ".", where the file leaves it open; table: of a file that holds several.
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


def import_record(path: str | Path, options: ImportOptions) -> Measured:
    """The curves as a record with its provenance, checked like any record; raises MeasuredError and UnitError."""
    _refuse_scales(options.scales)
    table, nodout = read_export(path, options)
    if options.node is not None and not nodout:
        raise MeasuredError(f"{path} is no nodout: --node has nothing to choose from; name a column instead")
    clock = table.index(options.time) if options.time else 0
    columns = {name: _place(table, name, column, clock, nodout) for name, column in options.sensors.items()}
    time = _column(table, clock, "time", options)
    if time.unit != "s":
        raise MeasuredError(f'{path}: "{time.header}" is no time; choose the clock\'s column: --time NAME')
    shift = to_si(options.shift, "s") if options.shift else 0.0
    shifted = Column(time.header, time.header_line, "time", "s", time.values + shift, time.texts, time.lines)
    sensors = [_column(table, index, name, options) for name, index in columns.items()]
    notes = _provenance(table, options, [clock, *columns.values()], nodout)
    return measured_from(CsvTable((shifted, *sensors), notes), path)


def read_export(path: str | Path, options: ImportOptions) -> tuple[LooseTable, bool]:
    """The table in a file of any format that can be read, and whether it is a nodout; raises MeasuredError."""
    reader = reader_of(path)
    if reader is not None:
        return reader(Path(path), options.table), False
    if is_nodout(path):
        return read_nodout(path, options.node), True
    return read_loose_table(path, options.decimal), False


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


def _place(table: LooseTable, sensor: str, column: str, clock: int, nodout: bool) -> int:
    """Where a sensor's column stands: as named, by its own name, or the only one beside the clock."""
    if column:
        return table.index(column)
    others = [i for i in range(table.width) if i != clock]
    if len(others) == 1:
        return others[0]
    try:
        return table.index(sensor)
    except MeasuredError:
        example = "z-disp" if nodout else table.names[others[0]]
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


def _unit(table: LooseTable, index: int, name: str, options: ImportOptions) -> str:
    """The unit of a column from its head or from the user; raises where there is none, or where the two disagree."""
    given = options.units.get(name)
    head = table.heads[index] if table.heads else Head(table.names[index])
    own, column = head.unit, f'{table.path}: column "{table.names[index]}"'
    option = "--time-unit ms" if name == "time" else f"--unit {name}=mm"
    if own is None and given is None:
        if head.foreign:
            raise UnitError(
                f"{column} is in {head.foreign}, which is no unit of a sensor; say what it stands for: "
                f'--scale {name}="2.5 mm/{head.foreign}" (or {option} with a --scale)'
            )
        raise UnitError(f"{column} has no unit; say which: {option}")
    if name in options.per:
        return given or ""
    if own is not None and given is not None and scaled("1", own) != scaled("1", given):
        raise UnitError(
            f"{column} is in {own}, and {option.split()[0]} says {given}; leave the option out, or correct the file"
        )
    return given or own or ""


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
    digest = hashlib.sha256(table.path.read_bytes()).hexdigest()[:16]
    columns = ", ".join(f'"{table.names[i]}"' for i in dict.fromkeys(used))
    lines = [f"Imported by birdstrike from {table.path.name} (SHA-256 {digest}), columns {columns}."]
    if nodout or options.simulated:
        lines.insert(0, f"SIMULATED{' (nodout of LS-DYNA)' if nodout else ''}, NOT MEASURED.")
    for name, scale in options.scales.items():
        per = f" {options.units.get(name, '')}/{options.per[name]}" if name in options.per else ""
        lines += [f"{name} was multiplied by {scale:g}{per}."] if scale != 1.0 or per else []
    lines += [f"{options.shift} was added to the clock."] if options.shift else []
    lines += [f"{text}." for text in table.remarks]
    return (*lines, *(f"its head: {note[:120]}" for note in table.notes[:12]))
