"""All-hexahedral meshes of the idealised birds: a core of cubes wrapped in layers that end on the curved surface.

Nodes of a cell are numbered as usual: 0-3 around its low face, 4-7 around its high face, so that volumes are positive.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.errors import UserError
from birdstrike.data.histories import Array


@dataclass(frozen=True)
class Counts:
    """Cells: `across` the core's section, `layers` around it, `along` the core (or the straight part) in x."""

    across: int
    layers: int
    along: int

    @property
    def section(self) -> int:
        """Cells of a cross-section."""
        return self.across**2 + 4 * self.across * self.layers

    @property
    def cap(self) -> int:
        """Cells that close both ends of a wrapped core."""
        return 2 * self.across**2 * self.layers


def choose_counts(shape: str, diameter: float, length: float, elements: int) -> Counts:
    """Counts whose total is near `elements`, of cells near to cubes."""
    straight = {"cylinder": length, "hemispherical_cylinder": length - diameter}.get(shape, 0.0)
    best, least = Counts(2, 1, 2), math.inf
    for across in range(2, int(elements ** (1.0 / 3.0)) + 4, 2):
        for layers in range(max(1, across // 3), max(1, across // 2) + 1):
            size = diameter / (across + 2 * layers)
            for along in _lengths(shape, across, size, straight, length / diameter):
                counts = Counts(across, layers, along)
                cost = 4.0 * abs(math.log(_total(shape, counts) / elements)) + _slenderness(
                    shape, counts, size, straight, length
                )
                if cost < least:
                    best, least = counts, cost
    return best


def _lengths(shape: str, across: int, size: float, straight: float, ratio: float) -> range:
    """Numbers of cells along x worth trying."""
    if shape == "sphere":
        return range(across, across + 1)
    if shape == "ellipsoid":
        most = max(2, round(across * ratio))
        return range(max(2, int(0.6 * most)) // 2 * 2, int(1.5 * most) + 3, 2)
    ideal = straight / size
    return range(int(0.6 * ideal), int(1.5 * ideal) + 2) if straight > 0.0 else range(1)


def _total(shape: str, counts: Counts) -> int:
    """Cells of the whole bird."""
    if shape == "cylinder":
        return max(counts.along, 1) * counts.section
    if shape == "hemispherical_cylinder":
        return (counts.across + counts.along) * counts.section + counts.cap
    return counts.along * counts.section + counts.cap


def _slenderness(shape: str, counts: Counts, size: float, straight: float, length: float) -> float:
    """How far the cells are from cubes: |log| of their length over width, and of the layers' share of the radius."""
    aspect = 1.0
    if shape == "ellipsoid":
        aspect = length / (counts.along + 2 * counts.layers) / size
    elif straight > 0.0:
        aspect = straight / max(counts.along, 0.5) / size
    return abs(math.log(aspect)) + 0.2 * abs(math.log(2.7 * counts.layers / counts.across))


Cells = NDArray[np.int64]
CORNERS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]])
ROUNDNESS = 0.6  # of the core, 0 a cube .. 1 a ball: the best worst corner among 0.3 .. 0.9 for 4 to 16 cells across


@dataclass(frozen=True)
class HexMesh:
    """nodes (m, 3) [m]; cells (e, 8) node numbers."""

    nodes: Array
    cells: Cells

    @property
    def corner_edges(self) -> Array:
        """The three edges that leave each corner, right-handed, (e, 8, 3, 3) [m]."""
        x = self.nodes[self.cells]
        to = [[1, 3, 4], [2, 0, 5], [3, 1, 6], [0, 2, 7], [7, 5, 0], [4, 6, 1], [5, 7, 2], [6, 4, 3]]
        return x[:, to] - x[:, :, None]

    @property
    def volumes(self) -> Array:
        """Of each cell, (e,) [m^3], exact for trilinear cells (2 x 2 x 2 Gauss points)."""
        x = self.nodes[self.cells]
        gauss = 0.5 + (CORNERS - 0.5) / math.sqrt(3.0)
        total = np.zeros(len(x))
        for point in gauss:
            low_high = np.stack([1.0 - point, point])
            shape = [low_high[CORNERS[:, i], i] for i in range(3)]
            sign = 2.0 * CORNERS - 1.0
            slopes = np.stack(
                [sign[:, i] * shape[(i + 1) % 3] * shape[(i + 2) % 3] for i in range(3)],
            )
            total += np.linalg.det(slopes @ x) / 8.0
        return total


