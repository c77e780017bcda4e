"""A table of numbers in other people's text files: any delimiter, decimal comma, loose header; each row's line kept."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal
from itertools import groupby, pairwise, repeat
from pathlib import Path

from birdstrike.data.errors import MeasuredError, UnitError
from birdstrike.data.formatting import many
from birdstrike.data.tables.csv_table import cells_of
from birdstrike.data.tables.text_file import decoded_lines
from birdstrike.data.units import factor, is_ratio, si_unit, usual

DELIMITERS = (";", "\t", "|", ",", " ")
COMMENT = ("#", "$", "%")
AS_SUFFIX = ("m", "mm", "um", "µm", "in", "s", "ms", "us", "µs", "N", "kN", "Pa", "kPa", "MPa", "GPa")
"""Units that may end a name: with any unit, strain_a would be in years and gauge_c in speeds of light."""
RATIO = ("-", "1")
"""What stands in the place of a ratio's unit."""
SIGMA = "_sigma"
"""End of the name of a column that is the noise of another."""
END = ("endcurve", "*end", "end")
"""Words with which plotting programs close a curve."""
MOST_BEHIND = 20
"""Lines behind a table, beyond which they are taken for rows that are damaged."""
NEAREST = 2
"""Lines right above a table, whose cells beyond its columns or before its empty ones are no matter."""
UNIT_LABELS = ("unit", "units", "einheit", "einheiten", "vunit", "vertical units", "y_unit_label", "sequence")
CLOCK_LABELS = ("horizontal units", "horizontal unit", "hunit", "x units", "x unit", "x_unit_label")
"""What oscilloscopes write before the unit of the clock, above the table or beside its first rows."""
NAME_LABELS = ("tracename",)
"""What instruments write before the units and the names of their channels, above the clock."""
_ANOTHER = "; where a second table begins, put each into a file of its own"
LENGTHS = {"us": 1000.0, "ms": 0.3}
"""Unit of a clock -> the least number that a record's length is in it; a shorter one is in seconds."""
MOST_BESIDE = 30
"""First rows of a table, beside which an instrument's settings may stand."""

NOT_UNICODE = "is not UTF-8"
"""In the remark on an encoding that was guessed."""

MEASURED = ("m", "N", "Pa", "")
"""SI units of what the sensors of a case give."""
TIME = ("s",)
GAPS = frozenset(
    """nan n/a na #n/a #na null none nil - -- --- inf +inf -inf infinity -infinity ovl +ovl -ovl ovld over over!
    overload overflow ovrflw overrange over-range clip clipped invalid missing bad
    \u221e +\u221e -\u221e""".split()  # noqa: SIM905
)
"""What loggers and spreadsheets write where there is no reading, in small letters."""

_NO_NUMBER = re.compile(r"[*?#]{2,}|-{3,}|-+\.-+|[+-]?\d\.#[A-Za-z]+\d*|[<>]\s*[+-]?\d[\d.,]*|#(?:\S+[!?]|\w/\w|NV)")
"""A cell filled with one sign, -1.#IND, >4.5, #REF! or #WERT!: what Fortran, C, loggers and spreadsheets write where a
number has no room, is none or lies beyond the range."""
NO_READING = 1e29
"""Size beyond which a number stands for none: instruments write 1E+30, SCPI 9.91E+37 and 9.9E+37 beyond the range."""
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d{1,3}|[+-]\d{3})?")
_PLAIN = re.compile(r"[+-]?(?:\d{1,15}(?:\.\d{0,15})?|\.\d{1,15})(?:[eE][+-]?0?\d)?")
"""A number with a point at most, of a usual size: nearly every cell of a record, told at once."""
_FACTOR = re.compile(r"\s*\d+(?:\.\d*)?[eE][+-]?\d+\s*\*\s*")
_BRACKET = r"[\[(\uff3b\uff08](?P<unit>[^\])\uff3d\uff09]*)[\])\uff3d\uff09]"
"""A unit in brackets, which are as wide as an ideograph in Chinese and Japanese texts."""
_IN_BRACKETS = re.compile(rf"\s*{_BRACKET}\s*$")
_FORTRAN = re.compile(r"[dD]|[\d.][+-]")
_CLOCK = re.compile(
    r"(?:\S+[ T]+)?(?:(?P<hours>\d{1,2}):)?(?P<minutes>\d{1,2}):(?P<seconds>\d{1,2}(?:[.,]\d+|:\d{3}(?:\d{3})?)?)"
    r"(?:\s*(?P<half>[AaPp])\.?[Mm]\.?)?(?:Z|[+-]\d\d:?\d\d)?"
)
"""hh:mm:ss.ffffff, hh:mm:ss:fff or mm:ss.ffffff, with or without a date before it, AM or PM, or the zone, behind it."""

