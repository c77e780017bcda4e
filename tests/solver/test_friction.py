"""Friction: Coulomb's deceleration and work, its couple on the shell, and its place in the books."""

from __future__ import annotations

import numpy as np
import pytest

from solver.bird import Bird
from solver.contact import Contact
from solver.geometry import plate_mesh, shell_mesh
from solver.plate import Plate, ShellMaterial
from solver.rigid_plate import RigidPlate, Target
from tests.solver.columns import SEED

STEEL = ShellMaterial(200e9, 0.3, 7800.0)
SPACING, THICKNESS = 5e-3, 0.004
GAP = 0.5 * (THICKNESS + SPACING)


def particles(x: np.ndarray, v: np.ndarray) -> Bird:
    return Bird(x, v, SEED.rho0 * SPACING**3, 1.2 * SPACING, SEED, (1.0, 2.0))


def saddle() -> Plate:
    mesh = plate_mesh(0.2, 0.2, (10, 10))
    mesh.nodes[:, 2] = 0.4 * (mesh.nodes[:, 0] ** 2 - mesh.nodes[:, 1] ** 2)
    return Plate(shell_mesh(mesh.nodes, mesh.quads), THICKNESS, STEEL, "free")


def rubbing_layer(plate: Plate) -> tuple[Bird, Contact]:
    """300 particles pressed into a saddle, flying every way, and a plate that spins: one evaluation of the forces."""
    rng = np.random.default_rng(0)
    x = np.column_stack([rng.uniform(-0.08, 0.08, (300, 2)), np.zeros(300)])
    x[:, 2] = 0.4 * (x[:, 0] ** 2 - x[:, 1] ** 2) + rng.uniform(0.002, 0.006, 300)
    bird = particles(x, rng.normal(0.0, 30.0, x.shape))
    plate.v[:] = rng.normal(0.0, 5.0, plate.v.shape)
    contact = Contact(bird, plate, 0.3)
    contact.update_forces(bird, plate)
    return bird, contact


def test_friction_conserves_linear_and_angular_momentum():
    """Friction acts at the particle's height above the mid-surface: the shell gets the couple as well."""
    plate = saddle()
    bird, contact = rubbing_layer(plate)
    rubbing = contact.rubbing
    assert rubbing is not None
    scale = np.abs(rubbing.on_bird).sum()
    assert scale > 0.02 * np.abs(contact.on_bird).sum()
    assert np.abs(rubbing.on_bird.sum(axis=0) + rubbing.on_plate.sum(axis=0)).max() < 1e-13 * scale
    moment = np.cross(bird.x, rubbing.on_bird).sum(axis=0) + np.cross(plate.x, rubbing.on_plate).sum(axis=0)
    assert np.abs(moment).max() < 1e-9 * scale * 0.1


def test_friction_only_takes_energy():
    """Its power on particles and nodes together is the sum of -|F| |slip|, also on a shell that moves and turns."""
    plate = saddle()
    bird, contact = rubbing_layer(plate)
    rubbing = contact.rubbing
    assert rubbing is not None
    power = (rubbing.on_bird * bird.v).sum() + (rubbing.on_plate * plate.v).sum()
    force = np.linalg.norm(rubbing.on_bird, axis=1)
    normal = np.linalg.norm(contact.normal_forces(), axis=1)
    assert (force <= 0.3 * normal * (1.0 + 1e-12)).all()
    assert (force < 0.3 * normal * (1.0 - 1e-9)).any()
    assert power <= -(force**2).sum() / rubbing.resistance * (1.0 - 1e-9)
    assert force.sum() > 0.0


def slide(plate: Target, mu: float, steps: int, push: float) -> tuple[np.ndarray, np.ndarray, Bird, Contact]:
    """Loose particles, each pressed on a plate by `push` [N], sliding at 1 m/s: time, mean speed, bird, contact."""
    grid = np.stack(np.meshgrid(np.arange(-2, 3), np.arange(-2, 3)), axis=-1).reshape(-1, 2) * 0.03
    bird = particles(np.column_stack([grid, np.full(25, GAP)]), np.tile([1.0, 0.0, 0.0], (25, 1)))
    contact = Contact(bird, plate, mu)
    bird.x[:, 2] -= push / contact.stiffness
    dt = 0.5 * contact.stable_step(bird, plate)
    time, speed = dt * np.arange(steps), np.zeros(steps)
    for step in range(steps):
        speed[step] = bird.v[:25, 0].mean()
        since = dt if step else 0.0
        bird.acceleration[:] = 0.0
        contact.update_forces(bird, plate)
        contact.keep_books(bird, plate, since)
        bird.acceleration[:25, 2] -= push / bird.mass
        bird.kick_and_drift(since or 0.5 * dt, dt)
    return time, speed, bird, contact


def test_a_pressed_layer_slows_at_mu_n_over_m_and_its_heat_is_mu_n_s():
    """Coulomb: v = v0 - mu N t/m; the heat is mu N times the way, and what the layer lost."""
    mu, push, steps = 0.2, 1.0, 150
    plate = RigidPlate(plate_mesh(0.4, 0.4, (10, 10)), THICKNESS)
    time, speed, bird, contact = slide(plate, mu, steps, push)
    assert contact.rubbing is not None
    creep = mu * push / contact.rubbing.resistance
    sliding = (speed > 2.0 * creep) & (time > 0.0)
    assert speed[-1] < 0.5
    assert sliding.sum() > 20
    slope = np.polyfit(time[sliding], speed[sliding], 1)[0]
    assert slope == pytest.approx(-mu * push / bird.mass, rel=1e-6)
    way = (bird.x[:25, 0] - np.repeat(np.arange(-2, 3)[None, :], 5, axis=0).ravel() * 0.03).mean()
    lost = 0.5 * bird.mass * (1.0 - bird.v[:25, 0].mean() ** 2)
    assert contact.accounts["friction"] / 25 == pytest.approx(lost, rel=0.01)
    assert contact.accounts["friction"] / 25 == pytest.approx(mu * push * way, rel=0.01)
    assert abs(contact.accounts["contact"]) < 1e-6 * contact.accounts["friction"]


def test_a_slow_layer_sticks():
    """Below the creep speed the layer comes to rest exponentially and never slides back."""
    plate = RigidPlate(plate_mesh(0.4, 0.4, (10, 10)), THICKNESS)
    _, speed, _, _ = slide(plate, 2.0, 60, 400.0)
    assert (speed >= 0.0).all()
    assert speed[-1] < 1e-6
