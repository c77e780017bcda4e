"""A user's own design: CSV with `#` provenance, a header of dotted case keys with their units, one row a run.

A campaign's own `design.csv` is read as it stands, in SI: its header is `run`, then the bare keys.
"""

from __future__ import annotations

import csv
import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.errors import UserError
from birdstrike.data.formatting import many
from birdstrike.data.histories import Array
from birdstrike.data.units import ACCEPTED, UnitError, scaled, si_unit
from birdstrike.doe.designs.design import Design
from birdstrike.doe.designs.space import ParameterSpace

_HEADER = re.compile(r"\s*(.+?)\s*(?:\[\s*([^\]]*?)\s*\])?\s*")

Lines = list[tuple[int, list[str]]]


def file_design(path: str | Path, space: ParameterSpace) -> Design:
    """The design of a user's file; runs outside the case's ranges, or that repeat another, are kept, with a warning.

    Raises UserError.
    """
    numbers, values = read_design(path, space)
    said = (*_outside(numbers, values, space), *_repeated(numbers, values))
    return Design("file", None, space, numbers, values, space.to_unit(values), str(path), said)


def _repeated(numbers: NDArray[np.int64], values: Array) -> tuple[str, ...]:
    """One warning where runs have the values of an earlier one, as the replicates of a design for measurements do."""
    first = np.unique(values, axis=0, return_index=True)[1]
    if not (count := len(numbers) - len(first)):
        return ()
    again = numbers[np.setdiff1d(np.arange(len(numbers)), first)[0]]
    return (
        f"{count} of {len(numbers)} runs repeat the values of an earlier one (first: run {again}): a simulation gives "
        "the same curves again, from which nothing is learnt; leave them out",
    )


def _outside(numbers: NDArray[np.int64], values: Array, space: ParameterSpace) -> tuple[str, ...]:
    """One warning a parameter whose range some runs leave: the user's own design is run all the same."""
    outside = space.outside(values)
    return tuple(
        f"{name}: {outside[:, j].sum()} of {len(numbers)} runs are outside the case's range "
        f"(first: run {numbers[outside[:, j]][0]}); they are run as the file says"
        for j, name in enumerate(space.names)
        if outside[:, j].any()
    )


def read_design(path: str | Path, space: ParameterSpace) -> tuple[NDArray[np.int64], Array]:
    """Run numbers (n,) (from the column `run`, else 1..n) and SI values (n, k) in the order of `space`.

    The columns are the case's parameters, all of them, each with its unit: `bird.material.viscosity [Pa s]`; only a
    `design.csv` that run-doe wrote has none and is SI. Raises UserError with every error of the file, by line.
    """
    lines = _lines(Path(path))
    if len(lines) < 3:
        raise UserError(f"{path} has {max(len(lines) - 1, 0)} runs; a design needs a header and at least two rows")
    columns = _own_columns(lines[0][1], space) if _is_own(Path(path)) else None
    columns = columns or _columns(lines[0], space, str(path))
    numbers, values = _rows(lines[1:], columns, space, str(path))
    return numbers, values


def _lines(path: Path) -> Lines:
    """(line number, cells) of every line that is neither blank nor provenance."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise UserError(f"{path} is not UTF-8 text; save it as CSV (UTF-8)") from error
    kept = [(i, line) for i, line in enumerate(text.splitlines(), 1) if line.strip() and not line.startswith("#")]
    return [(i, [cell.strip() for cell in next(csv.reader([line]))]) for i, line in kept]


def _is_own(path: Path) -> bool:
    """Whether a campaign wrote the file: `design.csv`, without provenance, beside the campaign's `case.json`."""
    return path.name == "design.csv" and (path.parent / "case.json").is_file()


def _own_columns(cells: list[str], space: ParameterSpace) -> list[tuple[str, str]] | None:
    """(key, SI unit) where the header is `run`, then exactly the bare keys, in any order; else None."""
    units = dict(zip(space.names, space.units, strict=True))
    if cells[:1] != ["run"] or sorted(cells[1:]) != sorted(units):
        return None
    return [("run", ""), *((key, units[key]) for key in cells[1:])]


def _columns(header: tuple[int, list[str]], space: ParameterSpace, path: str) -> list[tuple[str, str]]:
    """(key, unit) of every column; the keys are `run` and exactly the parameters of the case."""
    line, cells = header
    matches = [_HEADER.fullmatch(cell) for cell in cells]
    columns = [(m.group(1), m.group(2) or "") if m else ("", "") for m in matches]
    keys = [key for key, _ in columns]
    errors = [f"column {key} stands twice" for key in dict.fromkeys(keys) if keys.count(key) > 1]
    errors += [
        f"column {key or '(empty)'} is not a parameter of the case; its parameters: {', '.join(space.names)}"
        for key in dict.fromkeys(keys)
        if key != "run" and key not in space.names
    ]
    missing = [name for name in space.names if name not in keys]
    errors += [f"column {name} is missing; every parameter of the case has one" for name in missing]
    errors += [e for key, unit in columns if key in space.names for e in _unit_error(key, unit, space)]
    if errors:
        raise UserError([f"line {line}: {error}" for error in errors], f"{path}: the header cannot be used")
    return columns


def _unit_error(key: str, unit: str, space: ParameterSpace) -> list[str]:
    expected = space.units[space.names.index(key)]
    try:
        fits = si_unit(unit) == expected
    except UnitError:
        fits = False
    if fits:
        return []
    given = f'has the unit "{unit}"' if unit else "has no unit"
    return [f"column {key} {given}; write {key} [{expected}], accepted units: {ACCEPTED.get(expected, expected)}"]


def _rows(
    lines: Lines, columns: list[tuple[str, str]], space: ParameterSpace, path: str
) -> tuple[NDArray[np.int64], Array]:
    errors: list[str] = []
    numbers, values = np.arange(1, len(lines) + 1), np.full((len(lines), len(space.names)), np.nan)
    for row, (line, cells) in enumerate(lines):
        if len(cells) != len(columns):
            errors.append(f"line {line}: {len(cells)} cells where the header has {len(columns)}")
            continue
        for (key, unit), cell in zip(columns, cells, strict=True):
            try:
                if key == "run":
                    numbers[row] = _run_number(cell)
                else:
                    values[row, space.names.index(key)] = scaled(cell, unit)
            except UnitError as error:
                errors.append(f"line {line}, column {key}: {error}")
    unique, counts = np.unique(numbers, return_counts=True)
    repeated = unique[counts > 1]
    if repeated.size and not errors:
        errors.append(f"column run: {', '.join(map(str, repeated))} stands more than once; number the runs apart")
    if errors:
        raise UserError(errors, f"{path}: {many(len(errors), 'error')}")
    return numbers, values


def _run_number(cell: str) -> int:
    if not re.fullmatch(r"[1-9]\d{0,8}", cell):
        raise UnitError(f'"{cell}" is not a run number; use 1, 2, 3, ...')
    return int(cell)