_CLOCK_PATTERN = re.compile(r"(?:[DdMmYy./\-]+[ T]+)?[Hh]{1,2}:[Mm]{1,2}(?::[Ss]{1,2}(?:[.,][Ff0SsMm]+)?)?")
"""How some loggers write in the row of units what their clock looks like: hh:mm:ss.fff, dd.mm.yyyy hh:mm:ss."""

_PER_CENT = re.compile(r"(?<=[\d.])\s*%$")
"""A sign of per cent behind a number."""

_GROUPED = re.compile(r"[+-]?[1-9]\d{0,2}(?P<mark>[.,])\d{3}")
"""A number that is a thousand or a thousandth: 1,234."""

_FIGURES = re.compile(r"[+-]?[\d.,]+(?:[eEdD][+-]?\d{1,3})?")
"""A number, whatever its points and commas mean."""

_UNIT = (
    re.compile(rf"(?P<name>.+?)\s*{_BRACKET}"),  # displacement [mm], displacement (mm)
    re.compile(r"(?P<name>.+?)\s+/\s+(?P<unit>\S+)"),  # displacement / mm
    re.compile(r"(?P<name>[^/\s]+)/(?P<unit>[^/\s]+)"),  # displacement/mm
    re.compile(rf"(?P<name>.+)_(?P<unit>{'|'.join(map(re.escape, AS_SUFFIX))})"),  # displacement_mm
    re.compile(rf"(?P<name>.+?)(?: in|,) +(?P<unit>{'|'.join(map(re.escape, AS_SUFFIX))})"),  # Weg in mm; Weg, mm
)


@dataclass(frozen=True)
class Head:
    """What stands above a column: its name, and its unit where one is given.

    text: the cell as it stands in the file; foreign: a unit that measures nothing used here, such as V; likely: the
    unit of a clock or a sensor that a foreign one stands for in the wrong case, kN for KN; fault: why the numbers below
    it cannot be read, "" where they can.
    """

    name: str
    unit: str | None = None
    text: str = ""
    foreign: str = ""
    likely: str = ""
    fault: str = ""

    def likely_in(self, kinds: Sequence[str]) -> str:
        """The likely unit where it is of one of some SI units' dimensions, else empty."""
        return self.likely if self.likely and si_unit(self.likely) in kinds else ""


class SeveralColumns(MeasuredError):
    """A name that several columns have: only a number tells them apart."""


@dataclass(frozen=True)
class LooseTable:
    """heads: of the columns, () where the file names none; rows: (line, numbers as text, "" for a gap); notes: the
    lines above the table; remarks: sentences on what was read in a way of its own."""

    path: Path
    heads: tuple[Head, ...]
    rows: tuple[tuple[int, tuple[str, ...]], ...]
    notes: tuple[str, ...]
    remarks: tuple[str, ...] = ()

    @property
    def width(self) -> int:
        """Number of columns."""
        return len(self.rows[0][1])

    @property
    def names(self) -> tuple[str, ...]:
        """What the columns can be called by; their numbers where they have no names."""
        return tuple(head.name for head in self.heads) or tuple(str(i + 1) for i in range(self.width))

    @property
    def noises(self) -> dict[int, int]:
        """Place of a column -> that of its noise, which is named after it with `_sigma` behind."""
        places = {_plain(name): i for i, name in enumerate(self.names)}
        found = {i: places.get(f"{name}{SIGMA}") for name, i in places.items()}
        return {i: noise for i, noise in found.items() if noise is not None}

    @property
    def left_out(self) -> str:
        """What of the file is no column, as the end of a sentence; empty for nothing."""
        return "".join(f"; {remark}" for remark in self.remarks if "left out" in remark)

    def filled(self, index: int) -> bool:
        """Whether a column holds a number: one of text is empty."""
        return any(cells[index] for _, cells in self.rows)

    def likely_time_unit(self, index: int) -> str:
        """The unit of a clock whose head gives none, by its length: a record of an impact lasts milliseconds."""
        times = [float(cells[index]) for _, cells in self.rows if cells[index]]
        length = times[-1] - times[0] if times else 1.0
        return next((unit for unit, least in LENGTHS.items() if length >= least), "s")

    def index(self, column: str) -> int:
        """Place of a column given by name, with or without its unit, as it stands in the file, or by number from 1.

        Case and blanks do not matter; raises MeasuredError.
        """
        asked = _plain(column)
        bare = [_plain(_IN_BRACKETS.sub("", name)) for name in self.names]  # of a unit that is not known, such as KN
        for spelt in ([_plain(head.text) for head in self.heads], [_plain(name) for name in self.names], bare):
            found = [i for i, name in enumerate(spelt) if name == asked]
            if len(found) == 1:
                return found[0]
            if found:
                same = ", ".join(f"{i + 1} ({self.heads[i].text})" for i in found)
                raise SeveralColumns(f'{self.path} has several columns "{column}": give a number, of {same}')
        if column.isdigit() and 1 <= int(column) <= self.width:
            return int(column) - 1
        known = f"its columns: {', '.join(self.names)}{self.left_out}"
        raise MeasuredError(f'{self.path} has no column "{column}"; {known}')


