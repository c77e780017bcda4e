"""A target from a mesh of named parts: their thickness and metal, and how sets of its nodes are held."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.errors import UserError
from birdstrike.data.histories import Array
from birdstrike.solver.target.assembly import Target
from birdstrike.solver.target.laws.interface import TargetMaterial
from birdstrike.solver.target.mesh import ShellMesh, shell_mesh, sides_of
from birdstrike.solver.target.nodes import Nodes
from birdstrike.solver.target.part_mesh import PartMesh
from birdstrike.solver.target.section import Section
from birdstrike.solver.target.shell_block import ShellBlock
from birdstrike.solver.target.supports import EVERYTHING, NAMED, EdgeStiffness, Held, Supports


@dataclass(frozen=True)
class PartData:
    """Thickness [m] and metal of a part."""

    thickness: float
    material: TargetMaterial


def assembled(
    parts: PartMesh, data: Mapping[str, PartData], supports: Mapping[str, EdgeStiffness], damping: float = 0.0
) -> Target:
    """The target, at rest. Raises UserError for springs on nodes that are not on a free edge."""
    mesh = shells_of(parts)
    each = [data[name] for name in parts.parts]
    sections = [Section(one.thickness, one.material.density, one.material.row()) for one in each]
    block = ShellBlock(parts.nodes, parts.quads, sections, parts.part, scaled_inertia=True)
    share = held_lengths(parts, [parts.sets[name] for name in supports])
    held = Supports(mesh, {name: held_set(parts, name, stiffness, share) for name, stiffness in supports.items()})
    rigid = np.array([not one.material.moves for one in each])[parts.part]
    if rigid.any():
        held.hold_globally(np.unique(parts.quads[rigid]), EVERYTHING)
    return Target(mesh, Nodes(parts.nodes, damping), [block], held)


def shells_of(parts: PartMesh) -> ShellMesh:
    """The shells with the facets of each part."""
    facets = {name: np.flatnonzero(parts.part == number) for number, name in enumerate(parts.parts)}
    return replace(shell_mesh(parts.nodes, parts.quads), parts=facets)


def held_lengths(parts: PartMesh, sets: list[NDArray[np.int64]]) -> Array:
    """Length of free border that belongs to each node (m,) [m]: half of either side between two nodes that are held."""
    sides, count = np.unique(np.sort(sides_of(parts.quads), axis=1), axis=0, return_counts=True)
    held = np.isin(sides, np.concatenate([*sets, np.empty(0, np.int64)])).all(axis=1)
    sides = sides[(count == 1) & held]
    length = np.linalg.norm(parts.nodes[sides[:, 0]] - parts.nodes[sides[:, 1]], axis=1)
    return np.bincount(sides.ravel(), np.repeat(0.5 * length, 2), minlength=len(parts.nodes)).astype(np.float64)


def held_set(parts: PartMesh, name: str, stiffness: EdgeStiffness, share: Array) -> Held:
    """A set of nodes held alike, with its lengths of border. Raises UserError for springs on nodes that have none."""
    nodes = parts.sets[name]
    if stiffness not in NAMED.values() and not share[nodes].all():
        lone = int(np.count_nonzero(share[nodes] == 0.0))
        raise UserError(
            f"target.supports.{name}: springs are given per length of edge, and {lone} of its {len(nodes)} nodes lie "
            'on no free edge that is held; hold it rigidly ("clamped" or "pinned") or choose a set of edge nodes'
        )
    return Held(nodes, stiffness, share[nodes])
