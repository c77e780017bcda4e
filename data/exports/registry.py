"""Which reader takes a file: by the ending of its name."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from pathlib import Path
from types import MappingProxyType

from birdstrike.data.errors import MeasuredError
from birdstrike.data.tables.loose_table import LooseTable

Reader = Callable[[Path, str], LooseTable]
"""read(path, name of the table in the file) -> table."""


@dataclass(frozen=True)
class Format:
    """A file format: module of this folder that reads it, the package that it needs, what it is called, and the extra
    that installs the package; text: whether numbers can stand in it as text, with a mark of decimals."""

    module: str
    package: str
    name: str
    extra: str = "exports"
    text: bool = False
    tables: bool = True


EXPORTS: Mapping[str, Format] = MappingProxyType(
    {
        ".tdms": Format("tdms", "npTDMS", "TDMS file"),
        ".mat": Format("matlab", "scipy", "file of MATLAB"),
        **dict.fromkeys((".xlsx", ".xlsm"), Format("excel", "openpyxl", "workbook of Excel", text=True)),
        **dict.fromkeys((".uff", ".unv", ".uf", ".58"), Format("uff58", "pyuff", "universal file", tables=False)),
        "binout": Format("binout", "lasso-python", "binout of LS-DYNA", "binout"),
        "t01": Format("radioss_t01", "numpy", "time history of Radioss", tables=False),
    }
)
"""Ending of a file's name, or its beginning, -> format."""


def _kind(name: str) -> str:
    """Key of a file's format, of its name in small letters: Radioss numbers its time histories of restarts."""
    if name.startswith("binout"):
        return "binout"
    return "t01" if re.search(r"t\d\d$", name) else Path(name).suffix


def may_hold_tables(path: str | Path) -> bool:
    """Whether a file is of a format that may hold several tables; text holds one."""
    form = EXPORTS.get(_kind(Path(path).name.lower()))
    return form is not None and form.tables


def reader_of(path: str | Path, decimal: str = "") -> Reader | None:
    """The reader of a file's format, None for text; raises MeasuredError where its package is not installed.

    decimal: the mark of decimals of numbers that stand as text, "" for either.
    """
    name = Path(path).name.lower()
    form = EXPORTS.get(_kind(name))
    if form is None:
        return None
    try:
        read = import_module(f"birdstrike.data.exports.{form.module}").read
    except ModuleNotFoundError as error:
        raise MeasuredError(
            f'{path} is a {form.name}, which {form.package} reads: pip install "birdstrike[{form.extra}]"; or export '
            f"the curve as text ({error})"
        ) from error
    return partial(read, decimal=decimal) if form.text else read