def _plain(name: str) -> str:
    return " ".join(name.lower().split())


def read_loose_table(path: str | Path, decimal: str = "", single: bool = False, encoding: str = "") -> LooseTable:
    """The table in a text file; raises MeasuredError with the line of everything that is no number.

    The table begins with the first two lines in a row that hold equally many numbers, at least two; the delimiter is
    the first of ; tab | , and blank by which they do. The lines above it may name the columns and their units, those
    behind it hold no row of numbers. What a logger writes where it has no reading (NaN, OVL, -) is a gap. decimal: ","
    or "." where the numbers leave it open; single: whether a file of one column will do;
    encoding: of the text, "" to find it.
    """
    lines, guessed = decoded_lines(Path(path), encoding)
    table = table_of_lines(Path(path), lines, decimal, single)
    if not guessed or all(head.text.isascii() for head in table.heads):
        return table
    remark = (
        f"the file {NOT_UNICODE} and was read as {guessed}; if names look wrong, state its encoding: --encoding NAME"
    )
    return replace(table, remarks=(*table.remarks, remark))


def table_of_lines(path: Path, lines: Sequence[str], decimal: str = "", single: bool = False) -> LooseTable:
    """The table in the lines of a file; see `read_loose_table`. Raises MeasuredError with the lines at fault."""
    start, delimiter = _begin(path, lines, single)
    width = len(_cells(lines[start], delimiter))
    blank = " \t" if single else f" \t{delimiter}"  # a row of empty cells is none, unless rows are counted
    body = [
        (i, _cells(line, delimiter))
        for i, line in enumerate(lines[start : _end(lines, start)], start + 1)
        if line.strip(blank) and not line.lstrip().startswith(COMMENT)
    ]
    body, repeated = (body, []) if single else _without_repeated(body, lines, start)
    body, texts = _without_text(body, width)
    behind = _behind(body, width)
    body = body[: len(body) - behind]
    marks = _marks(path, body, width, decimal)
    rows, errors, gaps = [], _rows_lost_above(path, lines[:start], delimiter, width), Counter[str]()
    first: dict[str, int] = {}
    for i, cells in body:
        found = _numbers(cells, marks) if len(cells) == width else None
        if found is None:
            shown = lines[i - 1].strip()[:40]
            errors.append(
                f'{path}, line {i}: "{shown}" is not {width} numbers as in line {start + 1}; a gap is an empty cell, '
                f"NaN, OVL or -{_ANOTHER if _begins_with_a_word(cells) else ''}"
            )
            continue
        for cell in (cell for cell, number in zip(cells, found, strict=True) if cell and not number):
            gaps[cell] += 1
            first.setdefault(cell, i)
        rows.append((i, found))
    if errors:
        raise MeasuredError(errors[:20])
    filled = max(j + 1 for _, cells in rows for j in range(width) if cells[j])
    _refuse_common_factor(path, lines[:start])
    _refuse_parted_decimals(path, lines[:start], rows, delimiter, filled)
    heads, notes = _heads(lines[:start], delimiter, width, filled)
    clock = next(j for j in range(width) if any(cells[j] for _, cells in rows))
    heads = _with_per_cent(path, heads, body, width)
    heads = _with_clock_unit(heads, lines[: start + MOST_BESIDE], delimiter, width, clock)
    remarks = tuple(
        f'{count} cell{"s" if count > 1 else ""} "{cell}", the first in line {first[cell]}, read as gaps'
        for cell, count in gaps.items()
    )
    if texts:
        names = ", ".join(heads[j].name if heads else str(j + 1) for j in texts)
        remarks += (f"columns of text were left out: {names}",)
    if repeated:
        remarks += (f"lines that repeat the head were left out: {len(repeated)}, the first line {repeated[0]}",)
    if behind:
        last = next(i for i in range(len(lines), 0, -1) if lines[i - 1].strip())
        where = f"{many(behind, 'line')} behind the table, the last line {last}"
        remarks += (f"{where}, {'was' if behind == 1 else 'were'} left out: no {width} numbers each",)
    return _with_clocks(LooseTable(path, heads, tuple(rows), notes, remarks))


