"""Meshes from LS-DYNA's keyword files, read through ansys-dyna-core: nodes, shells by part, sets of nodes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.errors import UserError
from birdstrike.solver.target.files.text_meshes import NUMBER

ENDINGS = (".k", ".key", ".dyn")
"""Of the files that are read as keyword files."""
CORNERS = ["n1", "n2", "n3", "n4"]


def read_keywords(path: str) -> Any:
    """A keyword file as meshio's mesh: *NODE, *ELEMENT_SHELL, parts by their headings, *SET_NODE_LIST by title.

    A part or a set without a name is part_<number> or set_<number>. Raises UserError without ansys-dyna-core, and for
    a file that holds no nodes.
    """
    import meshio  # late: only targets from files need it

    try:
        from ansys.dyna.core import Deck
    except ImportError as error:
        raise UserError(
            f"target.mesh = {path} is an LS-DYNA file: reading it needs ansys-dyna-core; install birdstrike[lsdyna], "
            "or save the mesh as Abaqus .inp, Gmsh .msh or Nastran .bdf"
        ) from error
    deck: Any = Deck()
    deck.loads(Path(path).read_text(encoding="utf-8", errors="replace"))
    tables = [keyword.nodes for keyword in deck.get_kwds_by_type("NODE") if keyword.subkeyword == "NODE"]
    shells = [keyword.elements for keyword in deck.get_kwds_by_type("ELEMENT") if keyword.subkeyword == "SHELL"]
    if not tables or not shells:
        missing = "*NODE" if not tables else "*ELEMENT_SHELL"
        raise UserError(f"target.mesh = {path} holds no {missing}; write nodes and shells into the one file")
    number = np.concatenate([table["nid"].to_numpy(np.int64) for table in tables])
    points = np.concatenate([table[["x", "y", "z"]].to_numpy(np.float64) for table in tables])
    at = {int(node): row for row, node in enumerate(number)}
    corners = np.concatenate([table[CORNERS].fillna(0).to_numpy(np.int64) for table in shells])
    part = np.concatenate([table["pid"].to_numpy(np.int64) for table in shells])
    triangle = (corners[:, 3] == 0) | (corners[:, 3] == corners[:, 2])
    told = np.concatenate([corners[~triangle].ravel(), corners[triangle, :3].ravel()])
    unknown = sorted({int(node) for node in told} - at.keys())
    if unknown:
        raise UserError(
            f"target.mesh = {path}: shells name {len(unknown)} nodes that are not there, first {unknown[0]}"
        )
    cells: list[Any] = []
    if not triangle.all():
        cells.append(("quad", _rows(corners[~triangle], at)))
    if triangle.any():
        cells.append(("triangle", _rows(corners[triangle][:, :3], at)))
    own = np.concatenate([table["eid"].to_numpy(np.int64) for table in shells])
    numbers: dict[str, Any] = {NUMBER: [own[kind] for kind in _kinds(triangle)]}
    named = _headings(deck)
    sets: dict[str, Any] = {
        named.get(int(pid), f"part_{pid}"): [np.flatnonzero(part[kind] == pid) for kind in _kinds(triangle)]
        for pid in np.unique(part)
    }
    return meshio.Mesh(points, cells, cell_data=numbers, point_sets=_node_sets(deck, at), cell_sets=sets)


def _kinds(triangle: NDArray[np.bool_]) -> list[NDArray[np.bool_]]:
    """Which shells each block of cells holds."""
    return [kind for kind in (~triangle, triangle) if kind.any()]


def _rows(nodes: NDArray[np.int64], at: dict[int, int]) -> NDArray[np.int64]:
    """Rows of the points of numbered nodes."""
    return np.array([at.get(int(node), 0) for node in nodes.ravel()], np.int64).reshape(nodes.shape)


def _headings(deck: Any) -> dict[int, str]:
    """Names of parts by their number."""
    found: dict[int, str] = {}
    for keyword in deck.get_kwds_by_type("PART"):
        for heading, pid in zip(keyword.parts["heading"], keyword.parts["pid"], strict=True):
            if isinstance(heading, str) and heading.strip():
                found[int(pid)] = "_".join(heading.split())
    return found


def _node_sets(deck: Any, at: dict[int, int]) -> dict[str, Any]:
    """Rows of the points of each set of nodes, by its title or its number."""
    found: dict[str, Any] = {}
    for keyword in deck.get_kwds_by_type("SET"):
        if keyword.subkeyword.startswith("NODE_LIST"):
            title = getattr(keyword, "title", None)
            name = "_".join(title.split()) if isinstance(title, str) and title.strip() else f"set_{keyword.sid}"
            rows = [at[int(node)] for node in keyword.nodes if int(node) in at]
            found[name] = np.array(rows, np.int64)
    return found
