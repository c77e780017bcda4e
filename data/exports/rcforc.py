"""LS-DYNA's rcforc: forces of the contacts over time, from the ASCII file that the solver (or l2a) writes."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from birdstrike.data.errors import MeasuredError
from birdstrike.data.exports.columns import NamedColumn, table_of
from birdstrike.data.tables.loose_table import LooseTable, number_text
from birdstrike.data.tables.text_file import text_lines

SIDES = {"slave": "slave", "master": "master", "surfa": "slave", "surfb": "master"}
"""Side of a contact, as older and newer versions call it -> as a column is called."""
_ROW = re.compile(
    r"\s*(slave|master|surf ?a|surf ?b)\s+(\d+)\s+time\s+(\S+)"
    r"\s*x\s*(\S+?)\s*y\s*(\S+?)\s*z\s*(\S+?)\s*(?:mass|mx|tb|$)",
    re.IGNORECASE,
)
SEARCHED = 400


def is_rcforc(path: str | Path) -> bool:
    """Whether a file has rows of contact forces."""
    return any(_ROW.match(line) for line in text_lines(Path(path))[:SEARCHED])


def read_rcforc(path: str | Path) -> LooseTable:
    """Time and the columns "x-force master 1" .. of every contact, without units, which the file does not know."""
    source, times, found = Path(path), dict[tuple[str, int], list[float]](), dict[tuple[str, int], list[list[float]]]()
    for i, line in enumerate(text_lines(source), 1):
        match = _ROW.match(line)
        if match is None:
            continue
        key = (SIDES[match[1].lower().replace(" ", "")], int(match[2]))
        try:
            time, *force = (float(number_text(cell)) for cell in match.groups()[2:])
        except ValueError as error:
            raise MeasuredError(f"{source}, line {i}: {error}; a run that was cut short?") from error
        times.setdefault(key, []).append(time)
        found.setdefault(key, []).append(force)
    if not found:
        raise MeasuredError(f"{source} holds no forces of contacts (slave 1 time ... x ... y ... z ...)")
    length = min(map(len, times.values()))
    clock = np.array(next(iter(times.values()))[:length])
    columns = [NamedColumn("time", clock)]
    for (side, number), forces in found.items():
        values = np.array(forces[:length])
        columns += [NamedColumn(f"{axis}-force {side} {number}", values[:, k]) for k, axis in enumerate("xyz")]
    return table_of(source, columns, ["SIMULATED: rcforc of LS-DYNA"])