def _without_repeated(
    body: Sequence[tuple[int, list[str]]], lines: Sequence[str], start: int
) -> tuple[list[tuple[int, list[str]]], list[int]]:
    """The rows without the lines that stand above the table too, as where a logger begins a page, and their numbers."""
    above = {line.strip() for line in lines[:start]}
    repeated = [i for i, cells in body if lines[i - 1].strip() in above and _numbers(cells) is None]
    left_out = set(repeated)
    return [(i, cells) for i, cells in body if i not in left_out], repeated


def _end(lines: Sequence[str], start: int) -> int:
    """First line behind the table."""
    return next((i for i, line in enumerate(lines) if i > start and line.strip().lower() in END), len(lines))


def _behind(body: Sequence[tuple[int, list[str]]], width: int) -> int:
    """How many lines end the file that begin with a word, such as a summary; 0 where they are too many for one."""
    rows = (len(cells) == width and not _begins_with_a_word(cells) for _, cells in reversed(body))
    count = next((i for i, is_row in enumerate(rows) if is_row), 0)
    words = all(_begins_with_a_word(cells) for _, cells in body[len(body) - count :])
    return count if words and count <= MOST_BEHIND else 0


def _begins_with_a_word(cells: Sequence[str]) -> bool:
    return bool(cells) and _number(cells[0], "") is None


def _with_clocks(table: LooseTable) -> LooseTable:
    """The table with columns of clock readings (hh:mm:ss.ffffff) as seconds from their first row."""
    clocks = [j for j in range(table.width) if any(":" in cells[j] for _, cells in table.rows)]
    rows = [list(cells) for _, cells in table.rows]
    heads = list(table.heads) or [Head(str(j + 1)) for j in range(table.width)]
    remarks = list(table.remarks)
    for j in clocks:
        begin = next(cells[j] for cells in rows if ":" in cells[j])
        rounds, last, zero, whole = 0, Decimal(0), _seconds(begin), _round(begin)
        for (line, _), cells in zip(table.rows, rows, strict=True):
            if not cells[j]:
                continue
            if ":" not in cells[j]:
                raise MeasuredError(f'{table.path}, line {line}: "{cells[j]}" is no time of day such as "{begin}"')
            now = _seconds(cells[j])
            rounds += now < last - whole / 2
            last = now
            cells[j] = str(now + whole * rounds - zero)
        heads[j] = replace(heads[j], unit="s")
        remarks.append(f"column {heads[j].name}: times of day were read, and count from the first row, {begin}")
    lines = (line for line, _ in table.rows)
    return replace(
        table,
        heads=tuple(heads) if clocks else table.heads,
        rows=tuple((line, tuple(cells)) for line, cells in zip(lines, rows, strict=True)),
        remarks=tuple(remarks),
    )


def _round(cell: str) -> Decimal:
    """Seconds after which a time of day begins again: those of a day, or of an hour where it gives no hours."""
    match = _CLOCK.fullmatch(cell)
    return Decimal(86400 if match and match["hours"] else 3600)


def _seconds(cell: str) -> Decimal:
    """Seconds of a time of day."""
    match = _CLOCK.fullmatch(cell)
    assert match is not None, cell
    hours = int(match["hours"] or 0)
    if match["half"]:
        hours = hours % 12 + (12 if match["half"] in "Pp" else 0)
    minutes = 60 * hours + int(match["minutes"])
    return 60 * minutes + Decimal(re.sub("[,:]", ".", match["seconds"]))


def _marks(path: Path, body: Sequence[tuple[int, list[str]]], width: int, stated: str) -> tuple[str, ...]:
    """The mark of decimals of every column: its own, else the one stated, else the file's; "" where either may stand.

    Raises MeasuredError where a number may as well be a thousand times larger.
    """
    rows = [(i, cells) for i, cells in body if len(cells) == width]
    own = [{_mark_of(_bare(cells[j])) for _, cells in rows} - {""} for j in range(width)]
    mixed = len(set[str]().union(*own)) > 1
    others = stated or ("" if mixed else _decimal(path, body))
    marks = tuple(min(found) if len(found) == 1 else "" if found else others for found in own)
    for j in (j for j, mark in enumerate(marks) if not mark):
        _refuse_thousands(path, [(i, _bare(cells[j])) for i, cells in rows])
    return marks


def _mark_of(cell: str) -> str:
    """The mark of decimals that a cell shows by itself, empty where it leaves that open."""
    if not _FIGURES.fullmatch(cell):
        return ""
    if "," in cell:
        return _decimal_of(cell)
    return "." if cell.count(".") == 1 and not _GROUPED.fullmatch(cell) else ""


