"""What the readers of text formats share: nodes and shells by the file's numbers, and the mesh that is made of them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.errors import UserError
from birdstrike.data.paths import is_file

NUMBER = "element_number"
"""Array of a mesh's cells that holds the file's numbers of its elements."""
PROPERTY = "nastran:ref"
"""Array of a mesh's cells that holds the numbers of their properties, as meshio calls it."""
THICKNESSES = "thicknesses"
"""What a mesh's `info` calls those of its parts."""
DEEPEST = 20
"""Files that include each other, one in the other."""
LARGEST = 2**31 - 1
"""Number of a node, a shell, a part or a set, as far as the codes themselves count."""
Place = tuple[float, float, float]


class Shell(NamedTuple):
    """Number in the file, nodes (three or four), number of the property or part."""

    number: int
    nodes: tuple[int, ...]
    part: int | None = None


@dataclass
class TextMesh:
    """Nodes by number, shells in the file's order, sets of nodes (numbers) and of shells (places in `shells`).

    thicknesses: of parts by name, in the file's unit; held: what joins, loads or stiffens in the file and is not read,
    by name; told: other warnings, whole sentences; files: those that the file includes.
    """

    places: dict[int, Place] = field(default_factory=dict)
    shells: list[Shell] = field(default_factory=list)
    node_sets: dict[str, list[int]] = field(default_factory=dict)
    shell_sets: dict[str, list[int]] = field(default_factory=dict)
    thicknesses: dict[str, float] = field(default_factory=dict)
    held: list[str] = field(default_factory=list)
    told: list[str] = field(default_factory=list)
    files: list[Path] = field(default_factory=list)

    def add_node(self, number: int, place: Place) -> None:
        """Raises UserError for a number that stands for two places."""
        if self.places.setdefault(number, place) != place:
            raise UserError(
                f"node {number} is given twice, at different places: parts whose nodes have the same numbers cannot be "
                "told apart; renumber them"
            )

    def meshio(self) -> Any:
        """As meshio has it, quadrilaterals first; raises UserError for nodes that are not there."""
        import meshio  # late: only targets from files need it

        row = {number: i for i, number in enumerate(self.places)}
        lost = sorted({node for shell in self.shells for node in shell.nodes if node not in row})
        if lost:
            raise UserError(f"shells name {len(lost)} nodes that are not there, first {lost[0]}")
        blocks = [[i for i, shell in enumerate(self.shells) if len(shell.nodes) == corners] for corners in (4, 3)]
        blocks = [block for block in blocks if block]
        cells: list[Any] = []
        for block in blocks:
            nodes = np.array([[row[node] for node in self.shells[i].nodes] for i in block], np.int64)
            cells.append(("quad" if nodes.shape[1] == 4 else "triangle", nodes))
        data: dict[str, Any] = {NUMBER: [np.array([self.shells[i].number for i in block]) for block in blocks]}
        if any(shell.part is not None for shell in self.shells):
            data[PROPERTY] = [np.array([_part(self.shells[i]) for i in block], np.int64) for block in blocks]
        sets: Any = {name: _by_block(given, blocks, len(self.shells)) for name, given in self.shell_sets.items()}
        rows: Any = {name: np.array(_rows(name, given, row), np.int64) for name, given in self.node_sets.items()}
        points = np.array(list(self.places.values()), np.float64).reshape(-1, 3)
        known: Any = {THICKNESSES: self.thicknesses}
        return meshio.Mesh(points, cells, cell_data=data, point_sets=rows, cell_sets=sets, info=known)


def _by_block(members: list[int], blocks: list[list[int]], shells: int) -> list[NDArray[np.int64]]:
    """Of a set of shells the places in each block of cells."""
    inside = np.zeros(shells, np.bool_)
    inside[members] = True
    return [np.flatnonzero(inside[block]) for block in blocks]


def numbered_part(number: int) -> str:
    """Name of a part that has a number alone."""
    return f"part_{number}"


def _part(shell: Shell) -> int:
    if shell.part is None:
        raise UserError(f"shell {shell.number} has no number of a property, and others have; give it one")
    return shell.part


def _rows(name: str, nodes: list[int], row: dict[int, int]) -> list[int]:
    """Rows of the points of a set's nodes."""
    for node in nodes:
        if node not in row:
            raise UserError(f"the set of nodes {name} refers to {node}, which is not there")
    return [row[node] for node in nodes]


def no_shells(kinds: Iterable[str]) -> str:
    """What is wrong with a file that holds other elements."""
    found = ", ".join(kinds) or "no shells"
    return (
        f"it holds {found}; a target is of shells of first order: mesh it with quadrilaterals of four nodes and "
        "triangles of three"
    )


def lines_of(path: str | Path) -> list[str]:
    """Of a text file, in UTF-8 or that of western Windows, without the mark that some editors begin it with."""
    written = Path(path).read_bytes()
    try:
        return written.decode("utf-8-sig").splitlines()
    except UnicodeDecodeError:
        return written.decode("cp1252", errors="replace").splitlines()


@dataclass
class Files:
    """A text file and all that it includes; found: these, in the order in which they are read.

    folders: in which they may stand besides.
    """

    first: Path
    found: list[Path] = field(default_factory=list)
    folders: list[Path] = field(default_factory=list)

    def included(self, name: str, beside: Path, depth: int) -> Path:
        """The file that another one includes, beside that, beside the first or where we are.

        Raises UserError where it is not there, or includes itself.
        """
        name = name.strip().strip("'\"")
        if depth > DEEPEST:
            raise UserError(f"it includes {name}, and that at last itself; leave one of the lines out")
        for path in (beside.parent / name, self.first.parent / name, *(one / name for one in self.folders), Path(name)):
            if is_file(path):
                self.found.append(path)
                return path
        raise UserError(
            f"it includes {name}, which is not there; put it beside {beside.name}, or leave the line out where it "
            "brings no nodes, shells or sets"
        )


def whole(text: str, line: str, keyword: str) -> int:
    """A whole number; raises UserError with the line that it stands in."""
    try:
        number = int(text)
    except ValueError:
        raise UserError(f'{keyword}: "{text.strip()}" in the line "{line.strip()}" is no whole number') from None
    if abs(number) > LARGEST:
        raise UserError(f'{keyword}: "{text.strip()}" in the line "{line.strip()}" is beyond {LARGEST}; renumber it')
    return number


def decimal(text: str, line: str, keyword: str) -> float:
    """A number, its exponent behind E or D, 0 where nothing stands; raises UserError with the line it stands in."""
    try:
        return float(text.upper().replace("D", "E")) if text.strip() else 0.0
    except ValueError:
        raise UserError(f'{keyword}: "{text.strip()}" in the line "{line.strip()}" is no number') from None


def is_zero(text: str) -> bool:
    """Whether nothing or 0 stands there, and no word or parameter either."""
    try:
        return not text or float(text) == 0.0
    except ValueError:
        return False
