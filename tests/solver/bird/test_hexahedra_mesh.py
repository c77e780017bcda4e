"""Meshes of hexahedra: volume, quality, surface, count."""

from __future__ import annotations

import numpy as np
import pytest

from birdstrike.data.errors import UserError
from birdstrike.solver.bird.hex_mesh import bird_mesh
from birdstrike.solver.bird.shape import SHAPES, volume

DIAMETER = 0.106
CASES = [(shape, elements) for shape in SHAPES for elements in (500, 1000, 4504)]


def mesh_of(shape: str, elements: int):
    length = DIAMETER if shape == "sphere" else 0.262
    return bird_mesh(shape, DIAMETER, length, volume(shape, DIAMETER, length), elements), length


@pytest.mark.parametrize(("shape", "elements"), CASES)
def test_mesh_has_the_volume_of_the_shape_and_sound_cells(shape, elements):
    """Volume to rounding; no corner flatter than a scaled Jacobian of 0.45; cells within a factor of 4 of the mean."""
    mesh, length = mesh_of(shape, elements)
    assert mesh.volumes.sum() == pytest.approx(volume(shape, DIAMETER, length), rel=1e-12)
    edges = mesh.corner_edges
    assert (np.linalg.det(edges) / np.linalg.norm(edges, axis=-1).prod(axis=-1)).min() > 0.45
    share = mesh.volumes / mesh.volumes.mean()
    assert share.min() > 0.35
    assert share.max() < 4.0


@pytest.mark.parametrize(("shape", "elements"), CASES)
def test_mesh_has_about_the_elements_asked_for(shape, elements):
    """Within 10 %; a ball has few meshes to choose from: 30 %."""
    mesh, _ = mesh_of(shape, elements)
    assert len(mesh.cells) == pytest.approx(elements, rel=0.3 if shape == "sphere" else 0.1)


def test_nodes_of_the_surface_lie_on_the_shape():
    """The paper's bird with about 4504 elements: outer nodes on the capsule within the 0.5 mm that keep its volume."""
    mesh, _ = mesh_of("hemispherical_cylinder", 4504)
    core = 0.5 * (0.262 - DIAMETER)
    beyond = np.maximum(np.abs(mesh.nodes[:, 0]) - core, 0.0)
    radius = np.hypot(np.hypot(mesh.nodes[:, 1], mesh.nodes[:, 2]), beyond)
    faces = np.sort(mesh.cells[:, [[0, 1, 2, 3], [4, 5, 6, 7], [0, 1, 5, 4], [3, 2, 6, 7], [0, 3, 7, 4], [1, 2, 6, 5]]])
    outer, count = np.unique(faces.reshape(-1, 4), axis=0, return_counts=True)
    surface = np.unique(outer[count == 1])
    assert radius[surface] == pytest.approx(0.5 * DIAMETER, abs=0.5e-3)
    assert np.delete(radius, surface).max() < 0.95 * 0.5 * DIAMETER


def test_every_inner_face_is_shared_by_two_cells():
    """Euler characteristic of the surface is that of a ball, 2: the blocks are welded without a crack."""
    for shape in SHAPES:
        mesh, _ = mesh_of(shape, 1000)
        faces = mesh.cells[:, [[0, 1, 2, 3], [4, 5, 6, 7], [0, 1, 5, 4], [3, 2, 6, 7], [0, 3, 7, 4], [1, 2, 6, 5]]]
        _, first, count = np.unique(
            np.sort(faces.reshape(-1, 4), axis=1), axis=0, return_index=True, return_counts=True
        )
        quads = faces.reshape(-1, 4)[first[count == 1]]
        edges = np.unique(np.sort(np.stack([quads, np.roll(quads, 1, axis=1)], axis=-1).reshape(-1, 2), axis=1), axis=0)
        assert count.max() == 2
        assert len(np.unique(quads)) - len(edges) + len(quads) == 2


def test_a_flat_bird_of_too_few_hexahedra_is_refused_by_their_number() -> None:
    """The bird's law was named as the cause."""
    with pytest.raises(
        UserError, match=r"bird.particles = 150: so few hexahedra do not fill a cylinder of 300 by 5 mm"
    ):
        bird_mesh("cylinder", 0.3, 0.005, np.pi * 0.15**2 * 0.005, 150)
