"""What somebody else's solver has written, read back: CSV, columns of numbers, or LS-DYNA's nodout; SI."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pandas as pd

from birdstrike.data.errors import MeasuredError, RunFailed
from birdstrike.data.exports.nodout import read_nodout
from birdstrike.data.histories import Array
from birdstrike.data.tables.loose_table import number_text
from birdstrike.data.units import factor
from birdstrike.solver.case.external import ColumnsReading, CsvReading, NodoutReading, Reading

Curve = tuple[Array, Array]

_NUMBER = re.compile(r"[+-]?\d*\.\d*(?:[EeDd][+-]?\d+|[+-]\d{2,3})?|[+-]?\d+")
_COMMENT = ("#", "$", "*", "%", "!")


def read_sensor(folder: Path, reading: Reading) -> Curve:
    """Times [s], increasing, and values in SI of one sensor, (n,) each; raises RunFailed naming the file."""
    path = folder / reading.file
    if not path.is_file():
        raise RunFailed(f"the solver has written no {reading.file}")
    try:
        time, values = READERS[reading.format](path, reading)
    except MeasuredError as error:
        raise RunFailed("; ".join(error.errors).replace(str(path), reading.file)) from error
    except (ValueError, KeyError, IndexError, UnicodeDecodeError, pd.errors.ParserError) as error:
        raise RunFailed(f"{reading.file} cannot be read: {error}") from error
    time, first = np.unique(time * float(factor(reading.time_unit)), return_index=True)
    if len(time) < 2:
        raise RunFailed(f"{reading.file} holds {len(time)} instants; a history needs at least 2")
    return time, values[first] * (reading.factor * float(factor(reading.unit)))


def _read_csv(path: Path, reading: Reading) -> Curve:
    assert isinstance(reading, CsvReading)
    table = pd.read_csv(path, comment="#", skipinitialspace=True)
    table.columns = [str(name).strip() for name in table.columns]
    time = table.columns[0] if reading.time is None else reading.time
    missing = [name for name in (time, reading.column) if name not in table]
    if missing:
        raise ValueError(f"no column {missing[0]}; its columns: {', '.join(table.columns)}")
    return table[time].to_numpy(dtype=float), table[reading.column].to_numpy(dtype=float)


def _read_columns(path: Path, reading: Reading) -> Curve:
    """Rows that are not numbers throughout (titles, comments) are left out, as between curves of an exported file."""
    assert isinstance(reading, ColumnsReading)
    rows = []
    for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
        cells = [] if line.lstrip().startswith(_COMMENT) else line.replace(",", " ").split()
        if cells and all(_NUMBER.fullmatch(cell) for cell in cells):
            rows.append([float(number_text(cell)) for cell in cells])
    if any(len(row) < reading.column for row in rows):
        raise ValueError(f"a row has fewer than {reading.column} columns")
    table = np.array([[row[0], row[reading.column - 1]] for row in rows]).reshape(-1, 2)
    return table[:, 0], table[:, 1]


def _read_nodout(path: Path, reading: Reading) -> Curve:
    """One component of one node."""
    assert isinstance(reading, NodoutReading)
    table = read_nodout(path, reading.node)
    column = table.index(reading.component.replace("_", "-"))
    values = np.array([[float(row[0]), float(row[column])] for _, row in table.rows])
    return values[:, 0], values[:, 1]


READERS: Mapping[str, Callable[[Path, Reading], Curve]] = MappingProxyType(
    {"csv": _read_csv, "columns": _read_columns, "nodout": _read_nodout}
)