def _refuse_thousands(path: Path, column: Sequence[tuple[int, str]]) -> None:
    """Raises MeasuredError for the first number of a column that is a thousand or a thousandth by its mark."""
    for line, cell in column:
        if match := _GROUPED.fullmatch(cell):
            mark = match["mark"]
            raise MeasuredError(
                f'{path}, line {line}: "{cell}" is {cell.replace(mark, "")} or {cell.replace(mark, ".")}, for the file '
                "has decimal points and decimal commas; write one of them throughout the column"
            )


def _decimal(path: Path, body: Sequence[tuple[int, list[str]]]) -> str:
    """What marks decimals: a comma or a point; raises MeasuredError where every comma may as well part thousands."""
    open_cells = [(i, _bare(cell)) for i, cells in body for cell in cells if "," in cell]
    if not open_cells:
        _refuse_points_of_thousands(path, body)
        return "."
    sure = {mark for _, cell in open_cells if (mark := _decimal_of(cell))}
    if sure:
        return "," if "," in sure else "."
    if any("." in cell for _, cells in body for cell in cells if ":" not in cell):
        return "."
    line, cell = open_cells[0]
    raise MeasuredError(
        f'{path}, line {line}: "{cell}" is {cell.replace(",", "")} or {cell.replace(",", ".")}; say which mark the '
        'decimals have: --decimal "." or --decimal ","'
    )


def _refuse_points_of_thousands(path: Path, body: Sequence[tuple[int, list[str]]]) -> None:
    """Raises MeasuredError where a column's points may as well part thousands: 998 stands beside 1.034.

    A logger writes its decimals in every cell or drops their zeros; whole numbers of three digits beside points that
    have three digits behind them, and no other point in the column, are neither.
    """
    for j in range(max(len(cells) for _, cells in body)):
        column = [(i, _bare(cells[j])) for i, cells in body if j < len(cells)]
        pointed = [(i, cell) for i, cell in column if "." in cell]
        whole = any(re.fullmatch(r"[+-]?\d{3}", cell) for _, cell in column)
        if pointed and whole and all(_GROUPED.fullmatch(cell) for _, cell in pointed):
            line, cell = pointed[0]
            raise MeasuredError(
                f'{path}, line {line}: "{cell}" stands in a column of whole numbers, and is {cell.replace(".", "")} or '
                f'{cell.replace(".", ",")}; say which mark the decimals have: --decimal "," or --decimal "."'
            )


def _decimal_of(cell: str) -> str:
    """The decimal mark of a number with a comma in it, empty where it leaves that open."""
    if "." in cell:
        return "," if cell.rfind(",") > cell.rindex(".") else "."
    if cell.count(",") > 1:
        return "."
    return "" if _GROUPED.fullmatch(cell) or ":" in cell else ","


def _bare(cell: str) -> str:
    """A cell without the blanks and apostrophes that part thousands, and without a sign of per cent."""
    if cell.isascii() and " " not in cell and "'" not in cell and "%" not in cell:
        return cell
    return re.sub(r"(?<=\d)[ '\u2019\u00a0\u202f](?=\d{3}(?!\d))", "", _PER_CENT.sub("", cell))


def _begin(path: Path, lines: Sequence[str], single: bool) -> tuple[int, str]:
    """First line of the table, and what separates its cells."""
    full = [i for i, line in enumerate(lines) if line.strip()]
    for fewest in (2, 1) if single else (2,):
        for first, second in pairwise(full):
            for delimiter in DELIMITERS:
                one, two = (_numbers(_cells(lines[i], delimiter)) for i in (first, second))
                if one and two and len(one) == len(two) >= fewest:
                    return _with_text_above(lines, first, delimiter), delimiter
    if found := _begin_beside_text(lines):
        return found
    column = "" if single else '; of readings alone, one a line, say how often they were taken: --rate "200 kHz"'
    raise MeasuredError(f"{path} holds no table: no two lines in a row of two or more numbers each{column}")


def _with_text_above(lines: Sequence[str], first: int, delimiter: str) -> int:
    """First line of a table whose first rows have text beside their numbers, as an oscilloscope's settings stand."""
    numbers = _number_places(_cells(lines[first], delimiter))
    while first and delimiter != " " and _covers(_number_places(_cells(lines[first - 1], delimiter)), numbers):
        first -= 1
    return first


def _covers(above: tuple[bool, ...], below: tuple[bool, ...]) -> bool:
    """Whether a line has as many cells as the row below it, and numbers wherever that has them."""
    return len(above) == len(below) and all(a or not b for a, b in zip(above, below, strict=True))


def _begin_beside_text(lines: Sequence[str]) -> tuple[int, str] | None:
    """Of a table with columns of text: where the most lines in a row have their numbers in the same places."""
    best, found = 1, None
    for delimiter in (d for d in DELIMITERS if d != " "):
        places = [_number_places(_cells(line, delimiter)) for line in lines]
        first = 0
        for _, same in groupby(places):
            count = len(list(same))
            numbers = places[first]
            if count > best and len(numbers) > sum(numbers) > 1:
                start = first
                while start and _fits(places[start - 1], numbers):
                    start -= 1
                best, found = count, (start, delimiter)
            first += count
    return found


