"""How a target is held: sets of its nodes, rigidly, by springs, or not at all."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.errors import UserError
from birdstrike.data.histories import Array
from birdstrike.solver.kernels.target.plate_edges import edge_spring_forces
from birdstrike.solver.target.mesh import LEVEL, ShellMesh
from birdstrike.solver.target.nodes import Nodes

RIGID = np.inf
DISPLACEMENTS, ROTATIONS, EVERYTHING = 7, 56, 63  # bits of held freedoms, see kernels/target/node_motion


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


@dataclass(frozen=True)
class Held:
    """A set of nodes (r,) that is held alike; length (r,): of border that belongs to each [m], for the springs.

    normal (r, 3): of the surface there, where several meet: a node is then there once for each; else the mesh's.
    """

    nodes: NDArray[np.int64]
    stiffness: EdgeStiffness
    length: Array
    normal: Array | None = None


class Supports:
    """Springs and rigid holds of sets of nodes.

    nodes (r,): of all sets, one after the other, of `sets` the rows that are each one's; normal (r, 3): of the shell
    there; held (m,): bits of held freedoms per node in its own axes, axes (m, 3, 3) as rows, the third the normal where
    one surface is held; displacement (r, 6) [m, rad] and force (r, 6) [N, N m] of the springs.
    """

    def __init__(self, mesh: ShellMesh, sets: Mapping[str, Held]) -> None:
        self.mesh, self.groups = mesh, dict(sets)
        ends = np.cumsum([0, *(len(group.nodes) for group in sets.values())])
        self.sets = {name: slice(ends[i], ends[i + 1]) for i, name in enumerate(sets)}
        self.nodes = np.concatenate([group.nodes for group in sets.values()]) if sets else np.empty(0, np.int64)
        of_mesh = mesh.normals()
        normals = [of_mesh[group.nodes] if group.normal is None else group.normal for group in sets.values()]
        self.normal = np.concatenate(normals) if sets else np.empty((0, 3))
        self.springs = np.zeros((len(self.nodes), 3))
        self.held = np.zeros(len(mesh.nodes), np.int64)
        rigid = np.zeros((len(self.nodes), 2), np.bool_)
        for name, group in sets.items():
            each = np.array([group.stiffness.in_plane, group.stiffness.transverse, group.stiffness.rotational])
            self.springs[self.sets[name]] = np.outer(group.length, np.where(np.isinf(each), 0.0, each))
            rigid[self.sets[name]] = np.isinf(each[:2])
            self.held[group.nodes] |= ROTATIONS * np.isinf(each[2])
        self.sprung = bool(self.springs.any())
        self.pull = np.zeros((len(self.nodes), 3))
        self.axes = np.tile(np.eye(3), (len(mesh.nodes), 1, 1))
        self._hold_displacements(rigid)
        self.relax()

    def _hold_displacements(self, rigid: NDArray[np.bool_]) -> None:
        """Axes and bits of nodes of which a surface is held rigidly along or across itself, rigid (r, 2).

        What is rigid for one of the surfaces and sets that meet in a node is rigid there for all of them.
        """
        rows = np.flatnonzero(rigid.any(axis=1))
        nodes, along, across = self.nodes[rows], rigid[rows, 0], rigid[rows, 1]
        self.axes[nodes] = tangent_frames(self.normal[rows])
        np.bitwise_or.at(self.held, nodes, np.where(along, 3, 0) + np.where(across, 4, 0))
        for node in repeated(nodes[~np.isin(nodes, nodes[along & across])]):
            own = nodes == node
            axes, held = held_axes(self.normal[rows[own]], along[own], across[own])
            self.axes[node] = axes
            self.held[node] = (self.held[node] & ROTATIONS) | int(held @ [1, 2, 4])

    @property
    def free(self) -> bool:
        """Whether nothing is held."""
        return not self.sprung and not self.held.any()

    def hold(self, nodes: Nodes) -> None:
        """Let the nodes share the holds, so that those added later are theirs too."""
        nodes.held, nodes.axes = self.held, self.axes

    def hold_globally(self, nodes: NDArray[np.int64], bits: int) -> None:
        """Hold freedoms of `nodes` in global axes: bits 1, 2, 4 along and 8, 16, 32 about.

        For meshes whose border is not held alike everywhere, such as symmetry planes and diaphragms.
        """
        self.axes[nodes] = np.eye(3)
        self.held[nodes] |= bits

    def released(self) -> Supports:
        """The same springs with the rigid holds taken away."""
        freed = {name: replace(group, stiffness=group.stiffness.released()) for name, group in self.groups.items()}
        return Supports(self.mesh, freed)

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
        rigid = self.held[self.nodes] & 3 == 3
        if rigid.all():
            return
        if np.abs(pull[~rigid & (self.springs[:, 0] == 0.0)]).max(initial=0.0) > 0.0:
            raise UserError(
                "plate.preload needs edges that hold it in the plane; give plate.edges.in_plane a stiffness"
            )
        along = (pull * self.normal).sum(axis=1, keepdims=True)
        self.pull = np.where(rigid[:, None], 0.0, pull - along * self.normal)
        self.relax()

    def update_forces(self, nodes: Nodes, dt: float) -> float:
        """Springs' forces join those of the nodes; returns the energy that they took over the step that ended [J]."""
        if not self.sprung:
            return 0.0
        motion = (nodes.v, nodes.omega, dt, self.displacement, self.force, nodes.nodal)
        return edge_spring_forces(self.nodes, self.normal, self.springs, self.pull, *motion)

    def reaction_of(self, name: str, nodes: Nodes, applied: Array) -> Array:
        """Force with which one set pulls the frame, (3,) [N]; a node that two sets hold counts in both."""
        rows = self.sets[name]
        own = np.unique(self.nodes[rows])
        force = nodes.nodal[own, :3] + applied[own]
        axes, bits = nodes.axes[own], nodes.held[own]
        held = ((bits[:, None] >> np.arange(3)) & 1) * np.einsum("rij,rj->ri", axes, force)
        return np.einsum("ri,rij->j", held, axes) - self.force[rows, :3].sum(axis=0)

    def add_to_frame(self, x: Array, result: Array) -> None:
        """What the springs pull the frame with: force [N] and moment about the origin [N m], added to (6,)."""
        if self.sprung:
            force = -self.force[:, :3]
            result[:3] += force.sum(axis=0)
            result[3:] += np.cross(x[self.nodes], force).sum(axis=0) - self.force[:, 3:].sum(axis=0)


