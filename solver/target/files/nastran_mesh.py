"""Meshes from Nastran's bulk data: GRID, shells of three and four nodes, and the nodes of SPC, SPC1 and SPCADD."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import takewhile
from pathlib import Path

from birdstrike.data.errors import UserError
from birdstrike.solver.target.files.text_mesh import (
    Files,
    Shell,
    TextMesh,
    decimal,
    lines_of,
    no_shells,
    numbered_part,
    whole,
)

NASTRAN = (".bdf", ".nas", ".fem")
"""Endings of the files that are read as bulk data."""
CORNERS = {"CQUAD4": 4, "CQUADR": 4, "CSHEAR": 4, "CTRIA3": 3, "CTRIAR": 3}
BEAMS = ("CBAR", "CBEAM", "CROD", "CONROD", "CTUBE", "CGAP", "CBEND")
CARDS = ("RBE", "RBAR", "CONM", "CMASS", "CELAS", "CBUSH", "CFAST", "CWELD", "CDAMP", "MPC")
"""How the cards of joints, springs and masses begin."""
OTHERS = ("CQUAD", "CTRI", "CTRAX", "CTETRA", "CPYRA", "CPENTA", "CHEXA")
"""How those of other elements begin."""
HOLDING = ("SPC", "SPC1", "SPCADD")
UNREAD = ("SPC2", "SPCAX", "SPCD", "SPCR", "GRDSET", "SET", "SET1", "SET3")
"""Other cards that hold, move or name nodes."""
PERMANENT = 0
"""In place of the number of an SPC: what GRID holds by itself."""
FREEDOMS = ("123", "123456")
"""Those that a support holds."""
LONGEST = 256
"""Letters that the name of an included file may have, which goes on in the next line up to its quotation mark."""
Card = list[str]
"""Name in capitals and fields, nothing where they are blank."""
Holds = dict[int, set[str]]
"""Of each node the freedoms that are held."""


def read_nastran(path: str) -> TextMesh:
    """Bulk data with all that it includes; raises UserError for what is no mesh of shells."""
    files = Files(Path(path))
    mesh, names, offset, thick = TextMesh(files=files.found), dict[str, int](), 0, 0
    holding: list[Card] = []
    for card in _cards(_bulk(_lines(files.first, files))):
        name, fields = card[0], [*card[1:], *[""] * 8]
        names[name] = names.get(name, 0) + 1
        line = " ".join(card)
        if name == "GRID":
            x, y, z = (decimal(_exponent(text), line, name) for text in fields[2:5])
            mesh.add_node(whole(fields[0], line, name), (x, y, z))
            holding += [["SPC1", str(PERMANENT), fields[6], fields[0]]] if fields[6] else []
        elif name == "PSHELL" and fields[2]:
            mesh.thicknesses[numbered_part(whole(fields[0], line, name))] = decimal(_exponent(fields[2]), line, name)
        elif name in HOLDING:
            holding.append([name, *fields])
        elif name in CORNERS:
            corners = CORNERS[name]
            nodes = tuple(whole(text, line, name) for text in fields[2 : 2 + corners])
            part = whole(fields[1], line, name) if fields[1] else None
            mesh.shells.append(Shell(whole(fields[0], line, name), nodes, part))
            above = "" if name == "CSHEAR" else _exponent(fields[3 + corners])
            offset += decimal(above, line, name) != 0.0
            thick += name != "CSHEAR" and any(fields[10:14])
    if any(name.startswith("=") for name in names):
        raise UserError("it repeats cards by =, which is not read; write them out")
    others = sorted(name for name in names if name.startswith(OTHERS) and name not in CORNERS)
    if others or not mesh.shells:
        raise UserError(no_shells(others))
    _node_sets(holding, mesh)
    _left_out(names, offset, mesh)
    if thick:
        mesh.told.append(f"T1 .. T4 of {thick} shells are not read: thicknesses are those of target.parts")
    return mesh


def _node_sets(cards: list[Card], mesh: TextMesh) -> None:
    """Fill in the nodes that one number holds alike: spc_<number>_<freedoms>, and grid_<freedoms> of GRID itself."""
    held, sums = dict[int, Holds](), dict[int, Holds]()
    for card in cards:
        if card[0] != "SPCADD":
            _add(held.setdefault(whole(card[1], " ".join(card), card[0]), {}), _held(card, mesh))
    for name, number, *members in (card for card in cards if card[0] == "SPCADD"):
        own = sums.setdefault(whole(number, number, name), {})
        for one in (whole(text, number, name) for text in members if text):
            if one not in held:
                raise UserError(f"SPCADD {number} adds {one}, which no SPC or SPC1 is; leave it out, or list its nodes")
            _add(own, held[one].items())
    for number, nodes in (held | sums).items():
        _name_sets("grid" if number == PERMANENT else f"spc_{number}", nodes, mesh)


def _add(holds: Holds, more: Iterable[tuple[int, set[str]]]) -> None:
    for node, freedoms in more:
        holds.setdefault(node, set()).update(freedoms)


def _name_sets(called: str, holds: Holds, mesh: TextMesh) -> None:
    """Sets of the nodes that are held alike; those that no support holds so are told instead."""
    alike: dict[str, list[int]] = {}
    for node, freedoms in holds.items():
        alike.setdefault("".join(sorted(freedoms)), []).append(node)
    for freedoms, nodes in alike.items():
        if freedoms in FREEDOMS:
            mesh.node_sets[f"{called}_{freedoms}"] = nodes
        elif freedoms:
            mesh.told.append(
                f"{called}_{freedoms} is not read: it holds the freedoms {freedoms} of {len(nodes)} nodes, and a "
                f"support those of {' or '.join(FREEDOMS)}"
            )


def _held(card: Card, mesh: TextMesh) -> Iterator[tuple[int, set[str]]]:
    """Nodes of an SPC or SPC1, each with its freedoms."""
    name, line = card[0], " ".join(card)
    if name == "SPC1":
        for node in _listed(card[3:], line, mesh):
            yield node, _freedoms(card[2], line)
        return
    for node, freedoms, way in (card[2:5], card[5:8]):
        if node:
            yield whole(node, line, name), _freedoms(freedoms, line)
        if decimal(_exponent(way), line, name):
            mesh.told.append(f"SPC {card[1]} moves node {node}, which is not read: what holds it is at rest")


def _listed(words: list[str], line: str, mesh: TextMesh) -> list[int]:
    """Nodes of an SPC1: one by one, and all from one THRU another."""
    words = [word.upper() for word in words if word]
    found: list[int] = []
    while words:
        if words[1:2] != ["THRU"]:
            found.append(_node(words.pop(0), line))
            continue
        first, last = _node(words[0], line), _node("".join(words[2:3]), line)
        found += [node for node in mesh.places if first <= node <= last]
        words = words[3:]
    return found


def _node(word: str, line: str) -> int:
    """A node's number; raises UserError for what a list of nodes may not hold, such as BY and EXCEPT."""
    if not word.isdigit():
        raise UserError(
            f'SPC1: "{word}" in the line "{line}" is not read; write its nodes one by one, or as first THRU last'
        )
    return whole(word, line, "SPC1")


