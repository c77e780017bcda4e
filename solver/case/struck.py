"""The plane that a bird strikes, by which its normal speed, its stand-off and the contact force count.

That of a plate and of a target by a generator is z = 0, the crown's tangent where they are curved. That of a mesh from
a file is the tangent plane of the struck part nearest to the point of aim, for a file's shells may lie anyhow; z = 0
where they lie level there, and where they stand along the flight, so that their edge is struck.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.histories import Array
from birdstrike.solver.case.sections import Impact
from birdstrike.solver.case.target import Target
from birdstrike.solver.target.mesh import LEVEL, ShellMesh, vector_areas
from birdstrike.solver.target.part_mesh import PartMesh

EDGE_ON = 0.2
"""Cosine of a shell's normal to the flight below which the bird meets its edge."""
HORIZONTAL = 1.0 - 1e-9
"""Of a normal's component along z from which on shells lie level: files round their nodes."""
AT_A_CORNER = 1e-9
"""Share of a shell's size within which a point is its corner."""
ALIKE = 1e-6
"""Of cosines: shells that lie as one shell does and as another."""
UP = np.array([0.0, 0.0, 1.0])
MOST_KEPT = 8
"""Points of aim of which the shells are kept."""


@dataclass(frozen=True)
class Plane:
    """point (3,) [m] of it; axes (3, 3): along length and width, and the normal, which points against the flight."""

    point: Array
    axes: Array

    @property
    def normal(self) -> Array:
        """Unit vector, (3,)."""
        return self.axes[2]

    def seen(self, points: Array) -> Array:
        """Points (n, 3) [m] in the plane's own axes, from its point."""
        return (points - self.point) @ self.axes.T


def direction_of(impact: Impact) -> Array:
    """Unit vector of the velocity, (3,)."""
    direction = np.array([math.cos(impact.angle), 0.0, -math.sin(impact.angle)])
    return direction @ about_z(impact.heading) if impact.heading else direction


def about_z(heading: float) -> Array:
    """What turns row vectors about z by an angle [rad]."""
    if not heading:
        return np.eye(3)
    c, s = math.cos(heading), math.sin(heading)
    return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


def point_of_aim(impact: Impact) -> Array:
    """What the case names of the aim, (3,) [m]: `offset`, from `point` where there is one."""
    start = np.array([*impact.offset, 0.0])
    if impact.point is not None:
        start += impact.point
    return start


def shells_at_rest(target: Target) -> ShellMesh:
    """The shells of a target that a bird can hit, at rest."""
    from birdstrike.solver.target.assembled import shells_of  # late: it brings in compiled kernels

    return shells_of(target.source.mesh(), target.metals)


class ShellsAtAim(NamedTuple):
    """What a bird that is aimed at a mesh from a file finds there.

    point (3,) [m]: of the struck part, nearest to the aim; normals (k, 3): of all shells that hold it; own (k,):
    whether they are of the struck part; angles (k,) [rad]: that each of them spans about it; areas (n, 3) [m^2]: vector
    areas of the struck part's shells that hold it and of those that share a node with them.
    """

    point: Array
    normals: Array
    own: NDArray[np.bool_]
    angles: Array
    areas: Array


def shells_at_aim(impact: Impact, target: Target | None) -> ShellsAtAim | None:
    """Of a mesh from a file; None of anything else."""
    if target is None or target.mesh is None:
        return None
    x, y, z = point_of_aim(impact).tolist()
    return _shells_near(target.source.mesh(), target.struck_name, (x, y, z))


