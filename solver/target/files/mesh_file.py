"""Meshes of targets from files: Abaqus, LS-DYNA, Nastran, and what meshio reads (Gmsh, VTK); checked, and in SI.

Parts are the file's named sets of elements, or else the numbers that it gives its elements (physical groups, property
identifiers, or an array `part`), as part_1, part_2, ... where they have no names. Sets are its named sets of nodes, of
Gmsh the named groups of points and curves.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable, Iterator
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.errors import UserError
from birdstrike.solver.fields import shortened
from birdstrike.solver.target.files.abaqus_mesh import read_abaqus
from birdstrike.solver.target.files.lsdyna_mesh import ENDINGS, read_keywords
from birdstrike.solver.target.files.mesh_quality import FAULT, WARNING, Finding, findings_of, size_fault
from birdstrike.solver.target.files.nastran_mesh import NASTRAN, read_nastran
from birdstrike.solver.target.files.text_mesh import NUMBER, THICKNESSES, TextMesh, no_shells, numbered_part
from birdstrike.solver.target.mesh import border_sides, is_triangle
from birdstrike.solver.target.part_mesh import PartMesh

METRES = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "in": 0.0254}
"""Units of length that a mesh file can be in."""
NUMBERED = ("gmsh:physical", "nastran:ref", "medit:ref", "part")
"""Arrays of a file that number the parts of its elements."""
FREE = "free_edges"
"""The set that every file has: nodes of the free border."""
GROUPED = {"vertex": 0, "line": 1}
"""Kinds of elements that hold Gmsh's groups of points and curves, with their dimension there."""
READERS: dict[str, Callable[[str], TextMesh]] = {
    ".inp": read_abaqus,
    **dict.fromkeys(ENDINGS, read_keywords),
    **dict.fromkeys(NASTRAN, read_nastran),
}
"""Of the text formats, by the file's ending; meshio reads all others."""
LOOSE = {"line": "beams, bars or springs", "vertex": "point elements"}
"""Kinds of elements that are no shells and are left out."""
SHELLS = ("quad", "triangle")
"""Kinds of elements that are shells, in the order that a mesh has them."""


