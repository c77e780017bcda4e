"""Places on a shell: the facet under a point, and what is known at facets' centres brought to it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.histories import Array
from birdstrike.solver.kernels.contact.contact import bilinear, clamp_to_facet, foot_on_facet
from birdstrike.solver.target.mesh import ShellMesh, centres_of, reach_of, vector_areas

INSIDE = ROUNDED = 1.0 + 1e-9
PARALLEL = 0.01
"""Component of a shell's normal below which the shell is taken as parallel to that axis: files round their nodes."""
AT_A_NODE = 1e-9
"""Share of a node below which a point lies on the side or the nodes opposite."""


def place_on(mesh: ShellMesh, at: tuple[float, float]) -> tuple[int, float, float]:
    """Facet, xi and eta of the point at (x, y) [m] along length and width of the undeformed shell (`mesh.surface`).

    Where the shell has several points there, the highest, which is on the impact side; beside the shell, the nearest
    of the nearest facet.
    """
    corners, heights = mesh.surface[mesh.quads], mesh.nodes[mesh.quads, 2]
    low, high = corners.min(axis=1), corners.max(axis=1)
    outside = np.maximum(np.maximum(low - at, at - high), 0.0).sum(axis=1)
    near = np.flatnonzero(outside <= outside.min() + 1e-12)
    plan = np.array([in_plan(corners[element], np.array(at)) for element in near])
    reach = np.abs(plan).max(axis=1)
    holding = near[reach <= max(INSIDE, float(reach.min()))]
    element = int(holding[np.argmax(heights[holding].max(axis=1))])
    xi, eta = np.clip(plan[near == element][0], -1.0, 1.0)
    return element, float(xi), float(eta)


def in_plan(corners: Array, point: Array, iterations: int = 20) -> Array:
    """(xi, eta) of a point (2,) in a facet (4, 2), by Newton's iteration from the middle of a quadrilateral."""
    if (corners[2] == corners[3]).all():
        foot, flat = np.zeros(6), np.column_stack([corners, np.zeros(4)])
        foot_on_facet(np.append(point, 0.0), flat, np.array([0, 1, 2, 2]), foot)
        return foot[:2]
    where = np.zeros(2)
    for _ in range(iterations):
        xi, eta = where
        slopes = 0.25 * np.array(
            [[eta - 1.0, 1.0 - eta, 1.0 + eta, -1.0 - eta], [xi - 1.0, -1.0 - xi, 1.0 + xi, 1.0 - xi]]
        )
        step = np.linalg.lstsq((slopes @ corners).T, point - np.array(bilinear(xi, eta)) @ corners, rcond=None)[0]
        where = np.clip(where + step, -3.0, 3.0)
        if np.abs(step).max() < 1e-13:
            break
    return where


def point_at(mesh: ShellMesh, element: int, xi: float, eta: float, points: Array | None = None) -> Array:
    """The point itself, (3,) [m]; points (m, d): other coordinates of the nodes, such as `mesh.surface`."""
    return np.array(bilinear(xi, eta)) @ (mesh.nodes if points is None else points)[mesh.quads[element]]


def tangents(mesh: ShellMesh, element: int) -> Array | None:
    """Unit vectors (2, 3) in a facet: along the length of `mesh.surface`, and across it on the width's side.

    None where it stands upright, so that length and width do not span it.
    """
    if abs(normal_of(mesh, element)[2]) < PARALLEL:
        return None
    corners = mesh.quads[element]
    flat, points = mesh.surface[corners], mesh.nodes[corners]
    slopes = np.linalg.lstsq(flat - flat.mean(axis=0), points - points.mean(axis=0), rcond=None)[0]
    first = slopes[0] / np.linalg.norm(slopes[0])
    second = slopes[1] - (slopes[1] @ first) * first
    return np.stack([first, second / np.linalg.norm(second)])


def normal_of(mesh: ShellMesh, element: int) -> Array:
    """Unit normal (3,) of a facet."""
    vector = vector_areas(mesh.nodes, mesh.quads[element])
    return vector / np.linalg.norm(vector)


def facing(normal: Array) -> int:
    """1 where a shell's normal (3,) points to its impact side, else -1: towards z, of an upright shell x, or else y."""
    for component in (normal[2], normal[0], normal[1]):
        if abs(component) > PARALLEL:
            return 1 if component > 0.0 else -1
    raise AssertionError("a unit vector has a component that is not small")


def place_in_space(mesh: ShellMesh, point: Array, part: str | None = None) -> tuple[int, float, float]:
    """Facet, xi and eta of the place on the shells at rest, of one part or of all, that is nearest to a point (3,)."""
    facets = np.arange(len(mesh.quads)) if part is None else mesh.parts[part]
    middles = centres_of(mesh.nodes, mesh.quads[facets])
    away = np.linalg.norm(middles - point, axis=1)
    reach = reach_of(mesh.nodes, mesh.quads[facets], middles)
    near = facets[away - reach <= ROUNDED * away.min()]
    found = []
    for facet in near:
        foot = np.zeros(6)
        if foot_on_facet(point, mesh.nodes, mesh.quads[facet], foot):
            clamp_to_facet(point, mesh.nodes, mesh.quads[facet], foot)
            found.append((abs(float(foot[2])), int(facet), float(foot[0]), float(foot[1])))
    return min(found)[1:]


def facets_around(quads: NDArray[np.int64], where: tuple[int, float, float], rings: int = 2) -> NDArray[np.int64]:
    """The facets that hold a point (facet, xi, eta), all that meet where it lies on a side or a node, and rings.

    A ring: those that share a node with the ones before.
    """
    element, xi, eta = where
    corners = quads[element]
    weights = np.array([sum(bilinear(xi, eta)[i] for i in np.flatnonzero(corners == node)) for node in corners])
    patch = np.flatnonzero(np.stack([(quads == node).any(axis=1) for node in corners[weights > AT_A_NODE]]).all(axis=0))
    for _ in range(rings):
        patch = np.flatnonzero(np.isin(quads, quads[patch]).any(axis=1))
    return patch


def blend(offsets: Array) -> Array:
    """Weights (k,) that bring values at `offsets` (k, 2) from a point to the point itself.

    Least squares by a quadratic, the near ones weighing most: exact for fields that are quadratic in the offsets where
    the facets allow it (three by three do), linear or constant where they do not.
    """
    size = np.sqrt((offsets**2).sum(axis=1).mean()) or 1.0
    x, y = (offsets / size).T
    trust = 1.0 / (0.05 + x * x + y * y) ** 2
    basis = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y])
    for terms in (6, 3, 1):
        normal = (basis[:terms] * trust) @ basis[:terms].T
        if np.linalg.cond(normal) < 1e8:
            return trust * (np.linalg.solve(normal, basis[:terms])[0])
    raise AssertionError("a single value always has an average")
