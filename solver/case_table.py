"""The CSV of a tabulated equation of state, read into the case: a case holds the points, not a path."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from data.csv_table import read_table
from data.errors import CaseError, MeasuredError
from data.units import quantity_text
from solver.case_overlay import Raw

COLUMNS = 'its columns are "rho [kg/m^3],p [MPa]" or "mu,p [MPa]"'
UNITS = {"rho": "kg/m^3", "mu": "", "p": "Pa"}


def with_table(raw: Raw, folder: Path) -> Raw:
    """The case's table with the points of `bird.material.eos.file` in its place; raises CaseError.

    folder: that of the file in which the case stands; a path is relative to it.
    """
    eos: Any = raw
    for name in ("bird", "material", "eos"):
        eos = eos.get(name) if isinstance(eos, dict) else None
    if not isinstance(eos, dict) or "file" not in eos:
        return raw
    material = raw["bird"]["material"]
    content = {key: value for key, value in eos.items() if key != "file"} | read_points(folder, eos["file"])
    return raw | {"bird": raw["bird"] | {"material": material | {"eos": content}}}


def read_points(folder: Path, name: Any) -> dict[str, list[str] | list[float]]:
    """Columns of the CSV as the case's own lists of texts and numbers."""
    if not isinstance(name, str):
        raise CaseError(f"bird.material.eos.file = {name} must be the name of a CSV file; {COLUMNS}")
    if not (folder / Path(name).expanduser()).is_file():
        raise CaseError(
            f'bird.material.eos.file = {name}: no such file in "{folder}"; a path is relative to the folder of the '
            "case file that names it, with --set to the one you are in"
        )
    try:
        table = read_table(folder / Path(name).expanduser())
    except MeasuredError as error:
        raise CaseError(f"bird.material.eos.file: {line}" for line in error.errors) from error
    found = {column.name: column for column in table.columns}
    if set(found) not in ({"rho", "p"}, {"mu", "p"}) or any(c.unit != UNITS[n] for n, c in found.items()):
        raise CaseError(f"bird.material.eos.file = {name}: {COLUMNS}")
    gaps = [line for c in table.columns for line, value in zip(c.lines, c.values, strict=True) if math.isnan(value)]
    if gaps:
        raise CaseError(
            f"bird.material.eos.file = {name}, line {gaps[0]}: an empty cell; every point needs both numbers"
        )
    return {name: _texts(column.values, UNITS[name]) for name, column in found.items()}


def _texts(values: Any, unit: str) -> list[str] | list[float]:
    numbers = [float(value) for value in values]
    return [quantity_text(value, unit) for value in numbers] if unit else numbers