def read_mesh(path: str, unit: str, origin: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> PartMesh:
    """The mesh of a file, shifted so that `origin` [m], a point of the file's own axes, becomes the origin.

    Raises UserError for a file that is none, for elements that are no shells of first order, and for a mesh whose shape
    would spoil any run: all faults at once.
    """
    mesh, findings = inspect_mesh(path, unit, origin)
    faults = [found.text for found in findings if found.severity == FAULT]
    if faults:
        raise UserError(f"target.mesh = {path}: {fault}" for fault in faults)
    return mesh


def inspect_mesh(path: str, unit: str, origin: tuple[float, float, float]) -> tuple[PartMesh, tuple[Finding, ...]]:
    """The mesh of a file, however bad its shells are, and all that is found about them; raises UserError for none."""
    key = path, unit, origin
    try:
        if Path(path).is_dir():
            raise UserError(f"target.mesh = {shortened(path)} is a folder; name the mesh file in it")
        Path(path).stat()
    except (OSError, ValueError) as error:  # the latter for a name that no file can have
        raise _unreadable(path, error) from error
    kept = _KEPT.get(key)
    if kept is None or any(_changed(file) != at for file, at in kept.changed.items()):
        try:
            kept = _KEPT[key] = _read(*key)
        except OSError as error:
            raise _unreadable(path, error) from error
    if len(_KEPT) > MOST_KEPT:
        _KEPT.pop(next(iter(_KEPT)), None)
    return kept.mesh, kept.findings


def _unreadable(path: str, error: OSError | ValueError) -> UserError:
    """Of a file that is not there, or that may not be read."""
    reason = getattr(error, "strerror", None) or error
    return UserError(
        f"target.mesh = {shortened(path)} cannot be read: {reason}; correct the path, or the file's rights"
    )


class Kept(NamedTuple):
    """What was read, and when each of the files in which it stands had been changed [ns]."""

    mesh: PartMesh
    findings: tuple[Finding, ...]
    changed: dict[Path, int]


_KEPT: dict[tuple[str, str, tuple[float, float, float]], Kept] = {}
MOST_KEPT = 8


def _changed(file: Path) -> int:
    """When a file was changed last [ns]; -1 of one that is not there."""
    try:
        return file.stat().st_mtime_ns
    except OSError:
        return -1


def _read(path: str, unit: str, origin: tuple[float, float, float]) -> Kept:
    file, left_out, files = _file(path)
    changed = {one: _changed(one) for one in (Path(path), *files)}
    other = sorted({block.type for block in file.cells} - {*SHELLS, *GROUPED})
    if other or not any(block.type in SHELLS for block in file.cells):
        raise UserError(f"target.mesh = {path}: {no_shells(other)}")
    order = [i for kind in SHELLS for i, block in enumerate(file.cells) if block.type == kind]
    quads = np.concatenate([_four(file.cells[i].data) for i in order]).astype(np.int64)
    if lost := int(((quads < 0) | (quads >= len(file.points))).any(axis=1).sum()):
        raise UserError(
            f"target.mesh = {path}: {lost} of its shells name nodes that are not there, of {len(file.points)}; write "
            "the file anew, with the nodes of every shell"
        )
    names, part = _parts(file, order, len(quads), path)
    used, quads = np.unique(quads, return_inverse=True)
    points = np.zeros((len(file.points), 3))
    points[:, : file.points.shape[1]] = file.points
    if not np.isfinite(points[used]).all():
        lost = int((~np.isfinite(points[used]).all(axis=1)).sum())
        raise UserError(f"target.mesh = {path}: {lost} nodes of its shells have no finite coordinates; write it anew")
    nodes = points[used] * METRES[unit] - np.array(origin)
    quads = quads.reshape(-1, 4).astype(np.int64)
    renumbered = {int(node): at for at, node in enumerate(used)}
    given_sets = {**file.point_sets, **_groups(file)}
    sets = {
        name: np.array(sorted({renumbered[int(node)] for node in given if int(node) in renumbered}), np.int64)
        for name, given in given_sets.items()
    }
    left_out += _lost_nodes(given_sets, sets)
    lost = [Finding(WARNING, text, np.empty(0, np.int64)) for text in left_out]
    numbers = [file.cell_data[NUMBER][i] for i in order] if NUMBER in file.cell_data else None
    whole = None if numbers is None else np.concatenate(numbers).astype(np.int64)
    last = np.argsort(is_triangle(quads), kind="stable")  # a quadrilateral may be written with its last node twice
    quads, part, whole = quads[last], part[last], None if whole is None else whole[last]
    stated = {name: METRES[unit] * own for name, own in (file.info or {}).get(THICKNESSES, {}).items() if name in names}
    mesh = PartMesh(nodes, quads, part, names, {FREE: free_edges(quads)} | sets, numbers=whole, thicknesses=stated)
    if wrong := list(size_fault(nodes, unit, METRES)):
        raise UserError(f"target.mesh = {path}: {fault}" for fault in wrong)
    return Kept(mesh, (*findings_of(mesh), *lost), changed)


def _file(path: str) -> tuple[Any, list[str], list[Path]]:
    """A file as meshio has it, what it has besides that would change the answer, in sentences, and what it includes."""
    ending = Path(path).suffix.lower()
    try:
        if ending not in READERS:
            file = _by_meshio(path)
            if ending == ".msh":  # Gmsh's lines and points are groups
                return file, list(_unnamed_groups(file)), []
            return file, [*_unread_numbers(file), *_left_out(_loose(file))], []
        text = READERS[ending](path)
        return text.meshio(), [*text.told, *_left_out(text.held)], text.files
    except UserError as error:
        raise UserError(f"target.mesh = {path}: {line}" for line in error.errors) from error


def _by_meshio(path: str) -> Any:
    import meshio  # late: only targets from files need it

    said = StringIO()
    try:
        with redirect_stdout(said), redirect_stderr(said):
            return meshio.read(path)
    except (Exception, SystemExit) as error:  # meshio prints its reason and ends the process on some files
        raise UserError(
            f"it is no mesh that meshio reads, or is damaged or cut short: {_reason(error, said.getvalue())}; rename "
            "it, where it is one of these with another ending, or write it anew, as Abaqus .inp, Gmsh .msh, Nastran "
            ".bdf, VTK .vtk or .vtu, or LS-DYNA .k"
        ) from error


def _unread_numbers(file: Any) -> Iterator[str]:
    """What is said of whole numbers of the shells that may be those of their parts, in an array of another name."""
    if file.cell_sets or any(key in file.cell_data for key in NUMBERED):
        return
    for name, blocks in file.cell_data.items():
        own = [values for values, block in zip(blocks, file.cells, strict=True) if block.type in SHELLS]
        values = np.concatenate(own) if own else np.empty(0)
        if values.dtype.kind in "iu" and values.ndim == 1 and 1 < len(np.unique(values)) < len(values):
            yield f'the array {name} is not read: all shells are of one part; call it "part" if it numbers their parts'


def _loose(file: Any) -> list[str]:
    """How many elements there are of each kind that is left out."""
    counts: dict[str, int] = {}
    for block in file.cells:
        if block.type in LOOSE:
            counts[LOOSE[block.type]] = counts.get(LOOSE[block.type], 0) + len(block.data)
    return [f"{count} {word}" for word, count in counts.items()]


def _left_out(held: list[str]) -> list[str]:
    """The sentence about what joins, loads or stiffens and is not read."""
    if not held:
        return []
    return [
        f"{', '.join(dict.fromkeys(held))} left out: their stiffness, mass and joints are not in the model; model what "
        "matters with shells, target.ties or target.rivets"
    ]


def _reason(error: BaseException, said: str) -> str:
    """Why meshio does not read a file: what it printed before it ended the process, or its exception."""
    if isinstance(error, SystemExit):
        printed = [line for line in said.splitlines() if line.strip() and "Couldn't read file" not in line]
        return " ".join(" ".join(printed).split()).removeprefix("Error: ") or "it ended without a reason"
    if "gmsh:physical" in str(error):
        return (
            "some of its elements are in no physical group, which meshio does not read in Gmsh's version 4; put every "
            "surface into a group and save the groups alone (Mesh.SaveAll = 0), or save it as version 2.2 "
            "(Mesh.MshFileVersion = 2.2)"
        )
    if isinstance(error, KeyError):
        return f"it refers to {error.args[0]}, which is not there"
    return str(error) or type(error).__name__


def _groups(file: Any) -> dict[str, NDArray[np.int64]]:
    """Nodes of Gmsh's named groups of points and curves."""
    found: dict[str, list[NDArray[np.int64]]] = {}
    named = _named_groups(file)
    for block, own in zip(file.cells, file.cell_data.get("gmsh:physical", []), strict=False):
        for tag in np.unique(own) if block.type in GROUPED else ():
            name = named.get((int(tag), GROUPED[block.type]))
            if name is not None:
                found.setdefault(name, []).append(block.data[np.asarray(own) == tag].ravel())
    for name in set(file.cell_sets) & {name for (_, dimension), name in named.items() if dimension < 2}:
        for block, own in zip(file.cells, file.cell_sets[name], strict=True):  # of version 4: a curve in several groups
            found.setdefault(name, []).append(block.data[own].ravel())
    return {name: np.unique(np.concatenate(nodes)) for name, nodes in found.items()}


def _named_groups(file: Any) -> dict[tuple[int, int], str]:
    """Names of Gmsh's groups by number and dimension."""
    return {(int(value[0]), int(value[1])): name for name, value in file.field_data.items()}


def _unnamed_groups(file: Any) -> Iterator[str]:
    """What is said of Gmsh's groups of points and curves that make no set, as they have no name of their own."""
    named, found = _named_groups(file), set[tuple[int, int]]()
    for block, own in zip(file.cells, file.cell_data.get("gmsh:physical", []), strict=False):
        found |= {(int(tag), GROUPED[block.type]) for tag in np.unique(own) if block.type in GROUPED and tag}
    if lost := sorted(str(tag) for tag, dimension in found - named.keys()):
        yield (
            f"Gmsh's groups of points or curves {', '.join(lost)} are not read: they have no name of their own, and no "
            'set is made of them; name them, as in Physical Curve("rim")'
        )


def _four(corners: NDArray[np.int64]) -> NDArray[np.int64]:
    """Facets (e, 4) of quadrilaterals (e, 4) or triangles (e, 3), the last node of a triangle twice.

    Whichever neighbouring nodes of a quadrilateral are one, its corners then begin so that they are the last.
    """
    if corners.shape[1] == 3:
        return np.column_stack([corners, corners[:, 2]])
    again = corners == np.roll(corners, -1, axis=1)  # a quadrilateral with one side that is a point is a triangle
    shift = np.where(again.sum(axis=1) == 1, again.argmax(axis=1) - 2, 0)
    return np.take_along_axis(corners, (np.arange(4) + shift[:, None]) % 4, axis=1)


def _lost_nodes(given: Any, kept: dict[str, NDArray[np.int64]]) -> Iterator[str]:
    """Sets that hold nodes on no shell."""
    for name, nodes in given.items():
        missing = len({int(node) for node in nodes}) - len(kept[name])
        if missing:
            yield (
                f"the set {name} has {missing} nodes that are on no shell: they are left out, {len(kept[name])} "
                "remain; check that the set is the one meant"
            )


def _parts(file: Any, order: list[int], shells: int, path: str) -> tuple[tuple[str, ...], NDArray[np.int64]]:
    """Names of the parts and the part of every shell; order: the file's blocks of shells, as the mesh has them."""
    part = np.full(shells, -1)
    names, shared = list[str](), list[str]()
    starts = np.cumsum([0, *(len(file.cells[i].data) for i in order)])
    for name, blocks in file.cell_sets.items():
        if name.startswith("gmsh:"):  # meshio's own lists of other things than elements
            continue
        members = [
            at + np.asarray(blocks[i], np.int64)
            for at, i in zip(starts[:-1], order, strict=True)
            if i < len(blocks) and blocks[i] is not None
        ]
        flat = np.concatenate(members) if members else np.empty(0, np.int64)
        taken = part[flat] >= 0
        if len(flat) and not taken.any():
            part[flat] = len(names)
            names.append(name)
        elif taken.any():
            shared.append(f"{name} shares {int(taken.sum())} with {names[part[flat[taken][0]]]}")
    if (part >= 0).all():
        return tuple(names), part
    for key in NUMBERED:
        if key in file.cell_data:
            given = [file.cell_data[key][i] for i in order]
            values = np.concatenate(given)
            if not np.isfinite(values).all():
                raise UserError(
                    f"target.mesh = {path}: {int((~np.isfinite(values)).sum())} of {shells} shells have no number in "
                    f"the array {key}, which says their parts; give every shell one"
                )
            numbers, part = np.unique(values.astype(np.int64), return_inverse=True)
            named = {int(value[0]): name for name, value in file.field_data.items() if int(value[1]) == 2}
            return tuple(named.get(int(number), numbered_part(number)) for number in numbers), part.ravel()
    if names:
        apart = f"; left aside, since parts share no shell: {', '.join(shared)}" if shared else ""
        raise UserError(
            f"target.mesh = {path}: {int((part < 0).sum())} of {shells} shells are in no set of elements; its sets: "
            f"{', '.join(names)}{apart}. Every shell needs a part"
        )
    return ("part_1",), np.zeros(shells, np.int64)


class MeshFile:
    """A mesh from a file as a case sees it, beside the generators.

    struck: the part that the bird is aimed at; filled: the sets that hold nodes; findings: what is doubtful about its
    shells.
    """

    def __init__(self, path: str, unit: str, origin: tuple[float, float, float], struck: str | None) -> None:
        self._mesh = read_mesh(path, unit, origin)
        self.findings = inspect_mesh(path, unit, origin)[1]
        self.path, self.parts, self.sets = path, self._mesh.parts, tuple(self._mesh.sets)
        self.filled = tuple(name for name, nodes in self._mesh.sets.items() if len(nodes))
        self.rows: tuple[str, ...] = ()
        self.pieces, self.element_size = self._mesh.pieces, self._mesh.element_size
        self.struck = self.parts[0] if struck is None else struck
        self.length, self.width = (float(size) for size in np.ptp(self._mesh.nodes, axis=0)[:2])

    def unread(self, name: str) -> str:
        """What is said of a set that the file has and that is not read; empty where it has none of that name."""
        word = re.compile(rf"(?<!\w){re.escape(name)}(?!\w)")
        said = (found.text for found in self.findings if " is not read" in found.text)
        return next((text for text in said if word.search(text)), "")

    def mesh(self) -> PartMesh:
        """The mesh itself."""
        return self._mesh


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


def included_files(path: Path) -> Iterator[str]:
    """Files from a mesh file's own folder that it includes, by their paths from there, and those that they include.

    One that is named by a whole path, or lies elsewhere, stays where it is.
    """
    if path.suffix.lower() not in READERS:
        return
    root = path.parent.resolve()
    for file in sorted({file.resolve() for file in READERS[path.suffix.lower()](str(path)).files}):
        if file.is_relative_to(root):
            yield file.relative_to(root).as_posix()
