"""Contact: feet on facets, equal and opposite forces on one line, and a bounce that keeps its energy."""

from __future__ import annotations

import numpy as np
import pytest

from reports.verification.columns import SEED
from solver.bird import Bird
from solver.contact import Contact
from solver.geometry import plate_mesh, shell_mesh
from solver.kernels.contact import foot_on_facet
from solver.plate import Plate, ShellMaterial

STEEL = ShellMaterial(200e9, 0.3, 7800.0)
GAP_PARTICLE = 5e-3


def particles(x: np.ndarray, v: np.ndarray) -> Bird:
    spacing = GAP_PARTICLE
    return Bird(x, v, SEED.rho0 * spacing**3, 1.2 * spacing, SEED, (1.0, 2.0))


def test_foot_of_the_perpendicular_on_a_skewed_facet():
    nodes = np.array([[0.0, 0.0, 0.0], [1.2, 0.1, 0.3], [1.0, 1.1, 0.5], [-0.1, 0.9, 0.1]])
    nodes[2, 2] = nodes[1, 2] + nodes[3, 2] - nodes[0, 2]
    normal = np.cross(nodes[2] - nodes[0], nodes[3] - nodes[1])
    normal /= np.linalg.norm(normal)
    inside = np.array([0.3, 0.25, 0.15, 0.3]) @ nodes
    foot = np.zeros(6)
    assert foot_on_facet(inside + 0.2 * normal, nodes, np.array([0, 1, 2, 3]), foot)
    xi, eta = foot[:2]
    shape = 0.25 * np.array([(1 - xi) * (1 - eta), (1 + xi) * (1 - eta), (1 + xi) * (1 + eta), (1 - xi) * (1 + eta)])
    offset = inside + 0.2 * normal - shape @ nodes
    assert np.allclose(np.cross(offset, foot[3:]), 0.0, atol=1e-7)
    assert foot[2] == pytest.approx(np.linalg.norm(offset), rel=1e-9)


def curved_plate() -> Plate:
    """A shallow saddle, so that facets are warped and meet at ridges of both kinds."""
    mesh = plate_mesh(0.2, 0.2, (10, 10))
    mesh.nodes[:, 2] = 0.4 * (mesh.nodes[:, 0] ** 2 - mesh.nodes[:, 1] ** 2)
    return Plate(shell_mesh(mesh.nodes, mesh.quads), 0.004, STEEL, "free")


def test_contact_conserves_linear_and_angular_momentum():
    plate = curved_plate()
    rng = np.random.default_rng(0)
    x = np.column_stack([rng.uniform(-0.08, 0.08, (300, 2)), np.zeros(300)])
    x[:, 2] = 0.4 * (x[:, 0] ** 2 - x[:, 1] ** 2) + rng.uniform(0.002, 0.006, 300)
    bird = particles(x, np.zeros_like(x))
    contact = Contact(bird, plate)
    contact.update_forces(bird, plate)
    assert contact.touching > 100
    scale = np.abs(contact.on_bird).sum()
    assert np.abs(contact.on_bird.sum(axis=0) + contact.on_plate.sum(axis=0)).max() < 1e-13 * scale
    moment = np.cross(bird.x, contact.on_bird).sum(axis=0) + np.cross(plate.x, contact.on_plate).sum(axis=0)
    assert np.abs(moment).max() < 1e-6 * scale * 0.1


def test_nearest_facets_are_those_of_a_brute_force_search():
    plate = curved_plate()
    x = np.random.default_rng(1).uniform(-0.09, 0.09, (50, 3)) * [1.0, 1.0, 0.1] + [0.0, 0.0, 0.005]
    bird = particles(x, np.zeros_like(x))
    contact = Contact(bird, plate)
    contact.search(bird, plate)
    fine = np.linspace(-1.0, 1.0, 41)
    xi, eta = (a.ravel() for a in np.meshgrid(fine, fine))
    shape = 0.25 * np.stack([(1 - xi) * (1 - eta), (1 + xi) * (1 - eta), (1 + xi) * (1 + eta), (1 - xi) * (1 + eta)])
    surface = np.einsum("ck,eci->eki", shape, plate.x[plate.quads]).reshape(-1, 3)
    nearest = np.array([np.linalg.norm(surface - point, axis=1).min() for point in x])
    assert np.allclose(np.abs(contact.foot[:, 2]), nearest, atol=2e-4)


@pytest.mark.parametrize("offset", [0.0, 0.0037])
def test_a_particle_bounces_without_loss(offset):
    """On a free plate: energy and momentum of particle plus plate are kept; the springs give back what they took."""
    plate = Plate(plate_mesh(0.2, 0.2, (10, 10)), 0.004, STEEL, "free")
    x = np.array([[offset, 0.5 * offset, 0.5 * (0.004 + GAP_PARTICLE) + 1e-4]])
    bird = particles(x, np.array([[20.0, 0.0, -10.0]]))
    contact = Contact(bird, plate)
    dt = 0.3 * min(contact.stable_step(bird, plate), plate.stable_step())
    start, energy = bird.kinetic_energy(), 0.0
    rebounded = False
    for step in range(3000):
        bird.acceleration[:] = 0.0
        plate.update_forces(dt if step else 0.0)
        contact.update_forces(bird, plate)
        energy += contact.work(bird, plate, dt if step else 0.0) + plate.work.sum() + plate.hourglass_work.sum()
        kick = dt if step else 0.5 * dt
        bird.kick_and_drift(kick, dt)
        plate.kick_and_drift(kick, dt, contact.on_plate)
        rebounded = rebounded or (bird.v[0, 2] > 0.0 and contact.touching == 0)
        if rebounded:
            break
    assert rebounded
    assert bird.kinetic_energy() + plate.kinetic_energy() + energy == pytest.approx(start, rel=2e-3)
    assert bird.mass * bird.v[0, 2] + plate.mass @ plate.v[:, 2] == pytest.approx(-10.0 * bird.mass, rel=1e-10)
    assert bird.v[0, 0] == pytest.approx(20.0, abs=0.05)


def test_beyond_the_rim_nothing_is_touched():
    plate = Plate(plate_mesh(0.2, 0.2, (10, 10)), 0.004, STEEL, "free")
    bird = particles(np.array([[0.103, 0.0, 0.001]]), np.zeros((1, 3)))
    contact = Contact(bird, plate)
    contact.update_forces(bird, plate)
    assert contact.touching == 0