def bird_mesh(shape: str, diameter: float, length: float, volume: float, elements: int) -> HexMesh:
    """Mesh about the bird's centre, axis along x, with about `elements` cells of nearly equal size and `volume` exact.

    The facets of a mesh cut the curved surface short; the whole is scaled up for it: lengths by 1.3 % at 500 cells,
    0.3 % at 4500. The mesh whose number of cells is nearest and whose cells are nearest to cubes is taken. Raises
    UserError for a shape without a mesh.
    """
    counts = choose_counts(shape, diameter, length, elements)
    radius = 0.5 * diameter
    if shape in ("sphere", "ellipsoid"):
        ball = wrapped_core(counts)
        mesh = HexMesh(
            ball.nodes * np.array([0.5 * length if shape == "ellipsoid" else radius, radius, radius]), ball.cells
        )
    elif shape == "cylinder":
        mesh = extruded(*equator(wrapped_core(Counts(counts.across, counts.layers, 2))), counts.along)
        mesh = HexMesh(mesh.nodes * np.array([length, radius, radius]), mesh.cells)
    elif shape == "hemispherical_cylinder":
        ball = wrapped_core(Counts(counts.across, counts.layers, counts.across))
        mesh = lengthened(HexMesh(radius * ball.nodes, ball.cells), length - diameter, counts.along)
    else:
        raise UserError(f"bird.shape = {shape} has no mesh of hexahedra")
    if not len(mesh.cells) or not mesh.volumes.min() > 0.0:
        raise UserError(
            f"bird.particles = {elements}: so few hexahedra do not fill a {shape} of {1e3 * diameter:.4g} by "
            f"{1e3 * length:.4g} mm; raise it, or choose particles: bird.method = sph"
        )
    return HexMesh(mesh.nodes * (volume / mesh.volumes.sum()) ** (1.0 / 3.0), mesh.cells)


def wrapped_core(counts: Counts) -> HexMesh:
    """Ball of radius 1: a core of across x across (x along in x) cells and `layers` around it."""
    across, layers, along = counts.across, counts.layers, counts.along
    core: list[Array] = [np.linspace(-1.0, 1.0, n + 1) for n in (along, across, across)]
    blocks = [_block(*core)]
    outward = np.linspace(1.0, 2.0, layers + 1)
    for axis in range(3):
        for side in (-1.0, 1.0):
            blocks.append(_frustum(axis, side, outward, core))
    cells = np.concatenate(blocks)
    flat = cells.reshape(-1, 3)
    _, first, number = np.unique(np.round(flat, 9), axis=0, return_index=True, return_inverse=True)
    size = np.array([across + 0.2 * (along - across), across, across])
    nodes = _to_ball(flat[first], size / (size + 2.0 * layers))
    mesh = HexMesh(nodes, number.reshape(-1, 8).astype(np.int64))
    turned = np.linalg.det(mesh.corner_edges[:, 0]) < 0.0
    mesh.cells[turned] = mesh.cells[turned][:, [4, 5, 6, 7, 0, 1, 2, 3]]
    return mesh


def _block(a: Array, b: Array, c: Array) -> Array:
    """Corner positions (cells, 8, 3) of a grid of cells."""
    grid = np.stack(np.meshgrid(a, b, c, indexing="ij"), axis=-1)
    sizes = [len(s) - 1 for s in (a, b, c)]
    corners = [grid[i : i + sizes[0], j : j + sizes[1], k : k + sizes[2]] for i, j, k in CORNERS]
    return np.stack(corners, axis=3).reshape(-1, 8, 3)


