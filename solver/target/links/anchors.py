"""Anchors on a part: the nodes and weights with which a point, or a line of nodes, hangs on its shells."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.histories import Array
from birdstrike.solver.kernels.contact.contact import bilinear, clamp_to_facet, foot_on_facet
from birdstrike.solver.target.mesh import border_sides, reach_of, vector_areas
from birdstrike.solver.target.part_mesh import PartMesh

ROUNDED = 1.0 + 1e-9
ON_EDGE = 1e-9
"""Weight of a corner below which a foot lies on the side or at the corner opposite."""
SAMPLES = 9
"""Places along an edge between which a crossing from one facet to the next is looked for."""
POINTS, SHARES = np.polynomial.legendre.leggauss(3)


@dataclass(frozen=True)
class Foot:
    """The nearest place of a surface: its corners (4,), their weights (4,), the way from the point [m], unit normal."""

    nodes: NDArray[np.int64]
    weights: Array
    distance: float
    normal: Array
    facet: int

    def row(self) -> dict[int, float]:
        """Weight of each node, together 1: the last corner of a triangle is there twice, and has both shares."""
        found: dict[int, float] = {}
        for node, weight in zip(self.nodes, self.weights, strict=True):
            if weight:
                found[int(node)] = found.get(int(node), 0.0) + float(weight)
        return found


class Surface:
    """Shells of one part, to find places on."""

    def __init__(self, nodes: Array, quads: NDArray[np.int64]) -> None:
        from scipy.spatial import KDTree  # late: few targets have ties or rivets

        self.nodes, self.quads = nodes, quads
        self.centres = nodes[quads].mean(axis=1)
        self.reach = reach_of(nodes, quads, self.centres)
        self.tree, self.farthest = KDTree(self.centres), float(self.reach.max())
        self.border = border_sides(quads)

    @classmethod
    def of(cls, mesh: PartMesh, part: str) -> Surface:
        """Of a part by its name."""
        return cls(mesh.nodes, mesh.quads[mesh.part == mesh.parts.index(part)])

    def foot(self, point: Array) -> Foot:
        """The place nearest to a point (3,) [m]."""
        best: Foot | None = None
        for facet in self._near(point):
            foot, quad = np.zeros(6), self.quads[facet]
            if not foot_on_facet(point, self.nodes, quad, foot):
                continue
            clamp_to_facet(point, self.nodes, quad, foot)
            weights = np.array(bilinear(foot[0], foot[1]))
            way = float(np.linalg.norm(point - weights @ self.nodes[quad]))
            if best is None or way < best.distance - 1e-12:
                vector = vector_areas(self.nodes, quad)
                best = Foot(quad, weights, way, vector / np.linalg.norm(vector), int(facet))
        assert best is not None, "a part has shells of some area"
        return best

    def on_border(self, foot: Foot) -> bool:
        """Whether a foot lies on the free border of the part."""
        corners = np.unique(foot.nodes[foot.weights > ON_EDGE])
        return len(corners) < 3 and bool(np.isin(self.border, corners).sum(axis=1).max(initial=0) >= len(corners))

    def _near(self, point: Array) -> NDArray[np.int64]:
        """The facets that can be as near as the nearest centre is, by the distance of their own."""
        least = ROUNDED * float(self.tree.query(point)[0])
        found = np.array(self.tree.query_ball_point(point, least + self.farthest, return_sorted=True))
        away = np.linalg.norm(self.centres[found] - point, axis=1)
        able = away - self.reach[found] <= least
        return found[able][np.argsort(away[able], kind="stable")]


@dataclass(frozen=True)
class Anchors:
    """Rows of nodes and weights as the kernels read them, see `kernels.target.links`."""

    start: NDArray[np.int64]
    member: NDArray[np.int64]
    weight: Array

    @classmethod
    def of(cls, rows: Iterable[Mapping[int, float]]) -> Anchors:
        """From the weight of each node, row by row."""
        listed = [sorted(row.items()) for row in rows]
        flat = [entry for row in listed for entry in row]
        start = np.concatenate([[0], np.cumsum([len(row) for row in listed])]).astype(np.int64)
        return cls(start, np.array([n for n, _ in flat], np.int64), np.array([w for _, w in flat], np.float64))

    @property
    def packed(self) -> tuple[NDArray[np.int64], NDArray[np.int64], Array]:
        return self.start, self.member, self.weight

    def pairs(self, ends: NDArray[np.int64]) -> NDArray[np.int64]:
        """Node `ends` (k,) of each row beside each of its own nodes, (n, 2)."""
        return np.column_stack([np.repeat(ends, np.diff(self.start)), self.member])

    def means(self, values: Array) -> Array:
        """Weighted means of rows (m, 3), (k, 3)."""
        parts = self.weight[:, None] * values[self.member]
        return np.add.reduceat(parts, self.start[:-1], axis=0) if len(self.start) > 1 else np.empty((0, 3))


def weights_of_line(
    surface: Surface, nodes: Array, edges: NDArray[np.int64], followers: NDArray[np.int64]
) -> dict[int, dict[int, float]]:
    """Weights with which the ends of `edges` (k, 2), and lone `followers`, hang on a surface.

    Along edges the displacement is the projection of the surface's own by dual shape functions (B. I. Wohlmuth, SIAM J.
    Numer. Anal. 38 (2000) 989), integrated piece by piece between the surface's own nodes: constant strain passes
    a joint of meshes that do not match, which hanging each node on the facet under it does not let it. Nodes on no edge
    take the facet under them.
    """
    length = dict.fromkeys((int(node) for node in followers), 0.0)
    rows: dict[int, dict[int, float]] = {node: {} for node in length}
    for one, other in edges:
        ends = nodes[one], nodes[other]
        size = float(np.linalg.norm(ends[1] - ends[0]))
        for low, high in _pieces(surface, ends):
            for t, share in zip(0.5 * (low + high) + 0.5 * (high - low) * POINTS, 0.5 * SHARES, strict=True):
                foot, step = surface.foot((1.0 - t) * ends[0] + t * ends[1]), share * (high - low) * size
                for node, own, dual in ((int(one), 1.0 - t, 2.0 - 3.0 * t), (int(other), t, 3.0 * t - 1.0)):
                    length[node] += step * own
                    for corner, weight in zip(foot.nodes, foot.weights, strict=True):
                        rows[node][int(corner)] = rows[node].get(int(corner), 0.0) + step * dual * float(weight)
    for node, row in rows.items():
        if length[node] > 0.0:
            rows[node] = {corner: weight / length[node] for corner, weight in row.items() if weight}
        else:
            rows[node] = surface.foot(nodes[node]).row()
    return rows


def _pieces(surface: Surface, ends: tuple[Array, Array]) -> list[tuple[float, float]]:
    """Stretches of an edge that lie over one facet each, as shares of its length."""
    places = np.linspace(0.0, 1.0, SAMPLES)

    def over(t: float) -> int:
        return surface.foot((1.0 - t) * ends[0] + t * ends[1]).facet

    cuts, facets = [0.0], [over(float(t)) for t in places]
    for i in range(SAMPLES - 1):
        low, high, before = float(places[i]), float(places[i + 1]), facets[i]
        if before == facets[i + 1]:
            continue
        for _ in range(50):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if over(middle) == before else (low, middle)
        cuts.append(0.5 * (low + high))
    cuts.append(1.0)
    return [(low, high) for low, high in pairwise(cuts) if high - low > 1e-12]
