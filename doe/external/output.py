"""What somebody else's solver has written, read back: CSV, columns of numbers, or LS-DYNA's nodout; SI."""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pandas as pd

from birdstrike.data.errors import MeasuredError, RunFailed
from birdstrike.data.exports.nodout import read_nodout
from birdstrike.data.histories import Array
from birdstrike.data.units import factor
from birdstrike.solver.case.external import ColumnsReading, CsvReading, NodoutReading, Reading

Curve = tuple[Array, Array]

_NUMBER = re.compile(r"[+-]?(?=\.?\d)\d*\.\d*(?:[EeDd][+-]?\d+|[+-]\d{1,3})?|[+-]?\d+(?:[EeDd][+-]?\d+)?")
_DECIMAL_COMMAS = re.compile(r"(?=.*\s)(?=.*,)(?:[^,]|(?<=\d),(?=\d))*")
"""A line whose cells are separated by blanks, and whose every comma stands between digits."""
_LOST = re.compile(r"[+-]?(?:nan.*|inf|infinity|\*+|1\.#\w+)", re.IGNORECASE)
"""What solvers write in place of a number that is none, or that its field is too narrow for."""
_COMMENT = ("#", "$", "*", "%", "!")


def read_sensor(folder: Path, reading: Reading) -> Curve:
    """Times [s], increasing, and finite values in SI of one sensor, (n,) each; raises RunFailed naming the file.

    Of instants that stand there twice the first counts; times that fall are refused.
    """
    path = folder / reading.file
    if not path.is_file():
        raise RunFailed(f"the solver has written no {reading.file}")
    try:
        time, values = READERS[reading.format](path, reading)
    except MeasuredError as error:
        raise RunFailed("; ".join(error.errors).replace(str(path), reading.file)) from error
    except (ValueError, KeyError, IndexError, UnicodeDecodeError, pd.errors.ParserError) as error:
        raise RunFailed(f"{reading.file} cannot be read: {error}") from error
    time, values = time * float(factor(reading.time_unit)), values * (reading.factor * float(factor(reading.unit)))
    _refuse_no_history(reading.file, time, values)
    time, first = np.unique(time, return_index=True)
    if len(time) < 2:
        raise RunFailed(f"{reading.file} holds {len(time)} instants; a history needs at least 2")
    return time, values[first]


def _refuse_no_history(file: str, time: Array, values: Array) -> None:
    """Raise RunFailed where numbers are not finite, or times fall."""
    finite = np.isfinite(time) & np.isfinite(values)
    if not finite.all():
        row = int(np.argmin(finite))
        raise RunFailed(
            f"{file}: {np.count_nonzero(~finite)} of {len(time)} rows hold no finite number, the first being row "
            f"{row + 1} of the data (time {time[row]:g} s, value {values[row]:g} in SI): the solver has diverged, or "
            "its file has empty cells"
        )
    falls = np.flatnonzero(np.diff(time) < 0.0)
    if len(falls):
        before, after = time[falls[0]], time[falls[0] + 1]
        raise RunFailed(
            f"{file}: the time falls from {1e3 * before:.6g} to {1e3 * after:.6g} ms after row {falls[0] + 1} of the "
            "data: two curves in one file, or a restart? Write one curve a file, its times rising"
        )


def _read_csv(path: Path, reading: Reading) -> Curve:
    assert isinstance(reading, CsvReading)
    with warnings.catch_warnings():
        warnings.simplefilter("error", pd.errors.ParserWarning)
        try:  # index_col: a comma at the end of each row would make an index of the first column
            table = pd.read_csv(path, comment="#", skipinitialspace=True, index_col=False)
        except pd.errors.ParserWarning as error:
            raise ValueError("its rows have more cells than its header has names") from error
    table.columns = [str(name).strip() for name in table.columns]
    time = table.columns[0] if reading.time is None else reading.time
    missing = [name for name in (time, reading.column) if name not in table]
    if missing:
        raise ValueError(f"no column {missing[0]}; its columns: {', '.join(table.columns)}")
    header = pd.read_csv(path, comment="#", header=None, nrows=1, dtype=str).iloc[0].tolist()  # pandas renames twins
    names = [str(name).strip() for name in header]
    for name in filter(None, (reading.time, reading.column)):
        if names.count(name) > 1:
            raise ValueError(f"{names.count(name)} columns are called {name}; give each a name of its own")
    return table[time].to_numpy(dtype=float), table[reading.column].to_numpy(dtype=float)


def _read_columns(path: Path, reading: Reading) -> Curve:
    """Rows that do not begin with a number (titles, comments) are left out; one that has lost a number is an error."""
    assert isinstance(reading, ColumnsReading)
    rows = []
    for i, line in enumerate(path.read_text(encoding="utf-8-sig", errors="replace").splitlines(), 1):
        text = "" if line.lstrip().startswith(_COMMENT) else line.strip()
        cells = text.replace(",", " ").split()
        if cells and "." not in text and _NUMBER.fullmatch(cells[0]) and _DECIMAL_COMMAS.fullmatch(text):
            raise ValueError(f"line {i} has decimal commas: {text}; write points")
        if cells and all(_NUMBER.fullmatch(cell) for cell in cells):
            rows.append([_number(cell) for cell in cells])
        elif any(map(_NUMBER.fullmatch, cells)) and all(_NUMBER.fullmatch(c) or _LOST.fullmatch(c) for c in cells):
            raise ValueError(f"line {i} holds {next(c for c in cells if _LOST.fullmatch(c))} in place of a number")
        elif rows and cells and _NUMBER.fullmatch(cells[0]):
            wrong = next(cell for cell in cells if not _NUMBER.fullmatch(cell))
            raise ValueError(f"line {i} begins with a number and holds {wrong}, which is none")
    if any(len(row) < reading.column for row in rows):
        raise ValueError(f"a row has fewer than {reading.column} columns")
    table = np.array([[row[0], row[reading.column - 1]] for row in rows]).reshape(-1, 2)
    return table[:, 0], table[:, 1]


def _number(cell: str) -> float:
    """Fortran's exponents included: 1.0D-03, 1.0-103, 2.0-5."""
    return float(re.sub(r"(?<=[\d.])([+-]\d+)$", r"E\1", re.sub("[dD]", "E", cell)))


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
