"""Contact: feet on facets, equal and opposite forces on one line, and a bounce that keeps its energy."""

from __future__ import annotations

import numpy as np
import pytest

from birdstrike.data.errors import UserError
from birdstrike.reports.verification.columns import SEED
from birdstrike.solver.bird.sph import Bird
from birdstrike.solver.contact import Contact
from birdstrike.solver.kernels.contact.contact import foot_on_facet
from birdstrike.solver.target.assembly import Target
from birdstrike.solver.target.mesh import plate_mesh, shell_mesh
from birdstrike.solver.target.rectangle import plate_of
from birdstrike.solver.target.section import ShellMaterial

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


def curved_plate() -> Target:
    """A shallow saddle, so that facets are warped and meet at ridges of both kinds."""
    mesh = plate_mesh(0.2, 0.2, (10, 10))
    mesh.nodes[:, 2] = 0.4 * (mesh.nodes[:, 0] ** 2 - mesh.nodes[:, 1] ** 2)
    return plate_of(shell_mesh(mesh.nodes, mesh.quads), 0.004, STEEL, "free")


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
    found = np.isfinite(contact.sheets[0].foot[:, 2])
    assert np.allclose(np.abs(contact.sheets[0].foot[found, 2]), nearest[found], atol=2e-4)
    assert found.sum() > 25
    assert (nearest[~found] > contact.gap + GAP_PARTICLE).all(), "only what is out of reach may be left out"


@pytest.mark.parametrize("offset", [0.0, 0.0037])
def test_a_particle_bounces_without_loss(offset):
    """On a free plate: energy and momentum of particle plus plate are kept; the springs give back what they took."""
    plate = plate_of(plate_mesh(0.2, 0.2, (10, 10)), 0.004, STEEL, "free")
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
        energy += (
            contact.work(bird, plate, dt if step else 0.0) + plate.shells.work.sum() + plate.shells.hourglass_work.sum()
        )
        kick = dt if step else 0.5 * dt
        contact.kick(bird, kick, 0.0)
        bird.drift(dt)
        plate.kick_and_drift(kick, dt, contact.on_plate)
        rebounded = rebounded or (bird.v[0, 2] > 0.0 and contact.touching == 0)
        if rebounded:
            break
    assert rebounded
    assert bird.kinetic_energy() + plate.kinetic_energy() + energy == pytest.approx(start, rel=2e-3)
    assert bird.mass * bird.v[0, 2] + plate.mass @ plate.v[:, 2] == pytest.approx(-10.0 * bird.mass, rel=1e-10)
    assert bird.v[0, 0] == pytest.approx(20.0, abs=0.05)


def test_beyond_the_rim_nothing_is_touched():
    plate = plate_of(plate_mesh(0.2, 0.2, (10, 10)), 0.004, STEEL, "free")
    bird = particles(np.array([[0.103, 0.0, 0.001]]), np.zeros((1, 3)))
    contact = Contact(bird, plate)
    contact.update_forces(bird, plate)
    assert contact.touching == 0


def bowl(radius: float = 0.5, flipped: bool = False) -> Target:
    """A curved panel, z = x^2/(2 R); flipped: its facets wound so that the normals point away from z > 0."""
    mesh = plate_mesh(0.2, 0.2, (10, 10))
    mesh.nodes[:, 2] = mesh.nodes[:, 0] ** 2 / (2.0 * radius)
    quads = mesh.quads[:, ::-1].copy() if flipped else mesh.quads
    return plate_of(shell_mesh(mesh.nodes, quads), 0.004, STEEL, "free")


def layer_on(plate: Target, radius: float, depth: float) -> Bird:
    """Particles `depth` [m] inside first contact with the panel, on its z > 0 side."""
    x, y = (a.ravel() for a in np.meshgrid(np.linspace(-0.07, 0.07, 9), np.linspace(-0.07, 0.07, 9)))
    lift = 0.5 * (plate.thickness + GAP_PARTICLE) - depth
    slope = x / radius
    normal = np.column_stack([-slope, np.zeros_like(x), np.ones_like(x)]) / np.hypot(1.0, slope)[:, None]
    points = np.column_stack([x, y, x**2 / (2.0 * radius)]) + lift * normal
    return particles(points, np.zeros_like(points))


@pytest.mark.parametrize("flipped", [False, True])
def test_the_impact_side_of_a_curved_panel_is_the_one_the_bird_starts_on(flipped):
    """Each particle is pushed back along the surface's own normal, whichever way the facets are wound."""
    plate = bowl(flipped=flipped)
    bird = layer_on(plate, 0.5, 2e-4)
    contact = Contact(bird, plate)
    contact.update_forces(bird, plate)
    assert contact.side == (-1 if flipped else 1)
    assert contact.touching == bird.n
    push = contact.on_bird / np.linalg.norm(contact.on_bird, axis=1)[:, None]
    slope = bird.x[:, 0] / 0.5
    normal = np.column_stack([-slope, np.zeros_like(slope), np.ones_like(slope)]) / np.hypot(1.0, slope)[:, None]
    assert (push * normal).sum(axis=1).min() > 0.999
    assert np.abs(contact.on_bird.sum(axis=0) + contact.on_plate.sum(axis=0)).max() < 1e-12 * np.abs(push).sum() * 1e6


