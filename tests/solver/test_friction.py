"""Friction: Coulomb's deceleration and work, its couple on the shell, and its place in the energy balance."""

from __future__ import annotations

import numpy as np
import pytest

from birdstrike.data.histories import Array
from birdstrike.reports.verification.columns import SEED
from birdstrike.reports.verification.problems.target import sliding_layer
from birdstrike.solver.bird.sph import Bird
from birdstrike.solver.contact import Contact
from birdstrike.solver.kernels.contact.border_friction import invert_inertia, slip_at_border
from birdstrike.solver.kernels.contact.friction import slip_on_facet, tangents
from birdstrike.solver.target.assembly import Target
from birdstrike.solver.target.mesh import plate_mesh, shell_mesh
from birdstrike.solver.target.rectangle import plate_of
from birdstrike.solver.target.section import ShellMaterial
from tests.solver.target.triangles import cut
from tests.solver.test_contact_of_assemblies import SIZE, stiffened

STEEL = ShellMaterial(200e9, 0.3, 7800.0)
SPACING, THICKNESS = 5e-3, 0.004
GAP = 0.5 * (THICKNESS + SPACING)


def particles(x: np.ndarray, v: np.ndarray) -> Bird:
    return Bird(x, v, SEED.rho0 * SPACING**3, 1.2 * SPACING, SEED, (1.0, 2.0))


def saddle(triangles: bool) -> Target:
    mesh = plate_mesh(0.2, 0.2, (10, 10))
    mesh.nodes[:, 2] = 0.4 * (mesh.nodes[:, 0] ** 2 - mesh.nodes[:, 1] ** 2)
    quads = cut(mesh.quads, crossed=True) if triangles else mesh.quads
    return plate_of(shell_mesh(mesh.nodes, quads), THICKNESS, STEEL, "free")


def sliding_saddle(plate: Target) -> tuple[Bird, Contact]:
    """300 particles pressed into a saddle, flying every way, and a plate that spins: one evaluation of the forces."""
    rng = np.random.default_rng(0)
    x = np.column_stack([rng.uniform(-0.08, 0.08, (300, 2)), np.zeros(300)])
    x[:, 2] = 0.4 * (x[:, 0] ** 2 - x[:, 1] ** 2) + rng.uniform(0.002, 0.006, 300)
    bird = particles(x, rng.normal(0.0, 30.0, x.shape))
    plate.v[:] = rng.normal(0.0, 5.0, plate.v.shape)
    contact = Contact(bird, plate, 0.3)
    contact.update_forces(bird, plate)
    return bird, contact


turning = pytest.mark.parametrize(
    "turn", [[300.0, 0.0, 0.0], [0.0, 300.0, 0.0], [0.0, 0.0, 300.0], [120.0, -250.0, 90.0]]
)
HEIGHT = 4e-3


def particle_and_facet(tilt: float, lean: float, at: Array) -> tuple[Array, Array, Array, Array]:
    """Particle, facet, the line from its foot at natural coordinates `at`, and a tangent; lean: off the facet's normal.

    The facet's normal lies in the plane of y and z, `tilt` off z [rad].
    """
    up = np.array([0.0, -np.sin(tilt), np.cos(tilt)])
    along = np.array([[1.0, 0.0, 0.0], np.cross(up, [1.0, 0.0, 0.0])])
    normal = np.cos(lean) * up + np.sin(lean) * along[0]
    nodes = 0.01 * np.array([[-1.0, -1.2], [1.1, -0.9], [1.0, 1.0], [-0.8, 1.1]]) @ along + [0.05, -0.02, 0.03]
    shape = 0.25 * (1.0 + at[0] * np.array([-1, 1, 1, -1])) * (1.0 + at[1] * np.array([-1, -1, 1, 1]))
    return shape @ nodes + HEIGHT * normal, nodes, normal, along[1]