@lru_cache(maxsize=MOST_KEPT)
def _shells_near(parts: PartMesh, struck: str, aim: tuple[float, float, float]) -> ShellsAtAim:
    """As `shells_at_aim`; kept by the mesh itself (a file that has changed gives another), the part and the aim."""
    from birdstrike.solver.sensors.places import facets_around, normal_of, place_in_space, point_at  # late: kernels

    mesh, own = parts.shells, parts.part == parts.parts.index(struck)
    place = place_in_space(mesh, np.array(aim), struck)
    holding, near = (facets_around(mesh.quads, place, rings) for rings in (0, 1))
    areas = vector_areas(mesh.nodes, mesh.quads[near[own[near]]])
    normals = np.array([normal_of(mesh, facet) for facet in holding])
    point = point_at(mesh, *place)
    angles = np.array([angle_about(point, mesh.nodes[mesh.quads[facet]]) for facet in holding])
    return ShellsAtAim(point, normals, own[holding], angles, areas)


def angle_about(point: Array, corners: Array) -> float:
    """What a shell of these corners (4, 3) spans about a point (3,) of its border: pi on a side, at a corner its angle.

    That is what the other sides are seen under from there; the side that holds the point, or the line between the ends
    of the two that do, is seen under as much as all of them.
    """
    away = corners - point
    size = np.linalg.norm(away, axis=1)
    away = away[size > AT_A_CORNER * size.max()]
    beside = np.roll(away, -1, axis=0)
    cosine = (away * beside).sum(axis=1) / np.linalg.norm(away, axis=1) / np.linalg.norm(beside, axis=1)
    angles = np.arccos(np.clip(cosine, -1.0, 1.0))
    return float(angles.sum() - angles.max())


def meets_edge(impact: Impact, target: Target | None) -> bool:
    """Whether a mesh from a file is aimed at where all its shells stand along the flight: the edge of a rib."""
    found = shells_at_aim(impact, target)
    return found is not None and stand_along(found.normals, direction_of(impact))


def stand_along(normals: Array, direction: Array) -> bool:
    """Whether all shells of these normals (k, 3) do so."""
    return bool((np.abs(normals @ direction) < EDGE_ON).all())


def struck_plane(impact: Impact, target: Target | None) -> Plane | None:
    """The plane that a bird strikes; None where it is z = 0.

    Its normal is the mean, weighted by area, over the struck part's shells around the aim that are one surface with
    that there. Vector areas sum to what their common border encloses: a node that lies wrong inside of it tilts
    nothing. Where several shells hold the aim, on a ridge, each has such a mean of those that lie as it does, and these
    count by the angles that the shells span there: the mean over a small circle, whatever the shells' sizes. A web that
    stands on the surface there, and is not level with the mean as others are, does not count.
    """
    found, direction = shells_at_aim(impact, target), direction_of(impact)
    if found is None or stand_along(normals := found.normals[found.own], direction):
        return None
    facing, angles = np.where(normals @ direction > 0.0, -1.0, 1.0)[:, None] * normals, found.angles[found.own]
    there = angles @ facing
    level = np.abs(facing @ there) > LEVEL * np.linalg.norm(there)
    if level.any():
        facing, angles = facing[level], angles[level]
    cosine = found.areas @ facing.T / np.linalg.norm(found.areas, axis=1, keepdims=True)
    most = np.abs(cosine).max(axis=1, keepdims=True)
    flank = (np.abs(cosine) > np.maximum(LEVEL, most - ALIKE)) * np.sign(cosine)
    means = flank.T @ found.areas
    normal = angles @ (means / np.linalg.norm(means, axis=1, keepdims=True))
    normal /= np.linalg.norm(normal)
    return None if normal[2] > HORIZONTAL else Plane(found.point, turned_to(normal))


def turned_to(normal: Array) -> Array:
    """Axes (3, 3) of which the last is the normal (3,): those of space turned to it by the least angle."""
    x, y, z = normal
    if z < -HORIZONTAL:
        return np.diag([1.0, -1.0, -1.0])
    share = 1.0 / (1.0 + z)
    return np.array([[1.0 - share * x * x, -share * x * y, -x], [-share * x * y, 1.0 - share * y * y, -y], [x, y, z]])
