"""How a plate is held at its edge: rigidly, by springs, or not at all."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.errors import UserError
from birdstrike.data.histories import Array
from birdstrike.solver.kernels.plate_edges import edge_spring_forces
from birdstrike.solver.plate.mesh import PlateMesh

RIGID = np.inf
DISPLACEMENTS, ROTATIONS = 7, 56  # bits of all displacements and all rotations, see kernels/plate_motion


@dataclass(frozen=True)
class EdgeStiffness:
    """Stiffness of the frame per length of edge; infinite: held rigidly, 0: free.

    in_plane, transverse: along and across the surface [N/m per m = Pa]; rotational [N m/rad per m = N/rad], alike about
    all axes.
    """

    in_plane: float = RIGID
    transverse: float = RIGID
    rotational: float = RIGID

    def released(self) -> EdgeStiffness:
        """The same springs with the rigid holds taken away."""
        freed = {k: 0.0 for k in ("in_plane", "transverse", "rotational") if np.isinf(getattr(self, k))}
        return replace(self, **freed)


NAMED = {
    "clamped": EdgeStiffness(),
    "pinned": EdgeStiffness(rotational=0.0),
    "free": EdgeStiffness(0.0, 0.0, 0.0),
}


class Edges:
    """Springs of a rim and the freedoms that it holds.

    held (m,): bits of held freedoms per node in its own axes, axes (m, 3, 3) as rows, the third the shell's normal on
    the rim; displacement (r, 6) [m, rad] and force (r, 6) [N, N m] of the rim's springs.
    """

    def __init__(self, mesh: PlateMesh, stiffness: EdgeStiffness) -> None:
        self.stiffness, self.nodes = stiffness, mesh.rim
        self.normal = mesh.normals()[mesh.rim]
        each = np.array([stiffness.in_plane, stiffness.transverse, stiffness.rotational])
        self.springs = np.outer(mesh.edge_lengths(), np.where(np.isinf(each), 0.0, each))
        self.sprung = bool(self.springs.any())
        self.pull = np.zeros((len(mesh.rim), 3))
        self.held = np.zeros(len(mesh.nodes), np.int64)
        self.held[mesh.rim] = 3 * np.isinf(each[0]) + 4 * np.isinf(each[1]) + ROTATIONS * np.isinf(each[2])
        self.axes = np.tile(np.eye(3), (len(mesh.nodes), 1, 1))
        self.axes[mesh.rim] = tangent_frames(self.normal)
        self.relax()

    def hold(self, nodes: NDArray[np.int64], bits: int) -> None:
        """Hold freedoms of `nodes` (any, not only the rim's) in global axes: bits 1, 2, 4 along and 8, 16, 32 about.

        For meshes whose border is not held alike everywhere, such as symmetry planes and diaphragms.
        """
        self.axes[nodes] = np.eye(3)
        self.held[nodes] |= bits

    def relax(self) -> None:
        """Springs at rest, with no force but what balances a preload."""
        self.displacement = np.zeros((len(self.nodes), 6))
        self.force = np.zeros((len(self.nodes), 6))
        self.force[:, :3] = self.pull

    def balance(self, nodal: Array) -> None:
        """Let the springs pull against the internal forces (m, 6) [N] of a preload; raises UserError if none can.

        A rigid hold needs no spring; a free edge cannot hold a preload.
        """
        pull = -nodal[self.nodes, :3]
        if np.isinf(self.stiffness.in_plane):
            return
        if self.stiffness.in_plane == 0.0 and np.abs(pull).max() > 0.0:
            raise UserError(
                "plate.preload needs edges that hold it in the plane; give plate.edges.in_plane a stiffness"
            )
        along = (pull * self.normal).sum(axis=1, keepdims=True)
        self.pull = pull - along * self.normal
        self.relax()

    def update_forces(self, v: Array, omega: Array, dt: float, nodal: Array) -> float:
        """Springs' forces join `nodal` (m, 6); returns the energy that they took over the step that ended [J]."""
        if not self.sprung:
            return 0.0
        motion = (v, omega, dt, self.displacement, self.force, nodal)
        return edge_spring_forces(self.nodes, self.normal, self.springs, self.pull, *motion)

    def add_to_frame(self, x: Array, result: Array) -> None:
        """What the springs pull the frame with: force [N] and moment about the origin [N m], added to (6,)."""
        if self.sprung:
            force = -self.force[:, :3]
            result[:3] += force.sum(axis=0)
            result[3:] += np.cross(x[self.nodes], force).sum(axis=0) - self.force[:, 3:].sum(axis=0)


def tangent_frames(normal: Array) -> Array:
    """Orthonormal axes (r, 3, 3) as rows, the third along the normals (r, 3)."""
    helper = np.where(np.abs(normal[:, :1]) < 0.9, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
    first = helper - (helper * normal).sum(axis=1, keepdims=True) * normal
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, np.cross(normal, first), normal], axis=1)