def _number_places(cells: Sequence[str]) -> tuple[bool, ...]:
    """Which cells are numbers."""
    return tuple(bool(_number(cell, "")) for cell in cells)


def _fits(above: tuple[bool, ...], below: tuple[bool, ...]) -> bool:
    """Whether a line is a row of the table below it, perhaps with gaps: numbers, and only where that has them."""
    return any(above) and len(above) == len(below) and all(b or not a for a, b in zip(above, below, strict=True))


def _without_text(body: Sequence[tuple[int, list[str]]], width: int) -> tuple[list[tuple[int, list[str]]], list[int]]:
    """The rows with empty cells in the columns that hold text, and the places of these columns.

    A column of text holds no number, or, beside the first rows of a longer table alone, settings and figures.
    """
    rows = [cells for _, cells in body if len(cells) == width]
    below = rows[MOST_BESIDE:] if len(rows) > 2 * MOST_BESIDE else rows
    texts = [
        j
        for j in range(width)
        if not any(_number(cells[j], "") for cells in below) and any(_number(cells[j], "") is None for cells in rows)
    ]
    if not texts:
        return list(body), []
    blank = [
        (i, ["" if j in texts else cell for j, cell in enumerate(cells)] if len(cells) == width else cells)
        for i, cells in body
    ]
    return blank, texts


def _cells(line: str, delimiter: str) -> list[str]:
    if delimiter == " ":
        return line.split()
    return cells_of(line, delimiter)


def _numbers(cells: Sequence[str], marks: Iterable[str] = repeat("")) -> tuple[str, ...] | None:
    """Cells as numbers' texts, times of day as they are, "" for a gap; None where any is something else or all gaps.

    marks: the mark of decimals of every cell, "" for either.
    """
    found = tuple(map(_number, cells, marks))
    return None if None in found or not any(found) else found  # pyright: ignore[reportReturnType]


def _number(cell: str, decimal: str) -> str | None:
    """A cell as a number's text, a time of day as it is, "" for a gap; None where it is something else."""
    if decimal != "," and _PLAIN.fullmatch(cell):
        return cell
    if not cell or cell.lower() in GAPS or _NO_NUMBER.fullmatch(cell):
        return ""
    if ":" in cell:
        return cell if _CLOCK.fullmatch(cell) else None
    bare = _bare(cell)
    mark = decimal or _decimal_of(bare) or "."
    if "," in bare or mark == ",":
        other = "." if mark == "," else ","
        whole, _, part = bare.rpartition(mark) if mark in bare else (bare, "", "")
        if other in whole and not re.fullmatch(rf"[+-]?[1-9]\d{{0,2}}(?:\{other}\d{{3}})+", whole):
            return number_text(bare) if mark not in bare and _NUMBER.fullmatch(bare) else None
        bare = whole.replace(other, "") + (f".{part}" if mark in bare else "")
    if not _NUMBER.fullmatch(bare):
        return None
    text = number_text(bare)
    return "" if "E" in text.upper() and NO_READING <= abs(float(text)) < math.inf else text


def number_text(cell: str) -> str:
    """A number as data.units reads it: Fortran's 1.0D-03 and 1.0-103 become 1.0E-03 and 1.0E-103."""
    if not _FORTRAN.search(cell):
        return cell
    return re.sub(r"(?<=[\d.])([+-]\d{3})$", r"E\1", re.sub("[dD]", "E", cell))


def _heads(lines: Sequence[str], delimiter: str, width: int, filled: int) -> tuple[tuple[Head, ...], tuple[str, ...]]:
    """Names and units from the lines above the table, the nearest first, and all those lines as notes.

    filled: columns up to the last that holds anything.
    """
    above = [line.lstrip(" #$%") for line in lines if line.strip()]
    exact = [_head_cells(line, delimiter, width) for line in reversed(above)]
    fitted = [_fitted(cells, width, filled) if delimiter != " " else cells for cells in exact]
    nearest = [*fitted[:NEAREST], *exact[NEAREST:]]
    nearest = [cells for cells in nearest if len(cells) == width and not _holds_a_number(cells[:filled])]
    labelled = next((cells for cells in fitted if len(cells) == width and cells[0].lower() in UNIT_LABELS), None)
    units: list[str | None] = [None] * width
    lowest = next((k for k, cells in enumerate(nearest) if _are_units(cells)), None)
    if lowest is not None and lowest <= 2 and (lowest + 1 < len(nearest) or lowest == 0):
        units = [_unit_text(cell) or None for cell in nearest[lowest]]
        nearest = nearest[lowest + 1 :]
    elif labelled is not None:
        units = [None, *(_unit_text(cell) or None for cell in labelled[1:])]
        nearest = [cells for cells in nearest if cells != labelled]
    nearest = [cells for cells in fitted if len(cells) == width and cells[0].lower() in NAME_LABELS] or nearest
    named = nearest and any(letter.isalpha() for cell in nearest[0] for letter in cell)
    names = nearest[0] if named else [str(i + 1) for i in range(width)] if any(units) else []
    heads = (
        _head(cell, None) if unit is None else replace(head_of(cell, unit), text=cell)
        for cell, unit in zip(names, units if names else (), strict=True)
    )
    return tuple(heads), tuple(line.strip() for line in above)


