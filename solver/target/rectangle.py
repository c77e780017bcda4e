"""The plate of one block: a mesh of one thickness and one metal, held alike along its rim, or rigid."""

from __future__ import annotations

import numpy as np

from birdstrike.solver.target.assembly import Target
from birdstrike.solver.target.mesh import ShellMesh
from birdstrike.solver.target.nodes import Nodes
from birdstrike.solver.target.section import Section, ShellMaterial
from birdstrike.solver.target.shell_block import RigidShells
from birdstrike.solver.target.supports import EVERYTHING, NAMED, EdgeStiffness, Held, Supports, rim_supports
from birdstrike.solver.target.triangle_block import shell_blocks


def plate_of(
    mesh: ShellMesh,
    thickness: float,
    material: ShellMaterial,
    edges: str | EdgeStiffness = "clamped",
    damping: float = 0.0,
) -> Target:
    """Deformable plate or panel of one thickness [m].

    edges: "clamped", "pinned", "free" or springs; damping [1/s]: rate at which a free vibration's amplitude decays.
    """
    section = Section(thickness, material.density, material.row())
    supports = rim_supports(mesh, NAMED[edges] if isinstance(edges, str) else edges)
    blocks = shell_blocks(mesh.nodes, mesh.quads, [section])
    return Target(mesh, Nodes(mesh.nodes, damping), blocks, supports, one_sided=True)


def rigid_plate_of(mesh: ShellMesh, thickness: float) -> Target:
    """Plate that neither moves nor strains: it is its own frame, which feels what contact gives it."""
    everywhere = Held(np.arange(len(mesh.nodes)), NAMED["clamped"], np.zeros(len(mesh.nodes)))
    supports = Supports(mesh, {"everywhere": everywhere})
    supports.hold_globally(everywhere.nodes, EVERYTHING)
    return Target(mesh, Nodes(mesh.nodes), [RigidShells(mesh.quads, thickness)], supports, one_sided=True)