@turning
@pytest.mark.parametrize("tilt", [0.0, 0.7, 1.4])
def test_a_particle_that_turns_with_a_rigid_plate_does_not_slip(turn: list[float], tilt: float) -> None:
    """Plate and particle at its height above the mid-surface as one body, in both tangents, however it lies."""
    at = np.array([0.3, -0.4])
    particle, nodes, normal, _ = particle_and_facet(tilt, 0.0, at)
    base, corner, slip = np.zeros((2, 3)), np.zeros((4, 2)), np.zeros(2)
    foot = np.array([*at, HEIGHT, *normal])
    tangents(foot, base)
    state = (np.cross(turn, particle), nodes, np.cross(turn, nodes), np.arange(4), foot, base, corner, slip)
    assert slip_on_facet(*state)[0] > 0.0
    assert np.abs(slip).max() < 1e-12 * 300.0
    assert slip_on_facet(state[0] + 7.0 * base[0] - 3.0 * base[1], *state[1:])[0] > 0.0
    assert slip == pytest.approx([7.0, -3.0])


@turning
@pytest.mark.parametrize("tilt", [0.0, 0.7, 1.4])
@pytest.mark.parametrize("lean", [1.1, 1.5, 0.5 * np.pi])
def test_a_particle_at_the_border_of_a_rigid_plate_does_not_slip(turn: list[float], tilt: float, lean: float) -> None:
    """The same where the line from the border to the particle lies in the plate's plane, or nearly."""
    at = np.array([1.0, -0.4])
    particle, nodes, normal, across = particle_and_facet(tilt, lean, at)
    corner, inverse, slip = np.zeros((4, 3)), np.zeros((3, 3)), np.zeros(3)
    assert invert_inertia(nodes, np.arange(4), corner, inverse)
    where = (np.cross(turn, nodes), np.arange(4), np.array([*at, HEIGHT, *normal]), corner, inverse, slip)
    assert slip_at_border(np.cross(turn, particle), *where) < 1e-11 * 300.0
    sliding = 7.0 * across - 3.0 * np.cross(normal, across)
    assert slip_at_border(np.cross(turn, particle) + sliding + 5.0 * normal, *where) == pytest.approx(np.sqrt(58.0))
    assert slip == pytest.approx(sliding)


def pressed_on_a_free_edge(lean: float, triangles: bool) -> tuple[Bird, Target, Contact]:
    """Particles in touch with a blade's free edge, `lean` [rad] off its plane, sliding every way: one evaluation."""
    target = stiffened(triangles=triangles)
    y = np.linspace(-0.045, 0.045, 10)
    away = 0.5 * (8e-3 + SPACING) - 3e-4
    x = np.column_stack([np.full_like(y, away * np.sin(lean)), y, np.full_like(y, -0.04 - away * np.cos(lean))])
    bird = particles(x, np.random.default_rng(1).normal(0.0, 20.0, x.shape))
    target.v[:] = np.random.default_rng(2).normal(0.0, 1.0, target.v.shape)
    contact = Contact(bird, target, 0.3)
    contact.update_forces(bird, target)
    assert contact.touching == len(y)
    return bird, target, contact


both_shells = pytest.mark.parametrize("triangles", [False, True])
leaning = pytest.mark.parametrize("lean", [0.0, 1e-4, 5e-3, 0.05, 0.3, 0.52, 0.53, 0.8])


@both_shells
@leaning
def test_friction_on_an_edge_turns_the_shell_by_forces_of_its_own_size(lean, triangles):
    """Its couple is D F, carried by corners that lie half a facet from its middle, wherever the particle is.

    Forces along the line to the particle were 1/sin(lean) as large: beyond all bounds in the shell's plane.
    """
    bird, target, contact = pressed_on_a_free_edge(lean, triangles)
    friction = contact.friction
    assert friction is not None
    size = np.linalg.norm(friction.on_bird, axis=1)
    assert (size > 0.0).all()
    assert (size <= 0.3 * contact.stiffness * 3e-4 * (1.0 + 1e-9)).all()
    assert np.linalg.norm(friction.on_plate, axis=1).sum() < (1.0 + 8.0 * 0.5 * (8e-3 + SPACING) / SIZE) * size.sum()
    assert np.abs(friction.on_bird.sum(axis=0) + friction.on_plate.sum(axis=0)).max() < 1e-12 * size.sum()
    moment = np.cross(bird.x, friction.on_bird).sum(axis=0) + np.cross(target.x, friction.on_plate).sum(axis=0)
    assert np.abs(moment).max() < 1e-10 * size.sum()
    assert (friction.on_bird * bird.v).sum() + (friction.on_plate * target.v).sum() < 0.0


