"""The plane that a bird strikes, by which its normal speed, its stand-off and the contact force count.

That of a plate and of a target by a generator is z = 0, the crown's tangent where they are curved. That of a mesh from
a file is the tangent plane of the struck part nearest to the point of aim, for a file's shells may lie anyhow; z = 0
where they lie level there, and where they stand along the flight, so that their edge is struck.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.histories import Array
from birdstrike.solver.case.sections import Impact
from birdstrike.solver.case.target import Target
from birdstrike.solver.target.mesh import ShellMesh

EDGE_ON = 0.2
"""Cosine of a shell's normal to the flight below which the bird meets its edge."""
LEVEL = 1.0 - 1e-9
"""Of a normal's component along z from which on shells lie level: files round their nodes."""
UP = np.array([0.0, 0.0, 1.0])


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


def shells_at_aim(impact: Impact, target: Target | None) -> tuple[Array, Array, NDArray[np.bool_]] | None:
    """Of a mesh from a file the point of its struck part that is nearest to the aim (3,) [m], and the shells there.

    Those are told by their normals (k, 3), and whether they are of the struck part (k,). None of anything else.
    """
    if target is None or target.mesh is None:
        return None
    from birdstrike.solver.sensors.places import facets_around, normal_of, place_in_space, point_at  # late: kernels

    mesh, struck = shells_at_rest(target), target.struck_name
    place = place_in_space(mesh, point_of_aim(impact), struck)
    around = facets_around(mesh.quads, place, rings=0)
    normals = np.array([normal_of(mesh, facet) for facet in around])
    return point_at(mesh, *place), normals, np.isin(around, mesh.parts[struck])


def meets_edge(impact: Impact, target: Target | None) -> bool:
    """Whether a mesh from a file is aimed at where all its shells stand along the flight: the edge of a rib."""
    found = shells_at_aim(impact, target)
    return found is not None and stand_along(found[1], direction_of(impact))


def stand_along(normals: Array, direction: Array) -> bool:
    """Whether all shells of these normals (k, 3) do so."""
    return bool((np.abs(normals @ direction) < EDGE_ON).all())


def struck_plane(impact: Impact, target: Target | None) -> Plane | None:
    """The plane that a bird strikes; None where it is z = 0."""
    found, direction = shells_at_aim(impact, target), direction_of(impact)
    if found is None:
        return None
    point, normals = found[0], found[1][found[2]]
    if stand_along(normals, direction):
        return None
    against = np.where(normals @ direction > 0.0, -1.0, 1.0)
    normal = (against[:, None] * normals).mean(axis=0)
    normal /= np.linalg.norm(normal)
    return None if normal[2] > LEVEL else Plane(point, turned_to(normal))


def turned_to(normal: Array) -> Array:
    """Axes (3, 3) of which the last is the normal (3,): those of space turned to it by the least angle."""
    x, y, z = normal
    if z < -LEVEL:
        return np.diag([1.0, -1.0, -1.0])
    share = 1.0 / (1.0 + z)
    return np.array([[1.0 - share * x * x, -share * x * y, -x], [-share * x * y, 1.0 - share * y * y, -y], [x, y, z]])