def _frustum(axis: int, side: float, outward: Array, core: list[Array]) -> Array:
    """Layers over one face of the core: rays through its nodes, `outward` 1 at the core and 2 at the surface."""
    one, other = (axis + 1) % 3, (axis + 2) % 3
    local = _block(outward, core[one], core[other])
    points = np.empty_like(local)
    points[..., axis] = side * local[..., 0]
    points[..., one] = local[..., 0] * local[..., 1]
    points[..., other] = local[..., 0] * local[..., 2]
    return points


def _to_ball(points: Array, core: Array) -> Array:
    """From the cube of half edge 2 to the unit ball; that of half edge 1 becomes the core, `core` (3,) of the radius.

    The smooth map of the cube onto the ball, x sqrt(1 - y^2/2 - z^2/2 + y^2 z^2/3) (P. Nowell, 2005), rounds the core
    in part and the surface in full; between them the layers are evenly spread.
    """
    reach = np.abs(points).max(axis=1, keepdims=True)
    t = np.clip(reach - 1.0, 0.0, 1.0)
    cube = points / np.maximum(reach, 1.0)
    square = cube**2
    y, z = np.roll(square, -1, axis=1), np.roll(square, -2, axis=1)
    ball = cube * np.sqrt(1.0 - 0.5 * y - 0.5 * z + y * z / 3.0)
    inner = core * ((1.0 - ROUNDNESS) * cube + ROUNDNESS * ball)
    return (1.0 - t) * inner + t * ball


def equator(ball: HexMesh) -> tuple[Array, Cells]:
    """Nodes (m, 3) of the plane x = 0 of a ball, and the quadrilaterals of its cells in it, normal along +x."""
    on_plane = np.abs(ball.nodes[:, 0]) < 1e-9
    faces = np.array([[0, 1, 2, 3], [4, 5, 6, 7], [0, 1, 5, 4], [3, 2, 6, 7], [0, 3, 7, 4], [1, 2, 6, 5]])
    above = ball.cells[ball.nodes[ball.cells, 0].mean(axis=1) > 0.0]
    quads = above[:, faces].reshape(-1, 4)
    quads = quads[on_plane[quads].all(axis=1)]
    numbers, local = np.unique(quads, return_inverse=True)
    quads, nodes = local.reshape(-1, 4), ball.nodes[numbers]
    one, other = nodes[quads[:, 1]] - nodes[quads[:, 0]], nodes[quads[:, 3]] - nodes[quads[:, 0]]
    turned = np.cross(one, other)[:, 0] < 0.0
    quads[turned] = quads[turned][:, ::-1]
    return nodes, quads


def extruded(nodes: Array, quads: Cells, layers: int) -> HexMesh:
    """Quadrilaterals in the plane x = 0 drawn out from x = -1/2 to 1/2."""
    heights = np.linspace(-0.5, 0.5, layers + 1)
    stack = nodes[None, :, :] + heights[:, None, None] * np.array([1.0, 0.0, 0.0])
    low = quads + len(nodes) * np.arange(layers)[:, None, None]
    return HexMesh(stack.reshape(-1, 3), np.concatenate([low, low + len(nodes)], axis=2).reshape(-1, 8))


def lengthened(ball: HexMesh, straight: float, layers: int) -> HexMesh:
    """Ball cut at x = 0, its halves set `straight` [m] apart, the gap filled with `layers` of cells."""
    if straight <= 0.0 or layers < 1:
        return ball
    apart = ball.nodes[ball.cells].copy()
    ahead = apart[:, :, 0].mean(axis=1) > 0.0
    apart[:, :, 0] += np.where(ahead, 0.5, -0.5)[:, None] * straight
    plane, quads = equator(ball)
    middle = extruded(plane, quads, layers)
    between = middle.nodes[middle.cells] * np.array([straight, 1.0, 1.0])
    points = np.concatenate([apart, between]).reshape(-1, 3)
    size = np.abs(points).max()
    _, first, number = np.unique(np.round(points / size, 9), axis=0, return_index=True, return_inverse=True)
    return HexMesh(points[first], number.reshape(-1, 8).astype(np.int64))
