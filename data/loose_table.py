"""A table of numbers in other people's text files: any delimiter, decimal comma, loose header; each row's line kept."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from birdstrike.data.errors import MeasuredError, UnitError
from birdstrike.data.units import si_unit

DELIMITERS = (";", "\t", ",", " ")
COMMENT = ("#", "$", "%")
AS_SUFFIX = ("m", "mm", "um", "in", "s", "ms", "us", "N", "kN", "Pa", "kPa", "MPa", "GPa")
"""Units that may end a name: with any unit, strain_a would be in years and gauge_c in speeds of light."""
END = ("endcurve", "*end", "end")
"""Words with which plotting programs close a curve."""

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d{1,3}|[+-]\d{3})?")
_UNIT = (
    re.compile(r"(?P<name>.+?)\s*[\[(](?P<unit>[^\])]*)[\])]"),  # displacement [mm], displacement (mm)
    re.compile(r"(?P<name>.+?)\s+/\s+(?P<unit>\S+)"),  # displacement / mm
    re.compile(rf"(?P<name>.+)_(?P<unit>{'|'.join(map(re.escape, AS_SUFFIX))})"),  # displacement_mm
)


@dataclass(frozen=True)
class Head:
    """What stands above a column: its name, and its unit where one is given."""

    name: str
    unit: str | None = None


@dataclass(frozen=True)
class LooseTable:
    """heads: of the columns, () where the file names none; rows: (line, numbers as text, "" for a gap); notes: the
    lines above the table."""

    path: Path
    heads: tuple[Head, ...]
    rows: tuple[tuple[int, tuple[str, ...]], ...]
    notes: tuple[str, ...]

    @property
    def width(self) -> int:
        """Number of columns."""
        return len(self.rows[0][1])

    @property
    def names(self) -> tuple[str, ...]:
        """What the columns can be called by; their numbers where they have no names."""
        return tuple(head.name for head in self.heads) or tuple(str(i + 1) for i in range(self.width))

    def index(self, column: str) -> int:
        """Place of a column given by name (case and blanks do not matter) or by number from 1; raises MeasuredError."""
        names = [_plain(name) for name in self.names]
        if _plain(column) in names:
            return names.index(_plain(column))
        if column.isdigit() and 1 <= int(column) <= self.width:
            return int(column) - 1
        raise MeasuredError(f'{self.path} has no column "{column}"; its columns: {", ".join(self.names)}')


def _plain(name: str) -> str:
    return " ".join(name.lower().split())


def text_lines(path: Path) -> list[str]:
    """Lines of a text file, UTF-8 or the Latin-1 of older instruments; raises MeasuredError where there is none."""
    try:
        content = path.read_bytes()
    except OSError as error:
        raise MeasuredError(f"{path} cannot be read: {error.strerror}") from error
    if b"\0" in content:
        raise MeasuredError(f"{path} is no text file; export the curve as text first")
    try:
        return content.decode("utf-8-sig").splitlines()
    except UnicodeDecodeError:
        return content.decode("latin-1").splitlines()


def read_loose_table(path: str | Path) -> LooseTable:
    """The table in a text file; raises MeasuredError with the line of everything that is no number.

    The table begins with the first two lines in a row that hold equally many numbers, at least two; the delimiter is
    the first of ; tab , and blank by which they do. The lines above it may name the columns and their units.
    """
    lines = text_lines(Path(path))
    start, delimiter = _begin(Path(path), lines)
    width = len(_numbers(lines[start], delimiter) or ())
    rows, errors = [], []
    for i, line in enumerate(lines[start:], start + 1):
        if not line.strip() or line.lstrip().startswith(COMMENT):
            continue
        if line.strip().lower() in END:
            break
        cells = _numbers(line, delimiter)
        if cells is None or len(cells) != width:
            errors.append(f'{path}, line {i}: "{line.strip()[:40]}" is not {width} numbers as in line {start + 1}')
        else:
            rows.append((i, cells))
    if errors:
        raise MeasuredError(errors[:20])
    heads, notes = _heads(lines[:start], delimiter, width)
    return LooseTable(Path(path), heads, tuple(rows), notes)


def _begin(path: Path, lines: Sequence[str]) -> tuple[int, str]:
    """First line of the table, and what separates its cells."""
    full = [i for i, line in enumerate(lines) if line.strip()]
    for first, second in pairwise(full):
        for delimiter in DELIMITERS:
            one, two = _numbers(lines[first], delimiter), _numbers(lines[second], delimiter)
            if one and two and len(one) == len(two) >= 2:
                return first, delimiter
    raise MeasuredError(f"{path} holds no table: no two lines in a row of two or more numbers each")


def _cells(line: str, delimiter: str) -> list[str]:
    if delimiter == " ":
        return line.split()
    return [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter))]


def _numbers(line: str, delimiter: str) -> tuple[str, ...] | None:
    """Cells as numbers' texts, "" for a gap; None where any is something else. A lone decimal comma becomes a point."""
    cells = _cells(line, delimiter)
    if delimiter != ",":
        cells = [cell.replace(",", ".") if cell.count(",") == 1 and "." not in cell else cell for cell in cells]
    if not any(cells) or any(cell and not _NUMBER.fullmatch(cell) for cell in cells):
        return None
    return tuple(map(number_text, cells))


def number_text(cell: str) -> str:
    """A number as data.units reads it: Fortran's 1.0D-03 and 1.0-103 become 1.0E-03 and 1.0E-103."""
    return re.sub(r"(?<=[\d.])([+-]\d{3})$", r"E\1", re.sub("[dD]", "E", cell))


def _heads(lines: Sequence[str], delimiter: str, width: int) -> tuple[tuple[Head, ...], tuple[str, ...]]:
    """Names and units from the lines above the table, the nearest first, and all those lines as notes."""
    notes = tuple(line.strip().lstrip("#$% ") for line in lines if line.strip())
    nearest = [cells for note in reversed(notes) if len(cells := _cells(note, delimiter)) == width]
    units: list[str | None] = [None] * width
    if len(nearest) > 1 and any(nearest[0]) and all(map(_is_unit, nearest[0])):
        units = [cell.strip("[]()") or None for cell in nearest.pop(0)]
    named = nearest and any(re.search("[A-Za-z]", cell) for cell in nearest[0])
    heads = (_head(cell, unit) for cell, unit in zip(nearest[0], units, strict=True)) if named else ()
    return tuple(heads), notes


def _is_unit(cell: str) -> bool:
    try:
        return bool(si_unit(cell.strip("[]()")) or not cell)
    except UnitError:
        return False


def _head(cell: str, unit: str | None) -> Head:
    """Name and unit of a header's cell, in one of the usual spellings."""
    for match in _matches(cell):
        if unit is None and _is_unit(match["unit"]):
            return Head(match["name"].strip(), match["unit"].strip())
    return Head(cell, unit)


def _matches(cell: str) -> Iterator[re.Match[str]]:
    return (match for pattern in _UNIT if (match := pattern.fullmatch(cell.strip())))
