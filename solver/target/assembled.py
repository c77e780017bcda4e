"""A target from a mesh of named parts: thickness and metal of each, how sets of nodes are held, what joins them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.errors import UserError
from birdstrike.data.histories import Array
from birdstrike.solver.target.assembly import Target
from birdstrike.solver.target.laws.interface import TargetMaterial
from birdstrike.solver.target.links.rivets import RivetData, Rivets, rivets_of
from birdstrike.solver.target.links.ties import TieData, Ties, ties_of
from birdstrike.solver.target.mesh import LEVEL, ShellMesh, border_sides, sides_by_edge, sides_of, vector_areas
from birdstrike.solver.target.nodes import Nodes
from birdstrike.solver.target.part_mesh import PartMesh, Row
from birdstrike.solver.target.section import Section
from birdstrike.solver.target.supports import DISPLACEMENTS, EVERYTHING, NAMED, EdgeStiffness, Held, Supports
from birdstrike.solver.target.triangle_block import shell_blocks


@dataclass(frozen=True)
class PartData:
    """Thickness [m] and metal of a part."""

    thickness: float
    material: TargetMaterial


@dataclass(frozen=True)
class LinkData:
    """What joins parts that share no node: ties by name, and rows of rivets."""

    ties: Mapping[str, TieData] = field(default_factory=dict)
    rivets: tuple[tuple[str, Row, RivetData], ...] = ()


def assembled(
    parts: PartMesh,
    data: Mapping[str, PartData],
    supports: Mapping[str, EdgeStiffness],
    damping: float = 0.0,
    links: LinkData = LinkData(),
) -> Target:
    """The target, at rest.

    Raises UserError for springs on nodes that are not on a free edge, for ties and rivets that join nothing, and for
    parts that nothing holds while others are held.
    """
    each = [data[name] for name in parts.parts]
    mesh = shells_of(parts, {name: one.material for name, one in data.items()})
    sections = [Section(one.thickness, one.material.density, one.material.row()) for one in each]
    blocks = shell_blocks(parts.nodes, parts.quads, sections, parts.part, scaled_inertia=True)
    border = Border.of(parts)
    share = held_lengths(parts, border, [name for name, held in supports.items() if held != NAMED["free"]])
    sets = {name: held_set(parts, border, name, stiffness, share) for name, stiffness in supports.items()}
    held = Supports(mesh, sets)
    rigid = np.array([not one.material.moves for one in each])[parts.part]
    if rigid.any():
        held.hold_globally(np.unique(parts.quads[rigid]), EVERYTHING)
    ties = ties_of(parts, dict(links.ties), held.held > 0)
    rivets = rivets_of(parts, links.rivets)
    _refuse_loose_parts(parts, held, ties, rivets)
    return Target(mesh, Nodes(parts.nodes, damping), blocks, held, ties=ties, rivets=rivets)


def _refuse_loose_parts(parts: PartMesh, held: Supports, ties: Ties | None, rivets: Rivets | None) -> None:
    """Raise UserError that names the parts which hang on nothing that is held, in a target that is held somewhere."""
    if held.free:
        return
    ends = [sides_of(parts.quads)]
    if ties is not None:
        ends.append(ties.anchors.pairs(ties.followers))
    if rivets is not None:
        first = rivets.anchors.member[rivets.anchors.start[:-1]]
        ends += [rivets.anchors.pairs(first), first.reshape(-1, 2)]
    from scipy.sparse import coo_array  # late: a single plate of one part needs no graph
    from scipy.sparse.csgraph import connected_components

    sides = np.concatenate(ends)
    graph = coo_array((np.ones(len(sides)), (sides[:, 0], sides[:, 1])), shape=(len(parts.nodes),) * 2)
    piece = connected_components(graph, directed=False)[1]
    sprung = held.nodes[held.springs[:, :2].any(axis=1)]
    firm = np.union1d(piece[sprung], piece[held.held & DISPLACEMENTS > 0])
    loose = ~np.isin(piece[parts.quads[:, 0]], firm)
    if loose.any():
        names = ", ".join(parts.parts[number] for number in np.unique(parts.part[loose]))
        raise UserError(
            f"target: {int(loose.sum())} shells of {names} hang on nothing that is held, a free rigid body: share "
            "nodes, give target.ties or target.rivets, or name one of their sets in target.supports"
        )


def shells_of(parts: PartMesh, metals: Mapping[str, TargetMaterial]) -> ShellMesh:
    """The shells with the facets of each part, by its metal rigid or not."""
    return replace(parts.shells, rigid=tuple(name for name in parts.parts if not metals[name].moves))


class Border(NamedTuple):
    """Sides of the free border, (k, 2) nodes, and the unit normals (k, 3) of the shells that they are of."""

    sides: NDArray[np.int64]
    normal: Array

    @classmethod
    def of(cls, parts: PartMesh) -> Border:
        """All of a mesh."""
        order, start, count = sides_by_edge(parts.quads)
        normal = vector_areas(parts.nodes, parts.quads[order[start[count == 1]] // 4])
        return cls(border_sides(parts.quads), normal / np.linalg.norm(normal, axis=1, keepdims=True))


def held_lengths(parts: PartMesh, border: Border, names: list[str]) -> dict[str, Array]:
    """Length of free border that belongs to the ends of each side by each of the named sets, which hold, (k, 2) [m].

    Half of either side whose two ends lie in the set, and half of those between two sets that no set holds whole.
    """
    sides = border.sides
    half = 0.5 * np.linalg.norm(parts.nodes[sides[:, 0]] - parts.nodes[sides[:, 1]], axis=1)[:, None]
    within = {name: np.isin(sides, parts.sets[name]) for name in names}
    held, whole = np.zeros(sides.shape, np.bool_), np.zeros(len(sides), np.bool_)
    for ends in within.values():
        held |= ends
        whole |= ends.all(axis=1)
    between = held.all(axis=1) & ~whole

    def of(ends: NDArray[np.bool_]) -> Array:
        return half * ends * (ends.all(axis=1) | between)[:, None]

    return {name: of(ends) for name, ends in within.items()}


def held_set(parts: PartMesh, border: Border, name: str, stiffness: EdgeStiffness, share: Mapping[str, Array]) -> Held:
    """A set of nodes held alike, with its lengths of border. Raises UserError for springs on nodes that have none."""
    nodes = parts.sets[name]
    length = np.zeros(len(nodes))
    if name in share:
        every = np.bincount(border.sides.ravel(), share[name].ravel(), minlength=len(parts.nodes))
        length = every[nodes].astype(np.float64)
    if stiffness not in NAMED.values() and not length.all():
        lone = int(np.count_nonzero(length == 0.0))
        raise UserError(
            f"target.supports.{name}: springs are given per length of edge, and {lone} of its {len(nodes)} nodes lie "
            'on no free edge that is held; hold it rigidly ("clamped" or "pinned") or choose a set of edge nodes'
        )
    if stiffness in NAMED.values() or stiffness.in_plane == stiffness.transverse:
        return Held(nodes, stiffness, length)
    return held_surfaces(border, stiffness, share[name])


def held_surfaces(border: Border, stiffness: EdgeStiffness, share: Array) -> Held:
    """As `held_set`, of springs that differ along and across: where several surfaces meet, each has its own."""
    found: dict[int, list[tuple[float, Array]]] = {}
    for place in np.flatnonzero(share.ravel() > 0.0):
        size, normal = float(share.ravel()[place]), border.normal[place // 2]
        there = found.setdefault(int(border.sides.ravel()[place]), [])
        for i, (length, summed) in enumerate(there):
            cosine = float(summed @ normal) / np.linalg.norm(summed)
            if abs(cosine) > LEVEL:
                there[i] = (length + size, summed + math.copysign(size, cosine) * normal)
                break
        else:
            there.append((size, size * normal))
    nodes = np.array([node for node in sorted(found) for _ in found[node]], np.int64)
    length, summed = zip(*(one for node in sorted(found) for one in found[node]), strict=True)
    normal = np.array(summed) / np.linalg.norm(summed, axis=1, keepdims=True)
    return Held(nodes, stiffness, np.array(length), normal)
