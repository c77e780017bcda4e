"""Meshes from Abaqus's input files: *NODE, *ELEMENT, *NSET and *ELSET, each in as many blocks as there are."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from birdstrike.data.errors import UserError
from birdstrike.solver.target.files.text_mesh import (
    Files,
    Shell,
    TextMesh,
    decimal,
    is_zero,
    lines_of,
    no_shells,
    whole,
)

MOVED = ("INSTANCE", "SYSTEM", "NMAP")
"""Keywords that move nodes."""
JOINED = (
    *("MASS", "ROTARY INERTIA", "MPC", "COUPLING", "KINEMATIC COUPLING", "DISTRIBUTING COUPLING", "RIGID BODY", "TIE"),
    *("CONNECTOR SECTION", "SPRING", "DASHPOT", "FASTENER", "EQUATION"),
)
"""Those that hold nodes together or load them with mass."""
LOOSE = ("MASS", "ROTARYI", "SPRING", "DASHPOT", "CONN")
"""How the kinds of elements of that sort begin."""
INCLUDE = "*INCLUDE"
WITH_INPUT = ("*NODE", "*ELEMENT")
"""Keywords whose data may stand in another file."""
FLAGS = ("GENERATE", "UNSORTED", "INTERNAL")
"""Options of a set that have no value."""
SHELL_SECTIONS = ("SHELL SECTION", "SHELL GENERAL SECTION")
VARIED = {"COMPOSITE", "NODAL THICKNESS", "SHELL THICKNESS"}
"""Options of sections that have not one thickness."""
GENERATED = ("ELGEN", "ELCOPY")
"""Keywords that make elements of others."""


class Section(NamedTuple):
    """Keyword in capitals, options by their names in capitals, lines of data."""

    keyword: str
    options: dict[str, str]
    data: list[str]


@dataclass
class Sets:
    """Sets that grow block by block; a name is the same in capitals and in small letters.

    spelt: each set's name as it first stands; members: in the order in which they came.
    """

    kind: str
    spelt: dict[str, str] = field(default_factory=dict)
    members: dict[str, dict[int, None]] = field(default_factory=dict)

    def add(self, name: str, members: Any) -> None:
        """To the set of this name, which is made where there is none."""
        self.spelt.setdefault(name.upper(), name)
        self.members.setdefault(name.upper(), {}).update(dict.fromkeys(members))

    def of(self, name: str, asked_by: str) -> list[int]:
        """Members of a set that stands before. Raises UserError."""
        if (key := self.key(name)) is not None:
            return list(self.members[key])
        raise UserError(f"*{self.kind} {asked_by} names {name}, which is neither a number nor a set that stands before")

    def key(self, name: str) -> str | None:
        """By which a set is kept, None where there is none of that name; `Part-1.edge` is `edge`."""
        keys = (name.upper(), name.upper().rpartition(".")[2])
        return next((key for key in keys if key in self.members), None)

    def named(self) -> dict[str, list[int]]:
        """Members by the sets' names."""
        return {self.spelt[key]: list(members) for key, members in self.members.items()}


def read_abaqus(path: str) -> TextMesh:
    """An input file with all that it includes; raises UserError for what is no mesh of shells."""
    files = Files(Path(path))
    sections = list(_sections(_lines(files.first, files)))
    mesh, elsets = TextMesh(files=files.found), Sets("ELSET")
    nsets = _nodes(sections, mesh)
    _elements(sections, mesh, elsets)
    numbered: dict[int, list[int]] = {}
    for i, shell in enumerate(mesh.shells):
        numbered.setdefault(shell.number, []).append(i)
    for section in sections:
        if section.keyword == "ELSET":
            numbers = _members(section, elsets, numbered)
            elsets.add(_name(section), numbers)
        elif section.keyword == "NSET" and "ELSET" in section.options:
            shells = elsets.of(section.options["ELSET"], _name(section))
            nsets.add(_name(section), [node for i in shells for node in mesh.shells[i].nodes])
        elif section.keyword == "NSET":
            nsets.add(_name(section), _members(section, nsets, None))
    mesh.node_sets, mesh.shell_sets = nsets.named(), _parts_first(elsets, sections, len(mesh.shells))
    mesh.thicknesses = {elsets.spelt[key]: value for key, value in _thicknesses(elsets, sections)}
    _left_out(sections, mesh)
    return mesh


def _thicknesses(elsets: Sets, sections: list[Section]) -> Iterator[tuple[str, float]]:
    """Thickness of the set of each section of one layer and one thickness, by the set's key."""
    for one in (one for one in sections if one.keyword == "SHELL SECTION" and one.data):
        key, first = elsets.key(one.options.get("ELSET", "")), next(iter(_words(one.data[0])), "")
        if key is not None and not VARIED & one.options.keys() and not is_zero(first):
            yield key, decimal(first, one.data[0], "*SHELL SECTION")


