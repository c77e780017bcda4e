"""A target from a mesh of named parts: their thickness and metal, and how sets of its nodes are held."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from birdstrike.data.errors import UserError
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
    held = Supports(mesh, {name: held_set(mesh, parts, name, stiffness) for name, stiffness in supports.items()})
    rigid = np.array([not one.material.moves for one in each])[parts.part]
    if rigid.any():
        held.hold_globally(np.unique(parts.quads[rigid]), EVERYTHING)
    return Target(mesh, Nodes(parts.nodes, damping), [block], held)


def shells_of(parts: PartMesh) -> ShellMesh:
    """The shells with the facets of each part."""
    facets = {name: np.flatnonzero(parts.part == number) for number, name in enumerate(parts.parts)}
    return replace(shell_mesh(parts.nodes, parts.quads), parts=facets)


def held_set(mesh: ShellMesh, parts: PartMesh, name: str, stiffness: EdgeStiffness) -> Held:
    """A set of nodes held alike, with the length of free edge that belongs to each where springs need it."""
    nodes = parts.sets[name]
    if stiffness in NAMED.values():
        return Held(nodes, stiffness, np.zeros(len(nodes)))
    share = np.zeros(len(mesh.nodes))
    ends = sides_of(mesh.quads)[mesh.across.ravel() < 0]
    ends = ends[np.isin(ends, nodes).all(axis=1)]
    length = np.linalg.norm(mesh.nodes[ends[:, 0]] - mesh.nodes[ends[:, 1]], axis=1)
    np.add.at(share, ends.ravel(), np.repeat(0.5 * length, 2))
    if not share[nodes].all():
        lone = int(np.count_nonzero(share[nodes] == 0.0))
        raise UserError(
            f"target.supports.{name}: springs are given per length of edge, and {lone} of its {len(nodes)} nodes lie "
            'on no free edge of the set; hold it rigidly ("clamped" or "pinned") or choose a set of edge nodes'
        )
    return Held(nodes, stiffness, share[nodes])
