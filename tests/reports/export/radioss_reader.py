"""An independent reader of Radioss starter files, by the columns of the reference manual."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

import numpy as np


@dataclass
class Block:
    """One keyword: its header's parts after the name, its title, its lines without comments."""

    header: list[str]
    lines: list[str] = field(default_factory=list)

    @property
    def number(self) -> int:
        return int(self.header[-1])

    def cells(self, line: int, *widths: int) -> list[str]:
        text, found, at = self.lines[line], [], 0
        for width in widths:
            found.append(text[at : at + width].strip())
            at += width
        return found

    def floats(self, line: int, count: int = 5) -> list[float]:
        """Fields of 20 columns; empty ones are 0."""
        return [float(cell or 0.0) for cell in self.cells(line, *[20] * count)]

    def integers(self, first: int = 0) -> list[int]:
        return [
            int(n) for line in self.lines[first:] for n in re.findall(r".{10}", line.ljust(-(-len(line) // 10) * 10))
        ]


def read_deck(text: str) -> dict[str, list[Block]]:
    """Blocks by keyword without numbers; lines longer than 100 columns are an error."""
    blocks: dict[str, list[Block]] = {}
    current = None
    for line in text.splitlines():
        if line.startswith("#"):
            continue
        assert len(line) <= 100, line
        if line.startswith("/"):
            header = line[1:].split("/")
            name = "/".join(part for part in header if not part.isdigit())
            current = Block(header)
            blocks.setdefault(name, []).append(current)
        elif current is not None:
            current.lines.append(line)
    return blocks


def nodes_of(blocks: dict[str, list[Block]]) -> tuple[np.ndarray, np.ndarray]:
    lines = blocks["NODE"][0].lines
    numbers = np.array([int(line[:10]) for line in lines])
    places = np.array([[float(line[10 + 20 * k : 30 + 20 * k]) for k in range(3)] for line in lines])
    return numbers, places


def elements_of(blocks: dict[str, list[Block]], name: str) -> dict[int, np.ndarray]:
    """Part -> rows of numbers."""
    return {
        block.number: np.array([[int(line[k : k + 10]) for k in range(0, len(line), 10)] for line in block.lines])
        for block in blocks.get(name, [])
    }