def _parts_first(elsets: Sets, sections: list[Section], shells: int) -> dict[str, list[int]]:
    """Sets of shells, first those that shell sections name, as far as these hold every shell: they are the parts.

    A part is made of the first set that holds a shell: of a set that others make up, these would be the parts.
    """
    asked = [one.options["ELSET"] for one in sections if one.keyword in SHELL_SECTIONS and "ELSET" in one.options]
    named = elsets.named()
    parts = {elsets.spelt[key] for one in asked if (key := elsets.key(one)) is not None}
    if len(set().union(*(named[name] for name in parts))) < shells:
        return named
    return dict(sorted(named.items(), key=lambda one: one[0] not in parts))


def _lines(path: Path, files: Files, depth: int = 0) -> Iterator[str]:
    """Lines of a file and of those that it includes, without comments, blank ones and blanks at their ends.

    The data of a keyword with INPUT stand in a file of their own.
    """
    for line in map(str.strip, lines_of(path)):
        if line.startswith("**") or not line:
            continue
        keyword, _, said = line.partition(",")
        name = _options(said).get("INPUT") if line.startswith("*") else None
        if name is None or keyword.strip().upper() != INCLUDE:
            yield line
        if name is not None and keyword.strip().upper() in (INCLUDE, *WITH_INPUT):
            yield from _lines(files.included(name, path, depth + 1), files, depth + 1)


def _sections(lines: Iterator[str]) -> Iterator[Section]:
    """A file's sections. Options may go on in the line behind a comma."""
    section, goes_on = Section("", {}, []), False
    for line in lines:
        if line.startswith("*"):
            yield section
            keyword, _, said = line[1:].partition(",")
            section = Section(keyword.strip().upper(), _options(said), [])
        elif goes_on and ("=" in line or line.upper() in FLAGS):
            section.options.update(_options(line))
        else:
            section.data.append(line)
            continue
        goes_on = line.rstrip().endswith(",")
    yield section


def _options(said: str) -> dict[str, str]:
    """Of a keyword, by their names in capitals; those without a value have none."""
    pairs = (word.partition("=") for word in _words(said))
    return {key.strip().upper(): value.strip() for key, _, value in pairs}


def _words(said: str) -> list[str]:
    """What stands between commas; a name in quotation marks, without these, may hold some."""
    found = (word.replace('"', "").strip() for word in re.findall(r'(?:[^,"]|"[^"]*"?)+', said))
    return [word for word in found if word]


def _generates(section: Section) -> bool:
    """Whether a set is given by ranges: GENERATE, which need not be spelt out."""
    return any("GENERATE".startswith(key) for key in section.options)


def _name(section: Section) -> str:
    """Of a set."""
    if not section.options.get(section.keyword):
        raise UserError(f"a *{section.keyword} has no name; write *{section.keyword}, {section.keyword}=name")
    return section.options[section.keyword]


def _nodes(sections: list[Section], mesh: TextMesh) -> Sets:
    """Fill in the nodes; the sets that *NODE names."""
    nsets, coordinates = Sets("NSET"), 0
    for section in (one for one in sections if one.keyword == "NODE"):
        own: list[int] = []
        for line in section.data:
            number, *place = line.rstrip(", \t").split(",")[:4]  # a normal may follow
            coordinates = coordinates or len(place)
            if not place or len(place) != coordinates:
                raise UserError(
                    f'*NODE: the line "{line.strip()}" has {len(place)} coordinates, those before have {coordinates}; '
                    "is the file cut short?"
                )
            own.append(whole(number, line, "*NODE"))
            x, y, z = [*(decimal(text, line, "*NODE") for text in place), 0.0, 0.0][:3]
            mesh.add_node(own[-1], (x, y, z))
        if section.options.get("NSET"):
            nsets.add(section.options["NSET"], own)
    if not mesh.places:
        raise UserError("it holds no *NODE")
    return nsets


