"""Meshes from Nastran's bulk data: GRID and the shells of three and four nodes, in every field format."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import takewhile
from pathlib import Path

from birdstrike.data.errors import UserError
from birdstrike.solver.target.files.text_mesh import Files, Shell, TextMesh, decimal, lines_of, no_shells, whole

NASTRAN = (".bdf", ".nas", ".fem")
"""Endings of the files that are read as bulk data."""
CORNERS = {"CQUAD4": 4, "CQUADR": 4, "CSHEAR": 4, "CTRIA3": 3, "CTRIAR": 3}
BEAMS = ("CBAR", "CBEAM", "CROD", "CONROD", "CTUBE", "CGAP", "CBEND")
CARDS = ("RBE", "RBAR", "CONM", "CMASS", "CELAS", "CBUSH", "CFAST", "CWELD", "CDAMP", "MPC")
"""How the cards of joints, springs and masses begin."""
OTHERS = ("CQUAD", "CTRI", "CTRAX", "CTETRA", "CPYRA", "CPENTA", "CHEXA")
"""How those of other elements begin."""
Card = list[str]
"""Name in capitals and fields, nothing where they are blank."""


def read_nastran(path: str) -> TextMesh:
    """Bulk data with all that it includes; raises UserError for what is no mesh of shells."""
    files = Files(Path(path))
    mesh, names, offset = TextMesh(files=files.found), dict[str, int](), 0
    for card in _cards(_bulk(_lines(files.first, files))):
        name, fields = card[0], [*card[1:], *[""] * 8]
        names[name] = names.get(name, 0) + 1
        line = " ".join(card)
        if name == "GRID":
            x, y, z = (decimal(_exponent(text), line, name) for text in fields[2:5])
            mesh.add_node(whole(fields[0], line, name), (x, y, z))
        elif name in CORNERS:
            corners = CORNERS[name]
            nodes = tuple(whole(text, line, name) for text in fields[2 : 2 + corners])
            part = whole(fields[1], line, name) if fields[1] else None
            mesh.shells.append(Shell(whole(fields[0], line, name), nodes, part))
            above = "" if name == "CSHEAR" else _exponent(fields[3 + corners])
            offset += decimal(above, line, name) != 0.0
    if any(name.startswith("=") for name in names):
        raise UserError("it repeats cards by =, which is not read; write them out")
    others = sorted(name for name in names if name.startswith(OTHERS) and name not in CORNERS)
    if others or not mesh.shells:
        raise UserError(no_shells(others))
    _left_out(names, offset, mesh)
    return mesh


def _left_out(names: dict[str, int], offset: int, mesh: TextMesh) -> None:
    """Note what changes the answer and is not read."""
    if beams := sum(names.get(name, 0) for name in BEAMS):
        mesh.held.append(f"{beams} beams, bars or springs")
    mesh.held += sorted(name for name in names if name.startswith(CARDS))
    if moved := sorted(name for name in names if name.startswith("CORD")):
        mesh.told.append(f"{', '.join(moved)} is not read: nodes are taken as written, in the basic system")
    if offset:
        mesh.told.append(f"ZOFFS of {offset} shells is not read: their mid-surface is taken through their nodes")


def _exponent(text: str) -> str:
    """A number whose exponent may stand without its letter, as in 1.5+2."""
    text = text.upper().replace("D", "E")
    return text if "E" in text else text[:1] + text[1:].replace("+", "E+").replace("-", "E-")


def _lines(path: Path, files: Files, depth: int = 0) -> Iterator[str]:
    """Lines of a file and of those that it includes, without comments and blank ones."""
    for line in lines_of(path):
        said = line.split("$")[0].rstrip()
        if said[:7].upper() == "INCLUDE":
            yield from _lines(files.included(said[7:].lstrip(" ="), path, depth + 1), files, depth + 1)
        elif said.strip():
            yield said


def _bulk(lines: Iterator[str]) -> Iterator[str]:
    """What stands between BEGIN BULK, where that is, and ENDDATA."""
    every = list(takewhile(lambda line: not line.lstrip().upper().startswith("ENDDATA"), lines))
    start = next((i + 1 for i, line in enumerate(every) if line.lstrip().upper().startswith("BEGIN")), 0)
    yield from every[start:]


def _cards(lines: Iterator[str]) -> Iterator[Card]:
    """Cards with what follows on their continuation lines, in small, large and free fields."""
    card: Card = []
    for line in lines:
        name, fields = _fields(line.expandtabs(8))
        if name == "" or name[0] in "+*":
            card += fields
            continue
        if card:
            yield card
        card = [name.rstrip("*"), *fields]
    if card:
        yield card


def _fields(line: str) -> tuple[str, list[str]]:
    """First field in capitals, with the star of large fields, and the fields of data."""
    if "," in line:
        name, *fields = (word.strip() for word in line.split(","))
        return name.upper(), (fields + [""] * 8)[: 4 if "*" in name else 8]
    name = line[:8].strip().upper()
    width = 16 if "*" in name else 8
    return name, [line[at : at + width].strip() for at in range(8, 72, width)]
