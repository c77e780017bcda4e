"""LS-DYNA's nodout: the history of one node from the ASCII file that the solver (or l2a) writes."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path

from birdstrike.data.errors import MeasuredError
from birdstrike.data.tables.loose_table import Head, LooseTable, number_text
from birdstrike.data.tables.text_file import text_lines

TITLE = "n o d a l   p r i n t   o u t"
_TIME = re.compile(r"\(\s*at time\s*(\S+)\s*\)")
NODE, NUMBER = 10, 12
"""Columns of a node's number and of each value: they may touch, so that blanks do not separate them."""


def is_nodout(path: str | Path) -> bool:
    """Whether a file is a nodout, by the title of its first blocks."""
    return any(TITLE in line for line in text_lines(Path(path))[:2000])


def read_nodout(path: str | Path, node: int | None = None) -> LooseTable:
    """Time and the components x-disp .. z-coor of one node, without units, which the file does not know.

    node: may be left out where the file holds one only. Raises MeasuredError with the line of what is wrong.
    """
    source, lines = Path(path), text_lines(Path(path))
    blocks = list(_blocks(source, lines))
    if not blocks:
        raise MeasuredError(f"{source} holds no block of translations of nodout (nodal point x-disp ...)")
    nodes = list(dict.fromkeys(number for _, _, rows in blocks for number, _, _ in rows))
    wanted = _wanted(source, nodes, node)
    names = blocks[0][1]
    found = tuple(
        (i, (time, *_values(source, i, line, len(names))))
        for time, _, rows in blocks
        for number, i, line in rows
        if number == wanted
    )
    notes = (f"nodout of LS-DYNA, node {wanted}", *(line.strip() for line in lines[:4] if line.strip()))
    return LooseTable(source, (Head("time"), *map(Head, names)), found, notes)


Block = tuple[str, list[str], list[tuple[int, int, str]]]
"""Time, the components' names, and (node, line number, line)."""


def _blocks(path: Path, lines: Sequence[str]) -> Iterator[Block]:
    """Blocks of translations in order; those of rotations, which follow them, are passed over."""
    time, i = "", 0
    while i < len(lines):
        line = lines[i]
        if TITLE in line:
            match = _TIME.search(line)
            if match is None:
                raise MeasuredError(f'{path}, line {i + 1}: no "( at time ... )" in the title of a block')
            time = number_text(match[1])
        elif "nodal point" in line and "-disp" in line:
            rows = list(_rows(lines, i + 1))
            yield time, line.split()[2:], rows
            i += len(rows)
        i += 1


def _rows(lines: Sequence[str], start: int) -> Iterator[tuple[int, int, str]]:
    """Rows that begin with a node's number, up to the first that does not."""
    for i, line in enumerate(lines[start:], start + 1):
        if not line[:NODE].strip().isdigit():
            return
        yield int(line[:NODE]), i, line


def _wanted(path: Path, nodes: list[int], node: int | None) -> int:
    if not nodes:
        raise MeasuredError(f"{path}: its block of displacements holds no node; a run that was cut short?")
    known = ", ".join(map(str, nodes[:20])) + (", ..." if len(nodes) > 20 else "")
    if node is None and len(nodes) > 1:
        raise MeasuredError(f"{path} holds {len(nodes)} nodes; choose one: --node {nodes[0]} (there are {known})")
    if node is not None and node not in nodes:
        raise MeasuredError(f"{path} has no node {node}; it has {known}")
    return nodes[0] if node is None else node


def _values(path: Path, number: int, line: str, count: int) -> Iterator[str]:
    """The row's values by their columns; raises MeasuredError for a row that is cut short."""
    for k in range(count):
        cell = line[NODE + NUMBER * k : NODE + NUMBER * (k + 1)].strip()
        if not re.fullmatch(r"[+-]?\d*\.\d+([EeDd][+-]?\d+|[+-]\d{3})?", cell):
            raise MeasuredError(f'{path}, line {number}: value {k + 1} is "{cell}"; a run that was cut short?')
        yield number_text(cell)
