"""Ties: nodes that follow the shells of another part, as a weld or a bond without strength would make them.

A tied node has no mass of its own: its mass, its inertia and the forces on it belong to the nodes that it follows, with
the arm from their mean to it, so that linear and angular momentum are kept.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.errors import UserError
from birdstrike.data.histories import Array
from birdstrike.solver.kernels.target.links import follow_nodes, share_follower_forces
from birdstrike.solver.target.links.anchors import Anchors, Surface, weights_of_line
from birdstrike.solver.target.mesh import border_sides
from birdstrike.solver.target.nodes import Nodes
from birdstrike.solver.target.part_mesh import PartMesh

if TYPE_CHECKING:
    from scipy.sparse import csc_array


@dataclass(frozen=True)
class TieData:
    """Nodes of the set `nodes` follow the part `onto` where they lie within `distance` [m] of its mid-surface."""

    nodes: str
    onto: str
    distance: float


class Ties:
    """All ties of a target; followers (k,), anchors of each, arm (k, 3) [m] from the anchors' means."""

    def __init__(self, followers: NDArray[np.int64], anchors: Anchors, rest: Array) -> None:
        self.followers, self.anchors = followers, anchors
        self.arm = rest[followers] - anchors.means(rest)

    @property
    def followed(self) -> dict[int, NDArray[np.int64]]:
        """The nodes that each follower follows."""
        rows = np.split(self.anchors.member, self.anchors.start[1:-1])
        return dict(zip(self.followers.tolist(), rows, strict=True))

    def again(self, rest: Array) -> Ties:
        """The same at rest."""
        return Ties(self.followers, self.anchors, rest)

    def take_mass(self, nodes: Nodes) -> None:
        """Mass and inertia of the followers go to the nodes that they follow. Raises UserError where some get none."""
        start, member, weight = self.anchors.packed
        row = np.repeat(np.arange(len(self.followers)), np.diff(start))
        mass, inertia = nodes.mass[self.followers], nodes.inertia[self.followers]
        turning = inertia + mass * (self.arm**2).sum(axis=1)
        np.add.at(nodes.mass, member, weight * mass[row])
        np.add.at(nodes.inertia, member, weight * turning[row])
        if min(nodes.mass[member].min(), nodes.inertia[member].min()) <= 0.0:
            raise UserError(
                "a tie leaves a node of the part it hangs on without mass: its mesh is much finer than the tied one; "
                "tie the finer part onto the coarser one"
            )
        nodes.mass[self.followers] = nodes.inertia[self.followers] = 0.0

    def share_forces(self, nodal: Array, applied: Array) -> None:
        """Forces on the followers pass on; nodal (m, 6), applied (m, 3), both changed."""
        share_follower_forces(self.followers, *self.anchors.packed, self.arm, nodal, applied)

    def follow(self, nodes: Nodes, drift: float) -> None:
        """The followers move with the others over drift [s]."""
        follow_nodes(self.followers, *self.anchors.packed, drift, self.arm, nodes.v, nodes.omega, nodes.x)

    def matrix(self, m: int) -> csc_array:
        """Freedoms of all nodes (6 m, 6 m) by those of the nodes that follow none, small motions."""
        from scipy.sparse import coo_array, csc_array  # late: the time loop needs none

        own = np.setdiff1d(np.arange(m), self.followers)
        freedom = (6 * own[:, None] + np.arange(6)).ravel()
        rows, columns = [freedom], [freedom]
        values: list[Array] = [np.ones(len(freedom))]
        start, member, weight = self.anchors.packed
        row = np.repeat(np.arange(len(self.followers)), np.diff(start))
        for c in range(3):
            d, e = (c + 1) % 3, (c + 2) % 3
            to, arm = 6 * self.followers[row] + c, self.arm[row]
            for column, value in (
                (c, weight),
                (3 + d, weight * arm[:, e]),
                (3 + e, -weight * arm[:, d]),
            ):
                rows.append(to)
                columns.append(6 * member + column)
                values.append(value)
            rows.append(to + 3)
            columns.append(6 * member + 3 + c)
            values.append(weight)
        flat = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
        return csc_array(coo_array(flat, shape=(6 * m, 6 * m)))


def ties_of(parts: PartMesh, said: dict[str, TieData], held: NDArray[np.bool_]) -> Ties | None:
    """The ties of a target; held (m,): nodes that a support holds, which follow nothing. None where there are none.

    Raises UserError for a tie that ties nothing, and for chains of ties.
    """
    rows: dict[int, dict[int, float]] = {}
    for name, tie in said.items():
        found = _one(parts, name, tie, held)
        again = rows.keys() & found.keys()
        if again:
            raise UserError(f"target.ties.{name} ties {len(again)} nodes that another tie has already; leave one out")
        rows |= found
    followed = {node for row in rows.values() for node in row}
    chained = rows.keys() & followed
    if chained:
        raise UserError(
            f"target.ties: {len(chained)} nodes follow one part and are followed by others; tie all of them onto the "
            "one part that follows nothing"
        )
    if not rows:
        return None
    order = sorted(rows)
    return Ties(np.array(order, np.int64), Anchors.of(rows[node] for node in order), parts.nodes)


def distances(parts: PartMesh, surface: Surface, nodes: str) -> tuple[NDArray[np.int64], Array]:
    """Nodes of a set that are not the surface's own, and how far each is from it [m]."""
    own = np.setdiff1d(parts.sets[nodes], surface.quads)
    return own, np.array([surface.foot(parts.nodes[node]).distance for node in own])


def _one(parts: PartMesh, name: str, tie: TieData, held: NDArray[np.bool_]) -> dict[int, dict[int, float]]:
    """Weights of every node that one tie ties."""
    surface = Surface.of(parts, tie.onto)
    own, away = distances(parts, surface, tie.nodes)
    if not len(own):
        raise UserError(
            f"target.ties.{name}: all nodes of {tie.nodes} belong to {tie.onto} itself; name a set of the part that is "
            "to follow it"
        )
    near = own[away <= tie.distance]
    if not len(near):
        raise UserError(
            f"target.ties.{name}: no node of {tie.nodes} lies within distance = {1e3 * tie.distance:.4g} mm of "
            f"{tie.onto}; raise target.ties.{name}.distance, or name another set"
        )
    near = near[~held[near]]
    if not len(near):
        raise UserError(
            f"target.ties.{name}: every node of {tie.nodes} near {tie.onto} is held by target.supports and can follow "
            "nothing; name another set, or hold fewer"
        )
    border = border_sides(parts.quads[parts.part != parts.parts.index(tie.onto)])
    border = border[np.isin(border, near).all(axis=1)]
    return weights_of_line(surface, parts.nodes, border, near)
