"""What meshio drops of a text file: numbers of its shells, Abaqus's sets of several blocks, and what is no shell."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

NUMBER = "element_number"
"""Array of a mesh's cells that holds them."""
NASTRAN = (".bdf", ".nas", ".fem", ".dat")


MOVED = ("INSTANCE", "SYSTEM", "NMAP")
"""Abaqus's keywords that move nodes."""
JOINED = (
    *("MASS", "ROTARY INERTIA", "MPC", "COUPLING", "KINEMATIC COUPLING", "DISTRIBUTING COUPLING", "RIGID BODY", "TIE"),
    *("CONNECTOR SECTION", "SPRING", "DASHPOT", "FASTENER", "EQUATION"),
)
"""Those that hold nodes together or load them with mass."""
CARDS = ("RBE", "RBAR", "CONM", "CMASS", "CELAS", "CBUSH", "CFAST", "CWELD", "CDAMP", "MPC")
"""How Nastran's cards of that kind begin."""


def unread(file: Any, path: str) -> Iterator[str]:
    """What a file has besides shells and sets that would change the answer, in words."""
    ending, counts = Path(path).suffix.lower(), dict[str, int]()
    if ending != ".msh":  # Gmsh's lines and points are groups
        for block in file.cells:
            if block.type in ("line", "vertex"):
                word = "beams, bars or springs" if block.type == "line" else "point elements"
                counts[word] = counts.get(word, 0) + len(block.data)
    held = [f"{count} {word}" for word, count in counts.items()]
    if ending == ".inp":
        sections = list(_sections(path))
        held += [f"*{word}" for word in JOINED if any(keyword == word for keyword, _, _ in sections)]
        if moved := [f"*{word}" for word in MOVED if any(keyword == word and data for keyword, _, data in sections)]:
            yield f"{', '.join(moved)} is not read: what it moves or turns stays where its nodes are written"
    if ending in NASTRAN:
        cards = {line[:8].split(",")[0].strip().rstrip("*").upper() for line in _lines(path)}
        held += sorted(card for card in cards if card.startswith(CARDS))
        if moved := sorted(card for card in cards if card.startswith("CORD")):
            yield f"{', '.join(moved)} is not read: nodes are taken as written, in the basic system"
    if held:
        yield (
            f"{', '.join(held)} left out: their stiffness, mass and joints are not in the model; model what matters "
            "with shells, target.ties or target.rivets"
        )


def number_shells(file: Any, path: str) -> None:
    """Add the numbers of the file's elements to its cells, where they can be told.

    Of Abaqus also the sets of elements that are named by several blocks, of which meshio keeps the last block alone;
    the blocks' own sets come first, so that a set made of them besides is none of the parts.
    """
    ending = Path(path).suffix.lower()
    sizes = [len(block.data) for block in file.cells]
    if ending == ".inp":
        blocks = _abaqus(path)
        if [len(numbers) for _, numbers in blocks] != sizes:
            return  # elements of included files, or of several lines each
        file.cell_data[NUMBER] = [np.array(numbers, np.int64) for _, numbers in blocks]
        own_sets = {
            name: [np.arange(len(numbers) if own == name else 0, dtype=np.int64) for own, numbers in blocks]
            for name in dict.fromkeys(name for name, _ in blocks if name)
        }
        file.cell_sets = own_sets | {name: own for name, own in file.cell_sets.items() if name not in own_sets}
    elif ending in NASTRAN:
        numbers = _nastran(path)
        if len(numbers) == sum(sizes):
            ends = np.cumsum(sizes)[:-1]
            file.cell_data[NUMBER] = [np.array(part, np.int64) for part in np.split(np.array(numbers), ends)]


def readable_abaqus(path: str) -> str:
    """An Abaqus file's text with what Abaqus allows and meshio does not read written out.

    Kinds of elements in capitals; the increment of a generated set, 1 where it is left out.
    """
    found, generated = list[str](), False
    for line in _lines(path):
        if line.startswith("*"):
            words = [word.strip().upper() for word in line[1:].split(",")]
            generated = words[0] in ("NSET", "ELSET") and "GENERATE" in words
            if words[0] == "ELEMENT":
                line = re.sub(r"(?i)(\btype\s*=\s*)(\w+)", lambda found: found[1] + found[2].upper(), line)
        elif generated and line.rstrip(", ").count(",") == 1:
            line = f"{line.rstrip(', ')}, 1"
        found.append(line)
    return "\n".join(found) + "\n"


def _lines(path: str) -> list[str]:
    return Path(path).read_text(encoding="utf-8", errors="replace").splitlines()


def _sections(path: str) -> Iterator[tuple[str, dict[str, str], list[str]]]:
    """Keyword, options and lines of data of each of an Abaqus file's sections; names in capitals."""
    keyword, options, data = "", dict[str, str](), list[str]()
    for line in _lines(path):
        if line.startswith("**") or not line.strip():
            continue
        if line.startswith("*"):
            yield keyword, options, data
            keyword, *said = (word.strip() for word in line[1:].split(","))
            given = dict(word.split("=", 1) for word in said if "=" in word)
            options = {key.strip().upper(): value.strip() for key, value in given.items()}
            keyword, data = keyword.upper(), []
        else:
            data.append(line)
    yield keyword, options, data


def _abaqus(path: str) -> list[tuple[str, list[int]]]:
    """Set and numbers of every *ELEMENT block, in the file's order."""
    blocks = (one for one in _sections(path) if one[0] == "ELEMENT")
    return [(options.get("ELSET", ""), [int(line.split(",")[0]) for line in data]) for _, options, data in blocks]


def _nastran(path: str) -> list[int]:
    """Numbers of the elements, in the file's order."""
    numbers: list[int] = []
    for line in _lines(path):
        if line[:5].upper() in ("CQUAD", "CTRIA"):
            wide = line[:8].rstrip().endswith("*")
            numbers.append(int(line.split(",")[1] if "," in line else line[8 : 24 if wide else 16]))
    return numbers