def _with_clock_unit(
    heads: tuple[Head, ...], lines: Sequence[str], delimiter: str, width: int, clock: int
) -> tuple[Head, ...]:
    """The heads with the unit that an oscilloscope's settings give of its clock, where its own head gives none."""
    cells = (_cells(line.lstrip(" #$%"), delimiter) for line in lines)
    units = (row[1] for row in cells if len(row) > 1 and row[0].strip(": ").lower() in CLOCK_LABELS)
    unit = next((one for one in units if _is_unit(one) and one not in RATIO), None)
    if not unit or (heads and (heads[clock].unit is not None or heads[clock].foreign)):
        return heads
    heads = heads or tuple(Head(str(j + 1), text=str(j + 1)) for j in range(width))
    return (*heads[:clock], replace(heads[clock], unit=unit), *heads[clock + 1 :])


def _with_per_cent(
    path: Path, heads: tuple[Head, ...], body: Sequence[tuple[int, list[str]]], width: int
) -> tuple[Head, ...]:
    """The heads with % as the unit of columns whose cells bear it: 0.15% below "Strain [%]", or below no unit.

    Where some numbers of a column bear it and some do not, or its head gives another unit, that is its head's fault.
    """
    for j in range(width):
        if not any("%" in cells[j] for _, cells in body):
            continue
        signed = {bool(_PER_CENT.search(cells[j])): i for i, cells in body if _number(cells[j], "")}
        if True not in signed:
            continue
        heads = heads or tuple(Head(str(k + 1), text=str(k + 1)) for k in range(width))
        said = heads[j].unit or heads[j].foreign
        if False in signed or said not in ("", "%"):
            beside = f"line {signed[False]} has no such sign" if False in signed else f"its head says {said}"
            fault = (
                f'{path}, line {signed[True]}: a number of column "{heads[j].name}" bears a sign of per cent, and '
                f"{beside}; write all its numbers in one unit, and that into the head"
            )
            heads = (*heads[:j], replace(heads[j], fault=fault), *heads[j + 1 :])
            continue
        heads = (*heads[:j], replace(heads[j], unit="%"), *heads[j + 1 :])
    return heads


def _refuse_common_factor(path: Path, above: Sequence[str]) -> None:
    """Raises MeasuredError for a factor that MATLAB shows once, above all numbers of a matrix."""
    for i, line in enumerate(above, 1):
        if _FACTOR.fullmatch(line):
            raise MeasuredError(
                f'{path}, line {i}: "{line.strip()}" multiplies all numbers below it; write them in full (format '
                "long g, or writematrix), or multiply them and delete the line"
            )


def _refuse_parted_decimals(
    path: Path, above: Sequence[str], rows: Sequence[tuple[int, tuple[str, ...]]], delimiter: str, filled: int
) -> None:
    """Raises MeasuredError where commas part the cells and their decimals: 0,5,1,25 below the heads of two columns."""
    names = _cells(next((line for line in reversed(above) if line.strip()), ""), delimiter)
    parted = delimiter == "," and 1 < len(names) < filled <= 2 * len(names) and all(names)
    if (
        parted
        and not any(_number(name, "") for name in names)
        and not any("." in c for _, cells in rows for c in cells)
    ):
        raise MeasuredError(
            f"{path}, line {rows[0][0]}: {filled} numbers stand below the heads of {len(names)} columns, all of them "
            "whole: commas part the columns and mark decimals; export the file with semicolons, or with decimal points"
        )


def _fitted(cells: Sequence[str], width: int, filled: int) -> list[str]:
    """Cells of a line as many as a row's: what stands beyond them, above no column, goes; empty columns get none."""
    return [*cells, *[""] * (width - len(cells))][:width] if len(cells) >= filled else list(cells)


