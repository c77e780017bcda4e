"""Which column of other people's tables is the clock: by its unit, its name, or its even steps."""

from __future__ import annotations

import re
from itertools import pairwise

import numpy as np

from birdstrike.data.tables.loose_table import TIME, LooseTable
from birdstrike.data.units import si_unit

EVEN = 0.05
"""Share by which the steps of a clock may differ, for it may have few digits; those of a reading differ more."""
FEWEST_STEPS = 8
"""Numbers from which even steps show a clock."""
_TIME = re.compile(r"(time|zeit|temps|tiempo|t)(?![a-z])", re.IGNORECASE)
"""Beginning of the name of a clock."""


def first_filled(table: LooseTable) -> int:
    """The first column that holds a number, 0 without any: text, such as a file's name, has been taken out of it."""
    return next((i for i in range(table.width) if table.filled(i)), 0)


def counts_samples(table: LooseTable, index: int) -> bool:
    """Whether a column counts samples: whole numbers that increase, however they are written."""
    texts = [cells[index] for _, cells in table.rows]
    if not all(texts):
        return False
    numbers = [float(text) for text in texts]
    return all(number.is_integer() for number in numbers) and all(a < b for a, b in pairwise(numbers))


def first_clock(table: LooseTable) -> int:
    """The first column that holds a number, or, where that is no time, the only one that is by its unit or name."""
    first = first_filled(table)
    if not table.heads or is_time(table, first) or is_called_time(table, first) or runs_evenly(table, first):
        return first
    times = [i for i in range(table.width) if is_time(table, i)]
    named = times or [i for i in range(table.width) if is_called_time(table, i)]
    return named[0] if len(named) == 1 else first


def is_called_time(table: LooseTable, index: int) -> bool:
    """Whether a column's head calls it a time and gives it no unit of anything else: Time_w, Zeit 2, t1."""
    head = table.heads[index]
    in_time = not head.foreign or head.likely_in(TIME) != ""
    return head.unit is None and in_time and bool(_TIME.match(head.name))


def is_time(table: LooseTable, index: int = 0) -> bool:
    """Whether a column's head gives it a unit of time."""
    unit = table.heads[index].unit if table.heads else None
    return unit is not None and si_unit(unit) == "s"


def runs_evenly(table: LooseTable, index: int) -> bool:
    """Whether a column's numbers increase by even steps, as times do; whole numbers in steps of one are a counter."""
    texts = [cells[index] for _, cells in table.rows]
    given = [text for text in texts if text]
    if len(given) < FEWEST_STEPS or any(texts[len(given) :]):
        return False
    values = np.array([float(text) for text in given])
    step = float(values[-1] - values[0]) / (len(values) - 1)
    even = step > 0.0 and bool(np.abs(np.diff(values) / step - 1.0).max() < EVEN)
    return even and not (step == 1.0 and float(values[0]).is_integer())
