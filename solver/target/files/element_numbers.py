"""The numbers that a text file gives its shells, which meshio drops; and Abaqus's sets that several blocks share."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

NUMBER = "element_number"
"""Array of a mesh's cells that holds them."""
NASTRAN = (".bdf", ".nas", ".fem", ".dat")


def number_shells(file: Any, path: str) -> None:
    """Add the numbers of the file's elements to its cells, where they can be told.

    Of Abaqus also the sets of elements that are named by several blocks, of which meshio keeps the last block alone.
    """
    ending = Path(path).suffix.lower()
    sizes = [len(block.data) for block in file.cells]
    if ending == ".inp":
        blocks = _abaqus(path)
        if [len(numbers) for _, numbers in blocks] != sizes:
            return  # elements of included files, or of several lines each
        file.cell_data[NUMBER] = [np.array(numbers, np.int64) for _, numbers in blocks]
        for name in {name for name, _ in blocks if name}:
            file.cell_sets[name] = [
                np.arange(len(numbers) if own == name else 0, dtype=np.int64) for own, numbers in blocks
            ]
    elif ending in NASTRAN:
        numbers = _nastran(path)
        if len(numbers) == sum(sizes):
            ends = np.cumsum(sizes)[:-1]
            file.cell_data[NUMBER] = [np.array(part, np.int64) for part in np.split(np.array(numbers), ends)]


def _abaqus(path: str) -> list[tuple[str, list[int]]]:
    """Set and numbers of every *ELEMENT block, in the file's order."""
    blocks: list[tuple[str, list[int]]] = []
    inside = False
    for line in Path(path).read_text(encoding="utf-8", errors="replace").splitlines():
        if line.startswith("**") or not line.strip():
            continue
        if line.startswith("*"):
            keyword, *said = (word.strip() for word in line[1:].split(","))
            inside = keyword.upper() == "ELEMENT"
            if inside:
                given = dict(word.split("=", 1) for word in said if "=" in word)
                named = {key.strip().upper(): value.strip() for key, value in given.items()}
                blocks.append((named.get("ELSET", ""), []))
        elif inside:
            blocks[-1][1].append(int(line.split(",")[0]))
    return blocks


def _nastran(path: str) -> list[int]:
    """Numbers of the elements, in the file's order."""
    numbers: list[int] = []
    for line in Path(path).read_text(encoding="utf-8", errors="replace").splitlines():
        if line[:5].upper() in ("CQUAD", "CTRIA"):
            wide = line[:8].rstrip().endswith("*")
            numbers.append(int(line.split(",")[1] if "," in line else line[8 : 24 if wide else 16]))
    return numbers