def rim_supports(mesh: ShellMesh, stiffness: EdgeStiffness) -> Supports:
    """The whole free border held alike."""
    return Supports(mesh, {"edges": Held(mesh.rim, stiffness, mesh.edge_lengths())})


def repeated(nodes: NDArray[np.int64]) -> NDArray[np.int64]:
    """Those that are there more than once."""
    found, count = np.unique(nodes, return_counts=True)
    return found[count > 1]


def held_axes(normal: Array, along: NDArray[np.bool_], across: NDArray[np.bool_]) -> tuple[Array, NDArray[np.bool_]]:
    """Orthonormal axes (3, 3) as rows of a node at which surfaces are held, and which of them are held, (3,).

    normal (k, 3): of the surfaces; along, across (k,): whether each is held in its plane and normal to it. Normals of
    a cosine above `LEVEL` are one surface's, so that a bent sheet is not held along itself by its own curvature.
    """
    spans = normal[:, :, None] * normal[:, None, :]
    held = spans[across].sum(axis=0) + (np.eye(3) - spans[along]).sum(axis=0)
    size, axes = np.linalg.eigh(held)
    return axes.T, size > 1.0 - LEVEL


def tangent_frames(normal: Array) -> Array:
    """Orthonormal axes (r, 3, 3) as rows, the third along the normals (r, 3)."""
    helper = np.where(np.abs(normal[:, :1]) < 0.9, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
    first = helper - (helper * normal).sum(axis=1, keepdims=True) * normal
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, np.cross(normal, first), normal], axis=1)