def _rows_lost_above(path: Path, above: Sequence[str], delimiter: str, width: int) -> list[str]:
    """Errors for the lines right above the table that begin with a number, as rows do, and hold a word besides."""
    errors = []
    for i in range(len(above), 0, -1):
        cells = _cells(above[i - 1], delimiter)
        longer = delimiter != " " and len(cells) > width and _numbers(cells[:width]) is not None
        if not longer and (len(cells) != width or not _number(cells[0], "") or _numbers(cells) is not None):
            break
        errors.append(
            f'{path}, line {i}: "{above[i - 1].strip()[:40]}" is not {width} numbers, as the rows below it are; a gap '
            "is an empty cell, NaN, OVL or -"
        )
    return errors[::-1]


def _head_cells(line: str, delimiter: str, width: int) -> list[str]:
    """Cells of a line above the table: an empty one too many at its end is left out; names may hold single blanks."""
    cells = _cells(line, delimiter)
    if delimiter == " " and len(cells) != width:
        cells = re.split(r"\s{2,}|\t", line.strip())
    return cells[:-1] if len(cells) == width + 1 and not cells[-1] else cells


def _holds_a_number(cells: Sequence[str]) -> bool:
    """Whether a line tells figures of its columns, such as their largest reading, and so names none.

    The channels' own numbers, 1, 2 and so on, are names.
    """
    if list(cells[1:]) == [str(i) for i in range(1, len(cells))]:
        return False
    return len(cells) > 1 and any(cell not in RATIO and _number(cell, "") for cell in cells[1:])


def _are_units(cells: Sequence[str]) -> bool:
    """Whether a line's cells are units of what sensors give, or empty; below a unit of time, units of anything.

    Beside one that is written right, others may be in the wrong case: ms, mm, KN.
    """
    bare = [_unit_text(cell) for cell in cells]
    if any(map(_is_unit, filter(None, bare))) and all(_is_unit(c) or (len(c) > 1 and _likely(c)) for c in bare):
        return True
    first = next(filter(None, bare), "")
    return _is_unit(first) and si_unit(first) == "s" and all(not c or _measures_something(c) for c in bare)


def _unit_text(cell: str) -> str:
    """A cell of a row of units without its brackets; seconds where it says how a clock is written."""
    text = cell.strip("[]()").strip()
    return "s" if _CLOCK_PATTERN.fullmatch(text) else text


def _is_unit(cell: str) -> bool:
    """Whether a header's cell is a unit of what sensors give; "-" and "1" stand for a ratio."""
    text = cell.strip("[]()")
    if not text or text in RATIO:
        return not cell or text in RATIO
    try:
        return bool(si_unit(text)) or is_ratio(text) or "/" in text
    except UnitError:
        return False


def head_of(name: str, unit: str | None) -> Head:
    """A column's head by its name, and its unit where the format gives one."""
    if unit is None:
        return _head(name, None)
    if _is_unit(unit):
        return Head(name, _ratio(unit), name)
    return _foreign_head(name, unit, name) or Head(name, None, name)


def _head(cell: str, unit: str | None) -> Head:
    """Name and unit of a header's cell, in one of the usual spellings."""
    for match in _matches(cell):
        if unit is None and _is_unit(match["unit"]) and not _is_quotient(cell):
            return Head(match["name"].strip(), _ratio(match["unit"].strip()), cell)
    bracket = _UNIT[0].fullmatch(cell.strip())
    if unit is None and bracket is not None:
        return _foreign_head(bracket["name"].strip(), bracket["unit"].strip(), cell) or Head(cell, None, cell)
    return Head(cell, unit, cell)


def _likely(unit: str) -> str:
    """The unit of a clock or a sensor that one in the wrong case stands for; empty where there is none."""
    better = usual(unit)
    return better if better and si_unit(better) in (*MEASURED, *TIME) else ""


def _foreign_head(name: str, unit: str, text: str) -> Head | None:
    """A head whose unit measures nothing used here, or is in the wrong case; None for a text that is no unit."""
    likely = _likely(unit)
    return Head(name, None, text, unit, likely) if likely or _measures_something(unit) else None


def _is_quotient(cell: str) -> bool:
    """Whether a cell is itself a unit, such as m/s or µm/m, and no name with a unit behind a stroke: t is the time."""
    above, stroke, below = cell.strip().partition("/")
    return bool(stroke) and above != "t" and _is_unit(above) and _is_unit(below)


def _ratio(unit: str) -> str:
    """The unit itself; none for a ratio."""
    return "" if unit in RATIO else unit


def _measures_something(unit: str) -> bool:
    """Whether a text is a unit of any dimension, such as V."""
    try:
        return bool(unit.strip()) and factor(unit) > 0
    except UnitError:
        return False


def _matches(cell: str) -> Iterator[re.Match[str]]:
    return (match for pattern in _UNIT if (match := pattern.fullmatch(cell.strip())))
