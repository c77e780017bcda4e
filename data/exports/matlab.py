"""MATLAB's .mat: the numeric arrays of a file, or of one struct in it, by scipy (to version 7) or h5py (7.3)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from scipy.io import loadmat

from birdstrike.data.errors import MeasuredError
from birdstrike.data.exports.columns import NamedColumn, table_of
from birdstrike.data.tables.loose_table import LooseTable


def read(path: Path, table: str) -> LooseTable:
    """Every vector, and every column of a matrix ("data 2"); table: the struct or array that holds them."""
    try:
        content = _content(path)
    except Exception as error:  # scipy lets a dozen of Python's own errors through for a file that is none
        raise MeasuredError(f"{path} cannot be read as a file of MATLAB: {error}") from error
    if table:
        if table not in content:
            raise MeasuredError(f'{path} has no variable "{table}"; it has {", ".join(content)}')
        inside = content[table]
        content = dict(inside) if isinstance(inside, Mapping) else {table: inside}
    return table_of(path, list(_columns(content)), ["MATLAB"])


def _content(path: Path) -> dict[str, Any]:
    if h5py.is_hdf5(path):
        with h5py.File(path) as file:
            return {name: _loaded(item) for name, item in file.items() if not name.startswith("#")}
    found = loadmat(path, simplify_cells=True)
    return {name: value for name, value in found.items() if not name.startswith("__")}


def _loaded(item: Any) -> Any:
    """A group as a table of its own, an array turned as MATLAB shows it."""
    if isinstance(item, h5py.Group):
        return {name: _loaded(own) for name, own in item.items()}
    return np.asarray(item).T


def _columns(content: Mapping[str, Any], above: str = "") -> Iterator[NamedColumn]:
    for name, value in content.items():
        full = f"{above}{name}"
        if isinstance(value, Mapping):
            yield from _columns(value, f"{full}.")
            continue
        values = np.atleast_1d(np.squeeze(np.asarray(value)))
        if values.ndim > 2 or not np.issubdtype(values.dtype, np.number) or values.size < 2:
            continue
        if values.ndim == 1:
            yield NamedColumn(full, values.astype(float))
        else:
            yield from (NamedColumn(f"{full} {j + 1}", values[:, j].astype(float)) for j in range(values.shape[1]))
