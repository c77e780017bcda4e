"""Columns of numbers as a table, from formats that hold arrays."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from birdstrike.data.errors import MeasuredError
from birdstrike.data.histories import Array
from birdstrike.data.tables.loose_table import LooseTable, head_of


class SeveralTables(MeasuredError):
    """A file that holds several tables, of which none is named; noun: what they are in its format."""

    def __init__(self, path: Path, tables: Sequence[str], noun: str) -> None:
        self.path, self.tables, self.noun = path, tuple(tables), noun
        known = ", ".join(tables)
        super().__init__(f'{path} holds {len(tables)} {noun}s; choose one: --table "{tables[0]}" (there are {known})')

    def __reduce__(self) -> tuple[type[SeveralTables], tuple[Path, tuple[str, ...], str]]:
        return type(self), (self.path, self.tables, self.noun)


@dataclass(frozen=True)
class NamedColumn:
    """values (n,) in `unit`, as the file writes it, None where it has none."""

    name: str
    values: Array
    unit: str | None = None


def table_of(path: Path, columns: Sequence[NamedColumn], notes: Iterable[str] = ()) -> LooseTable:
    """The columns as long as most are, the first that is called time before all; raises MeasuredError without any."""
    lengths = Counter(len(column.values) for column in columns)
    if not columns or lengths.most_common(1)[0][0] < 2:
        raise MeasuredError(f"{path} holds no columns of two or more numbers")
    length = max(lengths, key=lambda n: (lengths[n], n))
    kept = [column for column in columns if len(column.values) == length]
    clock = next((column for column in kept if _is_called_time(column.name)), kept[0])
    kept = [clock, *(column for column in kept if column is not clock)]
    heads = tuple(head_of(column.name, column.unit) for column in kept)
    texts = [[repr(float(v)) if np.isfinite(v) else "" for v in column.values] for column in kept]
    rows = tuple((i, cells) for i, cells in enumerate(zip(*texts, strict=True), 1))
    left = [column.name for column in columns if len(column.values) != length]
    remarks = (f"columns of other lengths were left out: {', '.join(left[:10])}",) if left else ()
    return LooseTable(path, heads, rows, tuple(notes), remarks)


def _is_called_time(name: str) -> bool:
    return name.lower().startswith(("time", "t ", "zeit")) or name.lower() == "t"


def chosen(path: Path, tables: Sequence[str], table: str, noun: str) -> str:
    """The table that is asked for, or the only one; raises MeasuredError that lists them.

    Of several of which none is named SeveralTables.
    """
    if table in tables:
        return table
    known = ", ".join(tables)
    if not tables:
        raise MeasuredError(f"{path} holds no {noun} with a curve")
    if table:
        raise MeasuredError(f'{path} has no {noun} "{table}"; it has {known}')
    if len(tables) != 1:
        raise SeveralTables(path, tables, noun)
    return tables[0]