@leaning
def test_friction_on_a_free_edge_takes_energy_and_never_gives_it(lean):
    """Particles held to a blade's edge rub it to rest: what blade and particles have left falls in every step."""
    bird, target, contact = pressed_on_a_free_edge(lean, False)
    friction = contact.friction
    assert friction is not None
    dt = 0.5 * min(target.stable_step(), contact.stable_step(bird, target))
    energy = bird.kinetic_energy() + target.kinetic_energy()
    heat = [0.0]
    for _ in range(300):
        bird.v[: bird.n] += dt * friction.on_bird / bird.masses[:, None]
        target.nodes.nodal[:] = 0.0
        target.v[:] += dt * friction.on_plate / target.mass[:, None] * ~target.fixed[:, None]
        contact.update_forces(bird, target)
        heat.append(heat[-1] + friction.work(bird, target, dt))
    assert np.all(np.diff(heat) > -1e-9 * energy)
    assert heat[-1] > 0.1 * energy
    assert bird.kinetic_energy() + target.kinetic_energy() + heat[-1] < energy * (1.0 + 1e-3)
    assert friction.created < 1e-9 * energy


@both_shells
def test_friction_conserves_linear_and_angular_momentum(triangles):
    """Friction acts at the particle's height above the mid-surface: the shell gets the couple as well."""
    plate = saddle(triangles)
    bird, contact = sliding_saddle(plate)
    friction = contact.friction
    assert friction is not None
    scale = np.abs(friction.on_bird).sum()
    assert scale > 0.02 * np.abs(contact.on_bird).sum()
    assert np.abs(friction.on_bird.sum(axis=0) + friction.on_plate.sum(axis=0)).max() < 1e-13 * scale
    moment = np.cross(bird.x, friction.on_bird).sum(axis=0) + np.cross(plate.x, friction.on_plate).sum(axis=0)
    assert np.abs(moment).max() < 1e-9 * scale * 0.1


@both_shells
def test_friction_only_takes_energy(triangles):
    """Its power on particles and nodes together is the sum of -|F| |slip|, also on a shell that moves and turns."""
    plate = saddle(triangles)
    bird, contact = sliding_saddle(plate)
    friction = contact.friction
    assert friction is not None
    power = (friction.on_bird * bird.v).sum() + (friction.on_plate * plate.v).sum()
    force = np.linalg.norm(friction.on_bird, axis=1)
    normal = contact.stiffness * contact.sheets[0].overlap
    assert (force <= 0.3 * normal * (1.0 + 1e-12)).all()
    assert (force < 0.3 * normal * (1.0 - 1e-9)).any()
    assert power <= -(force**2).sum() / friction.resistance * (1.0 - 1e-9)
    assert force.sum() > 0.0


def test_a_pressed_layer_slows_at_mu_n_over_m_and_its_heat_is_mu_n_s():
    """Coulomb: v = v0 - mu N t/m; the heat is mu N times the way."""
    deceleration, heat = sliding_layer()
    assert 0.0 < deceleration.seen["speed_left"] < 0.5
    assert deceleration.error == pytest.approx(0.0, abs=1e-6)
    assert heat.error == pytest.approx(0.0, abs=0.01)


def test_a_slow_layer_sticks():
    """Below the creep speed a layer comes to rest and never slides back."""
    speed = [sliding_layer(2.0, 400.0, steps)[0].seen["speed_left"] for steps in (4, 12, 60)]
    assert speed[0] > speed[1] > speed[2] >= 0.0
    assert speed[2] < 1e-6
