"""A table of numbers in a CSV file whose header carries units, read strictly: every error with its line number."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from birdstrike.data.errors import MeasuredError, UnitError
from birdstrike.data.histories import Array
from birdstrike.data.units import scaled, si_unit

MOST_LINES = 5  # of one kind of error

NumberedRow = tuple[int, list[str]]

NAME = r"[A-Za-z][A-Za-z0-9_.]*"
"""Names that a column can have."""
_HEADER = re.compile(rf"\s*({NAME})\s*(?:\[([^\]]*)\])?\s*")


@dataclass(frozen=True)
class Column:
    """One column: name, SI unit, values in SI (NaN for an empty cell), and where each cell stands in the file."""

    header: str
    header_line: int
    name: str
    unit: str
    values: Array
    texts: tuple[str, ...]
    lines: tuple[int, ...]


@dataclass(frozen=True)
class CsvTable:
    """Columns in order, and the file's # lines."""

    columns: tuple[Column, ...]
    provenance: tuple[str, ...]


def read_table(path: Path) -> CsvTable:
    """Columns of a CSV file, each with its unit in square brackets; raises MeasuredError.

    # lines are provenance, blank lines are skipped, an empty cell is a gap; a byte-order mark and CRLF are welcome.
    """
    provenance, header, rows = _lines(path)
    errors: list[str] = []
    heads = [_head(text, errors) for text in header[1]]
    names = [name for name, _, _ in heads]
    errors += [f'"{name}" stands twice in the header' for name in dict.fromkeys(names) if names.count(name) > 1]
    errors = [f"line {header[0]}: {error}" for error in errors]
    lengths = [(number, len(cells)) for number, cells in rows if len(cells) != len(heads)]
    errors += first_of([f"line {n}: {cells} cells where the header has {len(heads)}" for n, cells in lengths])
    if errors:
        raise MeasuredError([f"{path}, {error}" for error in errors])
    columns = [_column(header, head, i, rows, errors) for i, head in enumerate(heads)]
    if errors:
        raise MeasuredError([f"{path}, {error}" for error in sorted(errors, key=_line_number)])
    return CsvTable(tuple(columns), provenance)


def _line_number(error: str) -> int:
    return int(error.split()[1].rstrip(":"))


def _lines(path: Path) -> tuple[tuple[str, ...], NumberedRow, list[NumberedRow]]:
    """Provenance, the header and the rows of cells, with line numbers; raises MeasuredError for an unreadable file."""
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise MeasuredError(f"{path} cannot be read as UTF-8 text: {error}") from error
    provenance = tuple(line.lstrip("# ").rstrip() for line in lines if line.startswith("#"))
    rows = list(_rows(lines))
    if not rows:
        raise MeasuredError(f'{path} holds no table; a header is such as "time [ms],displacement_centre [mm]"')
    header, *body = rows
    if len(header[1]) < 2:
        raise MeasuredError(f"{path}, line {header[0]}: one column only; columns are separated by commas")
    return provenance, header, body


def _rows(lines: list[str]) -> Iterator[NumberedRow]:
    for number, line in enumerate(lines, start=1):
        if line.strip() and not line.startswith("#"):
            yield number, cells_of(line)


def cells_of(line: str, delimiter: str = ",") -> list[str]:
    """Cells of a line; quotes are heeded in one that is no longer than Python's csv takes."""
    quoted = '"' in line and len(line) <= csv.field_size_limit()
    cells = next(csv.reader([line], delimiter=delimiter)) if quoted else line.split(delimiter)
    return [cell.strip() for cell in cells]


def _head(text: str, errors: list[str]) -> tuple[str, str, str]:
    """Name, unit as written and SI unit of one header cell; what is wrong goes to `errors`."""
    match = _HEADER.fullmatch(text)
    if match is None or match[2] is None:
        errors.append(f'"{text}" needs a name and a unit in square brackets, such as "time [ms]"')
        return text, "", ""
    unit = match[2].strip()
    unit = "" if unit in ("-", "1") else unit
    try:
        return match[1], unit, si_unit(unit)
    except UnitError as error:
        errors.append(f'"{text}": {error}')
        return match[1], "", ""


def _column(
    header: NumberedRow, head: tuple[str, str, str], index: int, rows: list[NumberedRow], errors: list[str]
) -> Column:
    """One column in SI; what is no number goes to `errors`."""
    name, unit, si = head
    cells = [(number, row[index]) for number, row in rows]
    wrong: list[str] = []
    values = np.array([_value(cell, unit, f"line {n}: {name}", wrong) for n, cell in cells])
    errors += first_of(wrong)
    return Column(header[1][index], header[0], name, si, values, tuple(c for _, c in cells), tuple(n for n, _ in cells))


def first_of(errors: list[str]) -> list[str]:
    """The first of many errors of one kind, and the last with how many they are; each begins with "line N:"."""
    if len(errors) <= MOST_LINES:
        return errors
    return [*errors[:MOST_LINES], f"{errors[-1].split(':')[0]}: the last of {len(errors)} such lines"]


def _value(cell: str, unit: str, place: str, errors: list[str]) -> float:
    """SI value of a cell, NaN for an empty one."""
    if not cell:
        return np.nan
    try:
        return scaled(cell, unit)
    except UnitError:
        errors.append(f'{place} = "{cell}" is not a finite number; leave the cell empty for a gap')
        return np.nan
