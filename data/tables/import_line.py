"""The `birdstrike import` line that makes a record of a foreign table, for messages."""

from __future__ import annotations

import re
import shlex
from collections.abc import Sequence
from pathlib import Path

from birdstrike.data.errors import MeasuredError
from birdstrike.data.tables.clock import counts_samples, first_clock, is_time
from birdstrike.data.tables.loose_table import MEASURED, SIGMA, TIME, Head, read_loose_table

_OF_A_CASE = re.compile(r"(displacement|strain|contact_force|reaction_force|pressure)(_[A-Za-z0-9_]+)?")
"""Names of columns that are those of a case's sensors already."""


def import_line(path: Path) -> str:
    """The `birdstrike import` line that makes a record of a foreign table; empty where the file holds none."""
    try:
        table = read_loose_table(path)
    except MeasuredError:
        return ""
    heads = table.heads or tuple(Head(name, None, name) for name in table.names)
    clock = first_clock(table)
    places = [i for i in range(table.width) if table.filled(i) and (heads[i].text or heads[i].name)]
    places = [i for i in places if i != clock and not is_time(table, i) and not heads[i].name.endswith(SIGMA)]
    numbered = [i for i in places if i < clock and heads[i].unit is None and counts_samples(table, i)]
    shown_heads = [heads[i] for i in places if i not in numbered][:3]
    names = ["displacement_centre", *(f"SENSOR_{i}" for i in range(2, len(shown_heads) + 1))]
    own = [bool(_OF_A_CASE.fullmatch(head.name)) for head in shown_heads]
    names = [head.name if is_own else name for name, head, is_own in zip(names, shown_heads, own, strict=False)]
    shown = [
        name if is_own else f"{name}={shlex.quote(head.text or head.name)}"
        for name, head, is_own in zip(names, shown_heads, own, strict=True)
    ]
    likely = heads[clock].likely_in(TIME) or table.likely_time_unit(clock)
    given = [] if heads[clock].unit else [f"--time-unit {likely}"]
    given += _units_to_state(names, shown_heads)
    options = " ".join([*(f"--sensor {text}" for text in shown), *given])
    return f"birdstrike import {shlex.quote(str(path))} {options} --out {shlex.quote(f'{path.stem}_si.csv')}"


def _units_to_state(names: Sequence[str], heads: Sequence[Head]) -> list[str]:
    """Options of `birdstrike import` for what the heads of sensors do not say: a unit, or what a volt stands for."""
    bare = [name for name, head in zip(names, heads, strict=True) if head.unit is None and not head.foreign]
    if bare and len(bare) == len(heads):
        return ["--unit mm"]
    options = [f"--unit {name}=mm" for name in bare]
    for name, head in zip(names, heads, strict=True):
        if unit := head.likely_in(MEASURED):
            options.append(f"--unit {name}={unit}")
        elif head.foreign:
            per = f"({head.foreign})" if "/" in head.foreign else head.foreign
            options.append(f'--scale {name}="FACTOR mm/{per}"')
    return options
