"""LS-DYNA's binout: the arrays of one of its branches (nodout, rcforc, ...) over time, by lasso-python."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from lasso.dyna.binout import Binout  # pyright: ignore[reportMissingImports] (an optional extra)

from birdstrike.data.errors import MeasuredError
from birdstrike.data.exports.columns import NamedColumn, chosen, table_of
from birdstrike.data.tables.loose_table import LooseTable

SIDES = ("slave", "master")
"""Of a contact, by the number that `side` of the branch rcforc has for it."""


def read(path: Path, table: str) -> LooseTable:
    """Columns "z_displacement 1026" by variable and number, of contacts "z_force master 1" by side too; without units,
    which the file does not know."""
    try:
        file = Binout(str(path))
        branches = [name for name in file.read() if "time" in file.read(name)]
    except Exception as error:  # the library lets Python's own errors through
        raise MeasuredError(f"{path} cannot be read as a binout: {error}") from error
    branch = chosen(path, branches, table or ("nodout" if "nodout" in branches else ""), "branch")
    time = np.asarray(file.read(branch, "time"), dtype=float)
    columns = [NamedColumn("time", time)]
    known = _names(file, branch)
    for variable in file.read(branch):
        values = np.asarray(file.read(branch, variable))
        if variable == "time" or not np.issubdtype(values.dtype, np.number) or values.shape[:1] != time.shape:
            continue
        if values.ndim == 1:
            columns.append(NamedColumn(variable, values.astype(float)))
        elif values.ndim == 2:
            names = known if len(known) == values.shape[1] else [str(n + 1) for n in range(values.shape[1])]
            columns += [NamedColumn(f"{variable} {n}", values[:, j].astype(float)) for j, n in enumerate(names)]
    return table_of(path, columns, [f"SIMULATED: binout of LS-DYNA, branch {branch}"])


def _names(file: Binout, branch: str) -> list[str]:
    """Numbers of a branch's entities, with the side of a contact that has two columns; none where it holds none."""
    held = file.read(branch)
    numbers = np.atleast_1d(file.read(branch, "ids")) if "ids" in held else np.zeros(0)
    sides = np.atleast_1d(file.read(branch, "side")) if "side" in held else np.zeros(0)
    if len(sides) != len(numbers):
        return [str(int(n)) for n in numbers]
    return [f"{SIDES[int(side) != 0]} {int(n)}" for side, n in zip(sides, numbers, strict=True)]
