"""Meshes of targets from files: what meshio reads (Abaqus, Gmsh, Nastran, VTK) and LS-DYNA's .k; checked, and in SI.

Parts are the file's named sets of elements, or else the numbers that it gives its elements (physical groups, property
identifiers, or an array `part`), as part_1, part_2, ... where they have no names. Sets are its named sets of nodes.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from birdstrike.data.errors import UserError
from birdstrike.data.histories import Array
from birdstrike.solver.target.lsdyna_mesh import ENDINGS, read_keywords
from birdstrike.solver.target.mesh import border_sides, sides_of
from birdstrike.solver.target.part_mesh import PartMesh

METRES = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "in": 0.0254}
"""Units of length that a mesh file can be in."""
NUMBERED = ("gmsh:physical", "nastran:ref", "medit:ref", "part")
"""Arrays of a file that number the parts of its elements."""
FREE = "free_edges"
"""The set that every file has: nodes of the free border."""
SIZES = (0.02, 5.0)  # m, of a target's largest extent
MOST_WARPED = np.deg2rad(20.0)
MOST_SLENDER = 20.0
NUMBERS_SHOWN = 5


def read_mesh(path: str, unit: str, origin: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> PartMesh:
    """The mesh of a file, shifted so that `origin` [m], a point of the file's own axes, becomes the origin.

    Raises UserError for a file that is none, for elements that are no quadrilaterals, and for a mesh whose shape would
    spoil any run: all faults at once.
    """
    try:
        return _read(path, unit, origin, Path(path).stat().st_mtime_ns)
    except OSError as error:
        raise UserError(f"target.mesh = {path} cannot be read: {error}") from error


@lru_cache(maxsize=8)
def _read(path: str, unit: str, origin: tuple[float, float, float], _changed: int) -> PartMesh:
    import meshio  # late: only targets from files need it

    try:
        file: Any = read_keywords(path) if Path(path).suffix.lower() in ENDINGS else meshio.read(path)
    except UserError:
        raise
    except (Exception, SystemExit) as error:  # meshio ends the process on some files
        reason = str(error) or type(error).__name__
        raise UserError(
            f"target.mesh = {path} is no mesh that meshio reads: {reason}; Abaqus .inp, Gmsh .msh, Nastran .bdf, "
            "VTK .vtk and .vtu are, and LS-DYNA .k through ansys-dyna-core"
        ) from error
    other = sorted({block.type for block in file.cells} - {"quad", "vertex", "line"})
    if other or not any(block.type == "quad" for block in file.cells):
        found = ", ".join(other) or "no shells"
        raise UserError(
            f"target.mesh = {path} holds {found}; a target is of four-node shells: mesh it with quadrilaterals of "
            "first order (recombine triangles in your mesher)"
        )
    quads = np.concatenate([block.data for block in file.cells if block.type == "quad"]).astype(np.int64)
    names, part = _parts(file, len(quads), path)
    used, quads = np.unique(quads, return_inverse=True)
    points = np.zeros((len(file.points), 3))
    points[:, : file.points.shape[1]] = file.points
    nodes = points[used] * METRES[unit] - np.array(origin)
    quads = quads.reshape(-1, 4).astype(np.int64)
    faults = list(_faults(nodes, quads, unit))
    if faults:
        raise UserError(f"target.mesh = {path}: {fault}" for fault in faults)
    renumbered = {int(node): at for at, node in enumerate(used)}
    sets = {
        name: np.array(sorted(renumbered[int(node)] for node in given if int(node) in renumbered), np.int64)
        for name, given in file.point_sets.items()
    }
    return PartMesh(nodes, quads, part, names, {FREE: free_edges(quads)} | sets)


def _parts(file: Any, shells: int, path: str) -> tuple[tuple[str, ...], NDArray[np.int64]]:
    """Names of the parts and the part of every quadrilateral."""
    kinds = [block.type == "quad" for block in file.cells]
    part = np.full(shells, -1)
    names: list[str] = []
    for name, blocks in file.cell_sets.items():
        sizes = np.cumsum([0, *(len(block.data) for block, quad in zip(file.cells, kinds, strict=True) if quad)])
        chosen = [given for given, quad in zip(blocks, kinds, strict=True) if quad]
        members = [
            at + np.asarray(given, np.int64) for at, given in zip(sizes, chosen, strict=False) if given is not None
        ]
        flat = np.concatenate(members) if members else np.empty(0, np.int64)
        if len(flat) and (part[flat] < 0).all():
            part[flat] = len(names)
            names.append(name)
    if (part >= 0).all():
        return tuple(names), part
    for key in NUMBERED:
        if key in file.cell_data:
            given = [values for values, quad in zip(file.cell_data[key], kinds, strict=True) if quad]
            numbers, part = np.unique(np.concatenate(given).astype(np.int64), return_inverse=True)
            named = {int(value[0]): name for name, value in file.field_data.items() if int(value[1]) == 2}
            return tuple(named.get(int(number), f"part_{number}") for number in numbers), part.ravel()
    if names:
        raise UserError(
            f"target.mesh = {path}: {int((part < 0).sum())} of {shells} shells are in no set of elements; its sets: "
            f"{', '.join(names)}. Every shell needs a part"
        )
    return ("part_1",), np.zeros(shells, np.int64)


def _faults(nodes: Array, quads: NDArray[np.int64], unit: str) -> Iterator[str]:
    """What would spoil any run on this mesh: wrong unit, doubled, degenerate, warped, needle and loose shells."""
    extent = float(np.ptp(nodes, axis=0).max())
    if not SIZES[0] <= extent <= SIZES[1]:
        fitting = [name for name, size in METRES.items() if SIZES[0] <= extent / METRES[unit] * size <= SIZES[1]]
        said = f"would it be in {' or '.join(fitting)}?" if fitting else "check target.mesh_unit"
        yield f"it is {extent:.4g} m across in target.mesh_unit = {unit}, beyond {SIZES[0]} .. {SIZES[1]} m; {said}"
        return
    corners = nodes[quads]
    normal = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    area = 0.5 * np.linalg.norm(normal, axis=1)
    sides = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2)
    ordered = np.sort(quads, axis=1)
    point = (ordered[:, 1:] == ordered[:, :-1]).any(axis=1) | (area <= 1e-3 * sides.max(axis=1) ** 2)
    yield from _told(point, "have corners at one place or no area; they are triangles or points: mesh them anew")
    _, first = np.unique(ordered, axis=0, return_index=True)
    twice = np.ones(len(quads), np.bool_)
    twice[first] = False
    yield from _told(twice, "lie on the nodes of another; delete them")
    sound = ~point
    warp = np.zeros(len(quads))
    unit_normal = normal / np.maximum(2.0 * area, 1e-30)[:, None]
    out = np.abs(((corners - corners.mean(axis=1, keepdims=True)) * unit_normal[:, None]).sum(axis=2)).max(axis=1)
    warp[sound] = np.arctan2(2.0 * out[sound], np.sqrt(area[sound]))
    limit = f"{np.rad2deg(MOST_WARPED):.0f} degrees"
    yield from _told(warp > MOST_WARPED, f"are warped by more than {limit}; refine the mesh")
    needle = sound & (sides.max(axis=1) ** 2 > MOST_SLENDER * area)
    yield from _told(needle, f"are more than {MOST_SLENDER:.0f} times as long as wide; mesh them anew")


class MeshFile:
    """A mesh from a file as a case sees it, beside the generators; struck: the part that the bird is aimed at."""

    def __init__(self, path: str, unit: str, origin: tuple[float, float, float], struck: str | None) -> None:
        self._mesh = read_mesh(path, unit, origin)
        self.path, self.parts, self.sets = path, self._mesh.parts, tuple(self._mesh.sets)
        self.rows: tuple[str, ...] = ()
        self.pieces = _pieces(self._mesh.quads, len(self._mesh.nodes))
        self.struck = self.parts[0] if struck is None else struck
        self.length, self.width = (float(size) for size in np.ptp(self._mesh.nodes, axis=0)[:2])
        corners = self._mesh.nodes[self._mesh.quads]
        areas = 0.5 * np.linalg.norm(np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]), axis=1)
        self.element_size = float(np.sqrt(areas.mean()))

    def mesh(self) -> PartMesh:
        """The mesh itself."""
        return self._mesh


def _told(wrong: NDArray[np.bool_], what: str) -> Iterator[str]:
    """One line about the shells that are wrong, with the numbers of the first, counted from 1."""
    if wrong.any():
        numbers = ", ".join(str(number + 1) for number in np.flatnonzero(wrong)[:NUMBERS_SHOWN])
        more = ", ..." if wrong.sum() > NUMBERS_SHOWN else ""
        yield f"{int(wrong.sum())} shells (number {numbers}{more}) {what}"


def _pieces(quads: NDArray[np.int64], nodes: int) -> int:
    """How many parts share no node."""
    ends = sides_of(quads)
    graph = coo_array((np.ones(len(ends)), (ends[:, 0], ends[:, 1])), shape=(nodes, nodes))
    return int(connected_components(graph, directed=False, return_labels=False))


def free_edges(quads: NDArray[np.int64]) -> NDArray[np.int64]:
    """Nodes of sides that belong to one shell alone."""
    return np.unique(border_sides(quads))


def digest(mesh: PartMesh) -> str:
    """First 16 hex digits of the SHA-256 of a mesh's content, whatever file it came from."""
    found = hashlib.sha256()
    for values in (mesh.nodes, mesh.quads, mesh.part):
        found.update(np.ascontiguousarray(values).tobytes())
    for name in sorted(mesh.sets):
        found.update(name.encode() + mesh.sets[name].tobytes())
    found.update(",".join(mesh.parts).encode())
    return found.hexdigest()[:16]
