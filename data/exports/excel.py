"""Excel's .xlsx: the values of one sheet, read like the rows of a text file, by openpyxl."""

from __future__ import annotations

import datetime as dt
import re
from decimal import Decimal
from pathlib import Path
from typing import Any

from openpyxl import load_workbook  # pyright: ignore[reportMissingModuleSource] (an optional extra)

from birdstrike.data.errors import MeasuredError
from birdstrike.data.exports.columns import chosen
from birdstrike.data.tables.loose_table import LooseTable, table_of_lines

_LITERAL = re.compile(r'"[^"]*"|\\.')
"""What a number's format shows as it stands."""


def read(path: Path, table: str, decimal: str = "") -> LooseTable:
    """Cells as Excel shows a formula's value; a time of day is one; decimal: mark of numbers that stand as text."""
    try:
        workbook = load_workbook(path, read_only=True, data_only=True)
        sheets = {sheet.title: sheet for sheet in workbook.worksheets}  # sheets of a chart alone hold no cells
        name = chosen(path, list(sheets), table, "sheet")
        lines = ["\t".join(_text(c.value, c.number_format or "") for c in row) for row in sheets[name].iter_rows()]
    except MeasuredError:
        raise
    except Exception as error:  # the library lets errors of zip, zlib and XML through, for a damaged sheet late
        raise MeasuredError(f"{path} cannot be read as a workbook of Excel: {error}") from error
    return table_of_lines(path, lines, decimal)


def _text(value: Any, shown_as: str) -> str:
    """A cell's text by its value and its format, in which 0.0015 may be shown as 0.15%.

    A sign of per cent that the format quotes, 0.00"%", stands behind the value itself.
    """
    if value is None:
        return ""
    if "%" in shown_as and isinstance(value, int | float) and not isinstance(value, bool):
        times = 100 if "%" in _LITERAL.sub("", shown_as) else 1
        return f"{_without_mark(times * Decimal(repr(value)))}%"
    if isinstance(value, dt.datetime):
        return value.time().isoformat()
    if isinstance(value, dt.time):
        return value.isoformat()
    if isinstance(value, float):
        return _without_mark(Decimal(repr(value)))
    return str(value).replace("\t", " ").replace("\n", " ").strip()


def _without_mark(value: Decimal) -> str:
    """A number without a mark of decimals, which would say something of those that stand as text: 1.25 is 125E-2."""
    sign, digits, exponent = value.as_tuple()
    return f"{'-' if sign else ''}{''.join(map(str, digits))}E{exponent}"
