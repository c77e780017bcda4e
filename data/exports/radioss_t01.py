"""Radioss' binary time history (`NAMET01`): records of Fortran, big-endian, header first, then one set an instant.

The layout is that which OpenRadioss' th_to_csv reads. Columns are named as in its CSV: group, number, name, variable.
Names of the variables are read from `NAMET01_TITLES` (of /TH/TITLE); without it, those of the groups that
`birdstrike export --deck` writes are known, others are called var and their code. Forces of contacts and supports stand
in the file as impulses; their rates are taken, as th_to_csv does.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from birdstrike.data.errors import MeasuredError
from birdstrike.data.exports.columns import NamedColumn, table_of
from birdstrike.data.histories import Array
from birdstrike.data.tables.loose_table import LooseTable

GLOBAL = (
    *("INTERNAL ENERGY", "KINETIC ENERGY", "X-MOMENTUM", "Y-MOMENTUM", "Z-MOMENTUM", "MASS", "TIME STEP"),
    *("ROTATION ENERGY", "EXTERNAL WORK", "SPRING ENERGY", "CONTACT ENERGY", "HOURGLASS ENERGY"),
    *("ELASTIC CONTACT ENERGY", "FRICTIONAL CONTACT ENERGY", "DAMPING CONTACT ENERGY"),
)
PART = {1: "IE", 2: "KE", 3: "XMOM", 4: "YMOM", 5: "ZMOM", 6: "MASS", 7: "HE"}
KNOWN_GROUPS = {
    "contact of the bird": ("FNX", "FNY", "FNZ", "FTX", "FTY", "FTZ"),
    "displacement sensors": ("DX", "DY", "DZ"),
    "reactions": ("REACX", "REACY", "REACZ"),
    "DATABASE_HISTORY_NODE": ("DX", "DY", "DZ"),
    "TH-INTER": ("FNX", "FNY", "FNZ", "FTX", "FTY", "FTZ"),
}
"""Titles of the groups of `birdstrike export --deck`, and of those that OpenRadioss makes of an LS-DYNA deck: their

variables in order, of the latter the first ones.
"""
IMPULSES = frozenset("FNX FNY FNZ FTX FTY FTZ REACX REACY REACZ REACXX REACYY REACZZ".split())  # noqa: SIM905
OLD = 3050
"""Version of the file up to which it has no factors of units."""


@dataclass(frozen=True)
class _Group:
    title: str
    elements: tuple[tuple[int, str], ...]
    variables: tuple[int, ...]

    @property
    def size(self) -> int:
        return len(self.elements) * len(self.variables)


def read(path: Path, table: str) -> LooseTable:  # noqa: ARG001 (the file holds one table)
    """The curves as columns, without units, which the file does not know."""
    return table_of(path, columns_of(path), [f"SIMULATED: time history of Radioss, {path.name}"])


def columns_of(path: Path) -> list[NamedColumn]:
    """All curves, the clock first; raises MeasuredError for a file that is cut short or of another kind."""
    try:
        return _columns(path, _records(path))
    except (StopIteration, struct.error, ValueError, IndexError) as error:
        raise MeasuredError(
            f"{path} is no time history of Radioss, or was cut short: read it with th_to_csv, and import its CSV"
        ) from error


def _records(path: Path) -> Iterator[bytes]:
    """Contents of the file's records: each stands between two copies of its length."""
    content, at = path.read_bytes(), 0
    while at + 8 <= len(content):
        (length,) = struct.unpack_from(">i", content, at)
        end = at + 4 + length
        if length < 0 or end + 4 > len(content):
            return
        if struct.unpack_from(">i", content, end) != (length,):
            raise ValueError(f"record at byte {at} has two lengths")
        yield content[at + 4 : end]
        at = end + 4


def _integers(record: bytes, count: int | None = None) -> list[int]:
    found = len(record) // 4 if count is None else count
    return list(struct.unpack_from(f">{found}i", record))


