"""What is wrong with a mesh from a file, or costs: faults that refuse it, warnings, and remarks, each with its shells.

Every finding names part, the file's own number of the worst shell, its value, the range, what it means and what to do.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.histories import Array
from birdstrike.solver.target.mesh import border_sides, centres_of, is_triangle, sides_of, vector_areas
from birdstrike.solver.target.part_mesh import PartMesh

SIZES = (0.02, 5.0)  # m, of a target's largest extent
WARPED = (10.0, 20.0)
"""Degrees of warp from which on a shell is doubtful, and from which on it is refused."""
SLENDER = (10.0, 20.0)
"""Longest side over width, likewise."""
APART = 1e-3
"""Of a shell's size, up to which two nodes lie at one place."""
FEW = 0.1
"""Share of the shells that may rule the time step unsaid."""
SLOWED = 2.5
"""Times as many steps that these few may cost."""
NUMBERS_SHOWN = 5
FAULT, WARNING, REMARK = "fault", "warning", "remark"
Numbers = NDArray[np.int64]


@dataclass(frozen=True)
class Finding:
    """Something about some shells of a mesh; severity: "fault", "warning" or "remark"; shells: places in the mesh."""

    severity: str
    text: str
    shells: Numbers


@dataclass(frozen=True)
class Shapes:
    """Of every shell: corners (e, 4, 3), area [m^2], longest side [m], width [m] across it, warp [degrees]."""

    area: Array
    longest: Array
    width: Array
    warp: Array

    @classmethod
    def of(cls, nodes: Array, quads: Numbers) -> Shapes:
        """From nodes (m, 3) and facets (e, 4)."""
        corners, triangle = nodes[quads], is_triangle(quads)
        vectors = vector_areas(nodes, quads)
        area = np.linalg.norm(vectors, axis=1)
        longest = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2).max(axis=1)
        unit = vectors / np.maximum(area, 5e-31)[:, None]
        out = np.abs(((corners - centres_of(nodes, quads)[:, None]) * unit[:, None]).sum(axis=2)).max(axis=1)
        sound = (area > 1e-3 * longest**2) & ~triangle
        warp = np.zeros(len(quads))
        warp[sound] = np.rad2deg(np.arctan2(2.0 * out[sound], np.sqrt(area[sound])))
        width = np.where(triangle, 2.0, 1.0) * area / np.maximum(longest, 1e-30)
        return cls(area, longest, width, warp)


def size_fault(nodes: Array, unit: str, metres: dict[str, float]) -> Iterator[str]:
    """A target that is too large or too small to be one in its stated unit."""
    extent = float(np.ptp(nodes, axis=0).max())
    if not SIZES[0] <= extent <= SIZES[1]:
        fitting = [name for name, size in metres.items() if SIZES[0] <= extent / metres[unit] * size <= SIZES[1]]
        said = f"would it be in {' or '.join(fitting)}?" if fitting else "check target.mesh_unit"
        yield f"it is {extent:.4g} m across in target.mesh_unit = {unit}, beyond {SIZES[0]} .. {SIZES[1]} m; {said}"


def findings_of(mesh: PartMesh) -> Iterator[Finding]:
    """All that the mesh's shape has against it, faults first."""
    shapes, ordered = Shapes.of(mesh.nodes, mesh.quads), np.sort(mesh.quads, axis=1)
    same = (ordered[:, 1:] == ordered[:, :-1]).sum(axis=1)
    point = (same > is_triangle(mesh.quads)) | (shapes.area <= 1e-3 * shapes.longest**2)
    yield from _told(mesh, FAULT, point, "have corners at one place or no area; delete them or mesh them anew")
    inward = _turned_inwards(mesh) & ~point
    what = "have a corner of more than 180 degrees; move a node or split them into triangles"
    yield from _told(mesh, FAULT, inward, what)
    _, first = np.unique(ordered, axis=0, return_index=True)
    twice = np.ones(len(mesh.quads), np.bool_)
    twice[first] = False
    yield from _told(mesh, FAULT, twice, "lie on the nodes of another; delete them")
    warp = np.where(point, 0.0, shapes.warp)
    what = "are warped by more than {:.0f} degrees{}; refine the mesh or split them into triangles"
    yield from _graded(mesh, warp, WARPED, what, ": their bending is that of a flat shell", "degrees")
    aspect = np.where(point, 1.0, shapes.longest / np.maximum(shapes.width, 1e-30))
    what = "are more than {:.0f} times as long as wide{}; mesh them anew"
    coarse = ": stresses along them are coarse, and they rule the time step"
    yield from _graded(mesh, aspect, SLENDER, what, coarse, "times")
    yield from _not_joined(mesh)
    yield from _wound_against(mesh)


def _turned_inwards(mesh: PartMesh) -> NDArray[np.bool_]:
    """(e,) whether a quadrilateral is not convex: at a corner its sides turn against its normal."""
    corners, vectors = mesh.nodes[mesh.quads], vector_areas(mesh.nodes, mesh.quads)
    onward, back = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    turn = (np.cross(onward, back) * vectors[:, None]).sum(axis=2)
    return (turn < -2e-6 * (vectors**2).sum(axis=1)[:, None]).any(axis=1) & ~is_triangle(mesh.quads)