def test_both_windings_give_the_same_forces():
    forces = []
    for flipped in (False, True):
        plate = bowl(flipped=flipped)
        bird = layer_on(plate, 0.5, 2e-4)
        contact = Contact(bird, plate)
        contact.update_forces(bird, plate)
        forces.append((contact.on_bird, contact.on_plate))
    assert np.abs(forces[0][0] - forces[1][0]).max() < 1e-6 * np.abs(forces[0][0]).max()
    assert np.abs(forces[0][1] - forces[1][1]).max() < 1e-6 * np.abs(forces[0][1]).max()


def torn_plate() -> Target:
    """Flat, 20 mm facets, the four around the centre torn out."""
    plate = plate_of(plate_mesh(0.2, 0.2, (10, 10)), 0.004, STEEL, "free")
    centres = plate.x[plate.quads].mean(axis=1)
    plate.alive[np.abs(centres[:, :2]).max(axis=1) < 0.02] = False
    return plate


def test_a_torn_facet_touches_nothing_and_its_neighbours_do():
    plate = torn_plate()
    bird = particles(np.array([[0.0, 0.0, 0.003], [0.012, -0.011, 0.002], [0.03, 0.0, 0.003]]), np.zeros((3, 3)))
    contact = Contact(bird, plate)
    contact.update_forces(bird, plate)
    assert contact.touching == 1
    assert contact.on_bird[2, 2] > 0.0
    assert contact.sheets[0].past_rim.tolist() == [True, True, False]


def test_a_particle_flies_through_the_hole_and_is_not_caught_from_below():
    """Down through the hole, then sideways under the sound part of the plate: nothing touches, nothing fails."""
    plate = torn_plate()
    bird = particles(np.array([[0.0, 0.0, 0.004]]), np.zeros((1, 3)))
    contact = Contact(bird, plate)
    for z in np.linspace(0.004, -0.004, 17):
        bird.x[0, 2] = z
        contact.update_forces(bird, plate)
        assert contact.touching == 0
    for x in np.linspace(0.0, 0.06, 61):
        bird.x[0, 0] = x
        contact.update_forces(bird, plate)
        assert contact.touching == 0


def test_tearing_under_a_particle_freezes_what_its_spring_held():
    """The contact's own account then holds only the springs that are left; what was lost stands under eroded."""
    plate = plate_of(plate_mesh(0.2, 0.2, (10, 10)), 0.004, STEEL, "free")
    bird = particles(np.array([[0.01, 0.01, 0.00451], [0.05, 0.05, 0.00451]]), np.tile([0.0, 0.0, -10.0], (2, 1)))
    contact = Contact(bird, plate)
    dt = 1e-7
    for step in range(60):
        contact.update_forces(bird, plate)
        contact.update_energies(bird, plate, dt if step else 0.0)
        bird.x[: bird.n] += dt * bird.v[: bird.n]
    held = contact.stored
    plate.alive[contact.sheets[0].facet[0]] = False
    contact.update_forces(bird, plate)
    bird.v[:] = 0.0
    contact.update_energies(bird, plate, dt)
    assert contact.touching == 1
    assert contact.energies["eroded"] == pytest.approx(0.5 * held, rel=1e-6)
    assert contact.energies["contact"] == pytest.approx(0.5 * held, rel=0.02)


def test_the_foot_goes_round_the_corner_of_a_hole():
    """From a facet beside the hole to the one across its corner, over the sound facet between them."""
    plate = plate_of(plate_mesh(0.2, 0.2, (10, 10)), 0.004, STEEL, "free")
    bird = particles(np.array([[0.0199, 0.0190, 0.003]]), np.zeros((1, 3)))
    contact = Contact(bird, plate)
    contact.update_forces(bird, plate)
    start = plate.quads[contact.sheets[0].facet[0]]
    torn = next(
        f for f in contact.sheets[0].across[contact.sheets[0].facet[0]] if plate.x[plate.quads[f], 0].mean() > 0.02
    )
    plate.alive[torn] = False
    contact.search(bird, plate)
    assert (plate.quads[contact.sheets[0].facet[0]] == start).all()
    bird.x[0, :2] = 0.0211, 0.0201
    contact.sheets[0].follow(bird, plate, np.zeros(1, np.int64))
    assert contact.sheets[0].foot[0, 2] == pytest.approx(0.003)
    assert plate.x[plate.quads[contact.sheets[0].facet[0]]].mean(axis=0)[:2] == pytest.approx([0.03, 0.03])


def test_a_bird_that_starts_inside_the_plate_is_told_what_to_change():
    plate = bowl()
    bird = layer_on(plate, 0.5, 1e-3)
    with pytest.raises(UserError, match=r"starts inside the plate: 81 particles, up to 1\.\d mm deep; raise impact"):
        Contact(bird, plate).refuse_overlap(bird, plate)
    clear = layer_on(plate, 0.5, -1e-3)
    Contact(clear, plate).refuse_overlap(clear, plate)