def _elements(sections: list[Section], mesh: TextMesh, elsets: Sets) -> None:
    """Fill in the shells and the sets that *ELEMENT names, and what else the elements are."""
    from meshio._common import num_nodes_per_cell  # late: only targets from files need it
    from meshio.abaqus._abaqus import abaqus_to_meshio_type

    beams, others = 0, set[str]()
    for section in (one for one in sections if one.keyword == "ELEMENT"):
        kind = section.options.get("TYPE", "").upper()
        start = len(mesh.shells)
        if kind.startswith(LOOSE):
            mesh.held.append(f"*ELEMENT, TYPE={kind}")
        elif kind not in abaqus_to_meshio_type:
            raise UserError(
                f"Element type not available: {kind or 'none given'}; a target is of shells of first order: mesh it "
                "with S4 and S3, or leave these elements out"
            )
        else:
            form = abaqus_to_meshio_type[kind]
            rows = _rows(section, num_nodes_per_cell.get(form, 4))
            if form in ("quad", "triangle"):
                mesh.shells += [Shell(number, tuple(nodes)) for number, *nodes in rows]
            elif form == "line":
                beams += len(rows)
            elif rows:
                others.add(form)
        if section.options.get("ELSET"):
            elsets.add(section.options["ELSET"], range(start, len(mesh.shells)))
    if others or not mesh.shells:
        raise UserError(no_shells(sorted(others)))
    if beams:
        mesh.held.insert(0, f"{beams} beams, bars or springs")


def _rows(section: Section, nodes: int) -> list[list[int]]:
    """Number and nodes of every element of a block; one may go on over several lines."""
    rows: list[list[int]] = []
    for line in section.data:
        numbers = [whole(text, line, "*ELEMENT") for text in line.split(",") if text.strip()]
        if rows and len(rows[-1]) < nodes + 1:
            rows[-1] += numbers
        elif numbers:
            rows.append(numbers)
        if rows and len(rows[-1]) > nodes + 1:
            raise UserError(_miscounted(section, rows[-1], nodes))
    if rows and len(rows[-1]) < nodes + 1:
        raise UserError(_miscounted(section, rows[-1], nodes))
    return rows


def _miscounted(section: Section, row: list[int], nodes: int) -> str:
    return (
        f"*ELEMENT, TYPE={section.options['TYPE']}: element {row[0]} has {len(row) - 1} nodes, not {nodes}; is its "
        "line, or the one before, or the file cut short?"
    )


def _members(section: Section, sets: Sets, numbered: dict[int, list[int]] | None) -> list[int]:
    """What a set's block names: numbers, other sets, or ranges; of elements their places, those that are shells."""
    found: list[int] = []
    for line in section.data:
        words = _words(line)
        if _generates(section):
            found += _placed(_range(words, line, section), numbered)
            continue
        for word in words:
            last = word.rpartition(".")[2]  # of Instance-1.7
            if last.isdigit() and word.upper() not in sets.members:
                found += _placed([int(last)], numbered)
            else:
                found += sets.of(word, _name(section))
    return found


def _placed(numbers: list[int], numbered: dict[int, list[int]] | None) -> list[int]:
    return numbers if numbered is None else [i for number in numbers for i in numbered.get(number, ())]


def _range(words: list[str], line: str, section: Section) -> list[int]:
    """First, last and increment, 1 where it is left out."""
    numbers = [whole(word, line, f"*{section.keyword}") for word in words]
    if len(numbers) not in (2, 3) or numbers[2:] == [0]:
        raise UserError(f'*{section.keyword} {_name(section)}: "{line.strip()}" is no first, last and increment')
    step = numbers[2] if len(numbers) == 3 else 1
    return list(range(numbers[0], numbers[1] + (1 if step > 0 else -1), step))


def _alone(line: str) -> bool:
    """Whether a line of data begins with a node's number, as 7 or Part-1.7."""
    return line.partition(",")[0].rpartition(".")[2].strip().isdigit()


def _left_out(sections: list[Section], mesh: TextMesh) -> None:
    """Note what changes the answer and is not read; raises UserError for shells that would be missing."""
    keywords = {section.keyword for section in sections}
    for word in GENERATED:
        if word in keywords:
            raise UserError(f"it makes elements by *{word}, which is not read; write them out")
    placed = Counter(one.options.get("PART", "").upper() for one in sections if one.keyword == "INSTANCE")
    for part, count in placed.items():
        if count > 1:
            raise UserError(f"{count} *INSTANCE place the part {part}, which is not read; write each out as a part")
    mesh.held += [f"*{word}" for word in JOINED if word in keywords]
    if any(one.keyword in SHELL_SECTIONS and not is_zero(one.options.get("OFFSET", "")) for one in sections):
        mesh.told.append("OFFSET of *SHELL SECTION is not read: shells are taken to lie in their nodes")
    if any(one.keyword == "BOUNDARY" and any(map(_alone, one.data)) for one in sections):
        mesh.told.append(
            "*BOUNDARY holds single nodes, which is not read: no set is made of them; write them as an *NSET"
        )
    moved = [f"*{word}" for word in MOVED if any(one.keyword == word and one.data for one in sections)]
    if any(one.options.get("SYSTEM", "R").upper() != "R" for one in sections if one.keyword == "NODE"):
        moved.append("SYSTEM of *NODE")
    if moved:
        mesh.told.append(f"{', '.join(moved)} is not read: what it moves or turns stays where its nodes are written")