def _graded(
    mesh: PartMesh, values: Array, limits: tuple[float, float], what: str, meaning: str, unit: str
) -> Iterator[Finding]:
    """Shells above the upper limit, which are faults, and between the limits; what: with the limit and the meaning."""
    low, high = limits
    yield from _told(mesh, FAULT, values > high, what.format(high, ""), values, unit)
    yield from _told(mesh, WARNING, (values > low) & (values <= high), what.format(low, meaning), values, unit)


def _not_joined(mesh: PartMesh) -> Iterator[Finding]:
    """Nodes of free borders that lie at one place and are not merged."""
    from scipy.spatial import KDTree  # late: few cases read a mesh

    border = np.unique(border_sides(mesh.quads))
    if len(border) < 2:
        return
    size = float(np.sqrt(np.median(Shapes.of(mesh.nodes, mesh.quads).area)))
    pairs = KDTree(mesh.nodes[border]).query_pairs(APART * size, output_type="ndarray")
    if not len(pairs):
        return
    ends = border[pairs]
    owner = np.asarray(np.isin(mesh.quads, ends).any(axis=1))
    at = ", ".join(f"{1e3 * c:.4g}" for c in mesh.nodes[ends[0, 0]])
    text = (
        f"{len(pairs)} pairs of nodes lie at one place and are not merged, first at ({at}) mm from target.origin, on "
        f"{_shells(mesh, owner)}: the shells there are not joined, unless by target.ties or target.rivets; merge the "
        "nodes"
    )
    yield Finding(WARNING, text, np.flatnonzero(owner))


def _wound_against(mesh: PartMesh) -> Iterator[Finding]:
    """Shells of a part whose corners run against those of their neighbours across an edge."""
    rows = sides_of(mesh.quads)[:, :].reshape(-1, 4, 2)[:, [2, 1, 3, 0]].reshape(-1, 2)  # in the corners' order
    real = rows[:, 0] != rows[:, 1]
    shell = np.repeat(np.arange(len(mesh.quads)), 4)[real]
    rows, owner = rows[real], mesh.part[shell]
    keyed = np.column_stack([np.sort(rows, axis=1), owner])
    _, label, count = np.unique(keyed, axis=0, return_inverse=True, return_counts=True)
    label = label.ravel()
    rising = np.bincount(label, rows[:, 0] < rows[:, 1])
    against = (count == 2) & (rising != 1)
    if not against.any():
        return
    wrong = np.zeros(len(mesh.quads), np.bool_)
    disputed = np.bincount(shell, against[label], minlength=len(mesh.quads))
    wrong[np.flatnonzero(disputed)] = True
    what = (
        "share an edge with one of the same part that is wound the other way: birdstrike works out the sides itself, "
        "so that nothing changes here, but another solver may take the wrong side for its contact; align the normals"
    )
    yield from _told(mesh, REMARK, wrong, what)


def slow_shells(mesh: PartMesh, speeds: Sequence[float]) -> Iterator[Finding]:
    """The few shells whose stable time step is far below the others'; speeds: of sound in each part [m/s]."""
    shapes = Shapes.of(mesh.nodes, mesh.quads)
    speed = np.array(speeds)[mesh.part]
    if not speed.any():
        return
    step = np.full(len(mesh.quads), np.inf)
    np.divide(shapes.width, speed, out=step, where=speed > 0.0)
    others = float(np.quantile(step[speed > 0.0], FEW))
    few = step < others / SLOWED
    if not few.any():
        return
    cost = others / float(step.min())
    what = (
        f"have a stable time step far below the others' {1e6 * others:.3g} us (all but {FEW:.0%} of the shells have a "
        f"longer one): they cost {cost:.1f} times as many steps; merge or enlarge them"
    )
    yield from _told(mesh, WARNING, few, what, 1e6 * step, "us", smallest=True)


def _told(
    mesh: PartMesh,
    severity: str,
    wrong: NDArray[np.bool_],
    what: str,
    values: Array | None = None,
    unit: str = "",
    smallest: bool = False,
) -> Iterator[Finding]:
    """A finding about the shells that are wrong, with parts, first numbers, and the worst of them."""
    if not wrong.any():
        return
    told = np.flatnonzero(wrong)
    worst = ""
    if values is not None:
        one = int(told[np.argmin(values[told]) if smallest else np.argmax(values[told])])
        worst = f" (worst: {values[one]:.3g} {unit}, number {mesh.number(one)} of {mesh.parts[mesh.part[one]]})"
    yield Finding(severity, f"{_shells(mesh, wrong)} {what}{worst}", told)


def _shells(mesh: PartMesh, wrong: NDArray[np.bool_]) -> str:
    """How many they are, their numbers in the file and their parts."""
    told = np.flatnonzero(wrong)
    numbers = ", ".join(str(mesh.number(int(one))) for one in told[:NUMBERS_SHOWN])
    more = ", ..." if len(told) > NUMBERS_SHOWN else ""
    parts = ", ".join(mesh.parts[number] for number in np.unique(mesh.part[told]))
    return f"{len(told)} shells (number {numbers}{more}) of {parts}"
