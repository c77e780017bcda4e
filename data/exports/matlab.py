"""MATLAB's .mat: the numeric arrays of a file, or of one struct in it, by scipy (to version 7) or h5py (7.3)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from scipy.io import loadmat

from birdstrike.data.errors import MeasuredError
from birdstrike.data.exports.columns import NamedColumn, table_of
from birdstrike.data.histories import Array
from birdstrike.data.tables.loose_table import LooseTable


def read(path: Path, table: str) -> LooseTable:
    """Every vector, and every column of a matrix ("data 2"), of a wide one every row; table: the struct or array that
    holds them. The elements of struct arrays and cells are called as in MATLAB, "ch(2).data" and "ch{2}".
    """
    try:
        content = _content(path)
    except Exception as error:  # scipy lets a dozen of Python's own errors through for a file that is none
        raise MeasuredError(f"{path} cannot be read as a file of MATLAB: {error}") from error
    if table:
        if table not in content:
            raise MeasuredError(f'{path} has no variable "{table}"; it has {", ".join(content)}')
        inside = content[table]
        content = dict(inside) if isinstance(inside, Mapping) else {table: inside}
    found = list(_columns(content))
    is_complex = [column.name for column, _ in found if np.iscomplexobj(column.values)]
    wide = dict.fromkeys(matrix for _, matrix in found if matrix)
    read = table_of(path, [column for column, _ in found if column.name not in is_complex], ["MATLAB"])
    remarks = [f"of {name} the rows are the channels, for it has more columns than rows" for name in wide]
    remarks += [f"columns of complex numbers were left out: {', '.join(is_complex[:10])}"] if is_complex else []
    return replace(read, remarks=(*read.remarks, *remarks))


def _content(path: Path) -> dict[str, Any]:
    if h5py.is_hdf5(path):
        with h5py.File(path) as file:
            return {name: _loaded(item) for name, item in file.items() if not name.startswith("#")}
    found = loadmat(path, simplify_cells=True)
    return {name: value for name, value in found.items() if not name.startswith("__")}


def _loaded(item: Any) -> Any:
    """A group as a table of its own, references as what they point at, an array turned as MATLAB shows it."""
    if isinstance(item, h5py.Group):
        return {name: _loaded(own) for name, own in item.items()}
    if item.attrs.get("MATLAB_class") == b"char" or "MATLAB_empty" in item.attrs:
        return ""
    if h5py.check_ref_dtype(item.dtype):
        return [_loaded(item.file[reference]) for reference in np.asarray(item).T.flat]
    return np.asarray(item).T


def _columns(content: Mapping[str, Any], above: str = "") -> Iterator[tuple[NamedColumn, str]]:
    """Columns, each with the name of the wide matrix whose row it is, "" where it is none."""
    for name, value in content.items():
        full = f"{above}{name}"
        if isinstance(value, Mapping):
            yield from _columns(value, f"{full}.")
        elif isinstance(value, list) or (isinstance(value, np.ndarray) and value.dtype.kind == "O"):
            yield from _columns({_element(full, i, one): one for i, one in enumerate(value, 1)})
        else:
            yield from _numbers(full, np.atleast_1d(np.squeeze(np.asarray(value))))


def _element(name: str, number: int, value: Any) -> str:
    """An element of a struct array, ch(2), or of a cell, ch{2}, as in MATLAB."""
    return f"{name}({number})" if isinstance(value, Mapping) else f"{name}{{{number}}}"


def _numbers(name: str, values: Array) -> Iterator[tuple[NamedColumn, str]]:
    """The columns of an array of numbers, or the rows of one that is wider than high, as Simulink's files are."""
    if values.ndim > 2 or not np.issubdtype(values.dtype, np.number) or values.size < 2:
        return
    values = values if np.iscomplexobj(values) else values.astype(float)
    if values.ndim == 1:
        yield NamedColumn(name, values), ""
        return
    wide = values.shape[1] > values.shape[0]
    for j, column in enumerate(values if wide else values.T, 1):
        yield NamedColumn(f"{name} {j}", column), name if wide else ""