def _freedoms(text: str, line: str) -> set[str]:
    """Freedoms as Nastran counts them, 1 to 6; 0 stands for none."""
    if not set(text) <= set("0123456"):
        raise UserError(f'"{text}" in the line "{line}" names no freedoms of 1 to 6')
    return set(text) - {"0"}


def _left_out(names: dict[str, int], offset: int, mesh: TextMesh) -> None:
    """Note what changes the answer and is not read."""
    if beams := sum(names.get(name, 0) for name in BEAMS):
        mesh.held.append(f"{beams} beams, bars or springs")
    mesh.held += sorted(name for name in names if name.startswith(CARDS))
    if moved := sorted(name for name in names if name.startswith("CORD")):
        mesh.told.append(f"{', '.join(moved)} is not read: nodes are taken as written, in the basic system")
    if loose := sorted(name for name in names if name in UNREAD):
        mesh.told.append(f"{', '.join(loose)} is not read: no set is made of what it holds; write its nodes as an SPC1")
    if offset:
        mesh.told.append(f"ZOFFS of {offset} shells is not read: their mid-surface is taken through their nodes")


def _exponent(text: str) -> str:
    """A number whose exponent may stand without its letter, as in 1.5+2."""
    text = text.upper().replace("D", "E")
    return text if "E" in text else text[:1] + text[1:].replace("+", "E+").replace("-", "E-")


def _lines(path: Path, files: Files, depth: int = 0) -> Iterator[str]:
    """Lines of a file and of those that it includes, without comments and blank ones.

    ENDDATA of an included file ends that file alone.
    """
    lines = iter(lines_of(path))
    for line in lines:
        said = line.split("$")[0].rstrip()
        if said[:7].upper() == "INCLUDE":
            while said.count("'") == 1 and len(said) < LONGEST and (more := next(lines, None)) is not None:
                said += more.split("$")[0].strip()
            yield from _lines(files.included(said[7:].lstrip(" ="), path, depth + 1), files, depth + 1)
        elif depth and said.lstrip().upper().startswith("ENDDATA"):
            return
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
        most = 4 if "*" in name else 8
        if any(fields[most + 1 :]) or (fields[most : most + 1] and fields[most].isdigit()):
            raise UserError(
                f'the line "{line.strip()}" has more than {most} fields behind its name, of which a card has no more '
                "on a line; write the others on a continuation line"
            )
        return name.upper(), (fields + [""] * 8)[:most]
    name = line[:8].strip().upper()
    width = 16 if "*" in name else 8
    return name, [line[at : at + width].strip() for at in range(8, 72, width)]
