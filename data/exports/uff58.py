"""Universal File Format, data set 58 (functions over time), by pyuff."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pyuff  # pyright: ignore[reportMissingImports] (an optional extra)

from birdstrike.data.errors import MeasuredError
from birdstrike.data.exports.columns import NamedColumn, table_of
from birdstrike.data.tables.loose_table import LooseTable

SAME = 1e-9  # of the last instant


def read(path: Path, table: str) -> LooseTable:  # noqa: ARG001 (formats share one interface)
    """Every data set 58 on the clock of the first; raises MeasuredError where another has a clock of its own."""
    try:
        found = pyuff.UFF(str(path)).read_sets()
    except Exception as error:  # the library lets Python's own errors through
        raise MeasuredError(f"{path} cannot be read as a universal file: {error}") from error
    sets: list[dict[str, Any]] = [
        one for one in (found if isinstance(found, list) else [found]) if one.get("type") == 58
    ]
    if not sets:
        raise MeasuredError(f"{path} holds no data set 58")
    clock = np.asarray(sets[0]["x"], dtype=float)
    columns = [NamedColumn("time", clock, _unit(sets[0], "abscissa") or "s")]
    for one in sets:
        x = np.asarray(one["x"], dtype=float)
        if len(x) != len(clock) or np.abs(x - clock).max() > SAME * abs(clock[-1]):
            raise MeasuredError(f"{path}: {_name(one)} has a clock of its own; export it to a file of its own")
        columns.append(NamedColumn(_name(one), np.real(np.asarray(one["data"])).astype(float), _unit(one, "ordinate")))
    return table_of(path, columns, ["universal file, data sets 58"])


def _name(one: dict[str, Any]) -> str:
    """Its first line of identification, or node and direction."""
    text = str(one.get("id1", "")).strip()
    return text if text and text.upper() != "NONE" else f"{one.get('rsp_node', 0)} {one.get('rsp_dir', 0)}"


def _unit(one: dict[str, Any], axis: str) -> str | None:
    text = str(one.get(f"{axis}_axis_units_lab", "")).strip()
    return text if text and text.upper() != "NONE" else None