def _columns(path: Path, records: Iterator[bytes]) -> list[NamedColumn]:
    version = _integers(next(records), 1)[0]
    next(records)
    for _ in range(3 if version > OLD else 0):
        next(records)
    parts, materials, properties, subsets, groups, general = _integers(next(records), 6)
    if general:
        next(records)
    names = [f"{i + 1}" for i in range(general)] if general > len(GLOBAL) else list(GLOBAL[:general])
    of_parts = [name for _ in range(parts) for name in _part(records)]
    for _ in range(materials + properties):
        next(records)
    of_subsets = [name for _ in range(subsets) for name in _subset(records)]
    found = [_group(records) for _ in range(groups)]
    names += [*of_parts, *of_subsets, *_group_names(path, found)]
    sizes = [general, len(of_parts), len(of_subsets), *(group.size for group in found)]
    time, values = _instants(records, [size for size in sizes if size])
    columns = [NamedColumn("time", time)]
    for i, name in enumerate(names):
        curve = values[:, i]
        impulse = name.rpartition(" ")[2] in IMPULSES and len(time) > 1
        columns.append(NamedColumn(name, np.gradient(curve, time) if impulse else curve))
    return columns


def _part(records: Iterator[bytes]) -> list[str]:
    record = next(records)
    number, count = _integers(record, 1)[0], _integers(record[-4:])[0]
    title = _text(record[4:-16])
    variables = _integers(next(records)) if count else []
    return [f"{title} {number} {PART.get(code, f'var{code}')}" for code in variables]


def _subset(records: Iterator[bytes]) -> list[str]:
    record = next(records)
    number, _, subsets, parts, count = _integers(record, 5)
    for size in (subsets, parts):
        if size:
            next(records)
    variables = _integers(next(records)) if count else []
    return [f"{_text(record[20:])} {number} {PART.get(code, f'var{code}')}" for code in variables]


def _group(records: Iterator[bytes]) -> _Group:
    record = next(records)
    _, _, _, elements, count = _integers(record, 5)
    members = []
    for _ in range(elements):
        one = next(records)
        members.append((_integers(one, 1)[0], _text(one[4:])))
    variables = tuple(_integers(next(records))) if count else ()
    return _Group(_text(record[20:]), tuple(members), variables)


def _text(content: bytes) -> str:
    return " ".join(content.replace(b"\0", b" ").decode("latin-1").split())


def _group_names(path: Path, groups: list[_Group]) -> list[str]:
    """Names of the groups' columns; the variables' from the file of titles, or as far as they are known."""
    titles = path.with_name(f"{path.name}_TITLES")
    total = sum(group.size for group in groups)
    given: list[str] = []
    if titles.is_file():
        given = [line[11:21].strip() for line in titles.read_text(encoding="latin-1").splitlines() if line.strip()]
    known: Mapping[str, tuple[str, ...]] = KNOWN_GROUPS
    names = []
    for group in groups:
        usual = known.get(group.title, ())
        own = (*usual, *(f"var{code}" for code in group.variables[len(usual) :]))
        if len(usual) > len(group.variables):
            own = tuple(f"var{code}" for code in group.variables)
        names += [" ".join(f"{group.title} {n} {name} {v}".split()) for n, name in group.elements for v in own]
    if len(given) != total:
        return names
    return [f"{name.rpartition(' ')[0]} {variable}" for name, variable in zip(names, given, strict=True)]


def _instants(records: Iterator[bytes], sizes: list[int]) -> tuple[Array, Array]:
    """Times (n,) and all values (n, m); an instant that is not whole, of a run that goes on, is left out."""
    times, rows = [], []
    while True:
        blocks = [record for _, record in zip(range(1 + len(sizes)), records, strict=False)]
        if len(blocks) < 1 + len(sizes):
            break
        numbers = [np.frombuffer(block, ">f4").astype(float) for block in blocks]
        if [len(one) for one in numbers] != [1, *sizes]:
            raise ValueError("an instant has another number of values than the header says")
        times.append(numbers[0][0])
        rows.append(np.concatenate(numbers[1:]) if sizes else np.empty(0))
    if len(times) < 2:
        raise ValueError("fewer than two instants")
    return np.array(times), np.array(rows)
