"""The one-point hexahedron: exact volume and gradient, objectivity, hourglass control, yield, erosion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from birdstrike.solver.bird.eos.grueneisen import grueneisen
from birdstrike.solver.bird.eos.logarithmic import logarithmic
from birdstrike.solver.bird.hexahedra import HexBird, HexSettings
from birdstrike.solver.bird.materials.elastic import elastic
from birdstrike.solver.bird.materials.fluid import Fluid
from birdstrike.solver.bird.materials.solid import Solid
from tests.solver.bird.bricks import SEED, advance, brick, skewed, stable_step

YOUNG, RHO = 68.9e6, 938.0


def rubber(poisson: float) -> Solid:
    """A solid of the bird's Young's modulus."""
    return elastic(RHO, YOUNG, poisson)


def test_gradient_is_the_derivative_of_the_volume():
    """Central differences of the trilinear volume by 2 x 2 x 2 Gauss points, one node coordinate at a time."""
    mesh = skewed(brick((1, 1, 1), 1.0), 0.2)
    bird = HexBird(mesh, np.zeros((8, 3)), SEED)
    assert bird.volume[0] == pytest.approx(mesh.volumes[0], rel=1e-14)
    for corner in range(8):
        for axis in range(3):
            node, step = mesh.cells[0, corner], 1e-5
            volumes = []
            for side in (-step, step):
                moved = replace(mesh, nodes=mesh.nodes.copy())
                moved.nodes[node, axis] += side
                volumes.append(moved.volumes[0])
            slope = (volumes[1] - volumes[0]) / (2.0 * step)
            assert bird.gradient[0, axis, corner] == pytest.approx(slope, abs=1e-9)


def test_patch_of_distorted_elements_has_a_linear_field_exactly():
    """v = A x: every element, however skewed, sees L = A and no hourglass rate."""
    mesh = skewed(brick((4, 3, 3), 0.01), 0.002)
    field = np.random.default_rng(1).normal(size=(3, 3)) * 100.0
    bird = HexBird(mesh, mesh.nodes @ field.T, SEED)
    bird.update_density(0.0)
    assert bird.rate.reshape(-1, 3, 3) == pytest.approx(np.broadcast_to(field, (36, 3, 3)), abs=1e-11)
    assert np.abs(bird.hourglass_rate).max() < 1e-12


def test_patch_of_distorted_elements_carries_a_uniform_stress_in_equilibrium():
    """A uniform stress puts no force on an inner node of a skewed patch."""
    mesh = skewed(brick((4, 4, 4), 0.01), 0.002)
    bird = HexBird(mesh, np.zeros_like(mesh.nodes), SEED)
    bird.s[:] = np.random.default_rng(2).normal(size=6) * 1e5
    bird.update_forces(0.0)
    grid = np.arange(125).reshape(5, 5, 5)
    inner, outer = grid[1:-1, 1:-1, 1:-1].ravel(), grid[0].ravel()
    force = bird.masses[:, None] * bird.acceleration
    assert np.abs(force[inner]).max() < 1e-12 * np.abs(force[outer]).max()


@pytest.mark.parametrize("hourglass", ["viscous", "stiffness"])
def test_forces_keep_linear_and_angular_momentum(hourglass):
    """Random stress and velocities on a skewed patch: no resultant, no moment, hourglass forces included."""
    mesh = skewed(brick((3, 3, 3), 0.01), 0.002)
    rng = np.random.default_rng(3)
    bird = HexBird(mesh, rng.normal(size=mesh.nodes.shape), rubber(0.4), HexSettings(hourglass=hourglass))
    advance(bird, 1e-6)
    advance(bird, 1e-6)
    bird.update_density(1e-6)
    bird.update_forces(1e-6)
    assert np.abs(bird.hourglass).max() > 0.0
    force = bird.masses[:, None] * bird.acceleration
    scale = np.abs(force).sum()
    assert np.abs(force.sum(axis=0)).max() < 1e-13 * scale
    assert np.abs(np.cross(bird.x, force).sum(axis=0)).max() < 1e-13 * scale * 0.03


def test_spinning_stressed_block_keeps_its_stress():
    """One full turn of a stressed block in 400 steps, its motion prescribed: the stress is back where it was, turned
    with it on the way; rotation alone makes no pressure and no hourglass force."""
    mesh = skewed(brick((2, 2, 2), 0.01), 0.001)
    bird = HexBird(mesh, np.zeros_like(mesh.nodes), rubber(0.4), HexSettings(hourglass="stiffness"))
    bird.s[:] = np.array([2e5, -1e5, -1e5, 5e4, -3e4, 1e4])
    before, steps, spin = bird.s.copy(), 400, np.array([600.0, 0.0, 800.0])
    angle = 2.0 * np.pi / steps
    dt = 2.0 * np.tan(0.5 * angle) / 1000.0  # then x + dt v is the exact rotation by `angle`
    half = np.array([[0.0, -spin[2], spin[1]], [spin[2], 0.0, -spin[0]], [-spin[1], spin[0], 0.0]]) * 0.5 * dt
    rotation = np.linalg.solve(np.eye(3) - half, np.eye(3) + half)
    for _ in range(steps):
        after = bird.x @ rotation.T
        bird.v, bird.x = (after - bird.x) / dt, after
        bird.update_density(dt)
    assert bird.s == pytest.approx(before, abs=1e-6 * 2e5)
    assert np.abs(bird.pressure).max() < 1e-6 * 2e5
    assert np.abs(bird.hourglass).max() < 1e-9


@pytest.mark.parametrize("hourglass", ["viscous", "stiffness"])
def test_hourglass_modes_are_resisted(hourglass):
    """A pure hourglass velocity has no strain; its energy is counted as hourglass energy and is not lost."""
    mesh = brick((1, 1, 1), 0.01)
    v = np.zeros((8, 3))
    v[:, 0] = np.array([1, -1, 1, -1, 1, -1, 1, -1])[np.argsort(mesh.cells[0])]
    bird = HexBird(mesh, v, rubber(0.4), HexSettings((0.0, 0.0), hourglass))
    start, dt = bird.kinetic_energy(), 0.05 * stable_step(bird)
    least, energy = start, 0.0
    for step in range(800):
        energy = advance(bird, dt, first=step == 0)
        least = min(least, bird.kinetic_energy())
    assert least < 0.6 * start
    assert energy == pytest.approx(start, rel=0.005)


def test_a_bar_bends_with_little_hourglass_energy():
    """Free bending of an elastic bar, five elements thick: hourglass work stays below 5 % of the energy."""
    mesh = brick((28, 3, 5), 0.003)
    x = mesh.nodes[:, 0] / mesh.nodes[:, 0].max()
    v = np.zeros_like(mesh.nodes)
    v[:, 2] = 0.5 * (np.sin(np.pi * x) - 2.0 / np.pi)
    bird = HexBird(mesh, v, rubber(0.4), HexSettings((0.0, 0.0), "stiffness", 0.05))
    start, dt, most, energy = bird.kinetic_energy(), 0.8 * stable_step(bird), 0.0, 0.0
    for step in range(1500):
        energy = advance(bird, dt, first=step == 0)
        most = max(most, bird.energies["bird_hourglass"])
    assert 0.0 < most < 0.05 * start
    assert energy == pytest.approx(start, rel=0.002)


def test_plastic_bar_stays_at_its_yield_stress():
    """Uniaxial strain far beyond yield: von Mises stress is the yield stress, the plastic work is counted."""
    shear, bulk, sigma_y = 2.3e7, 1.1e8, 3e5
    material = Solid(logarithmic(RHO, bulk), shear, sigma_y)
    mesh = brick((2, 1, 1), 0.01)
    v = np.zeros_like(mesh.nodes)
    v[:, 0] = 100.0 * mesh.nodes[:, 0]
    bird = HexBird(mesh, v, material)
    for step in range(2000):
        advance(bird, 1e-6, first=step == 0, held=np.ones_like(v))
    von_mises = np.sqrt(1.5 * ((bird.s[:, :3] ** 2).sum(axis=1) + 2.0 * (bird.s[:, 3:] ** 2).sum(axis=1)))
    assert von_mises == pytest.approx(sigma_y, rel=1e-9)
    strain = np.log(bird.x[:, 0].max() / 0.02)
    assert bird.eps_p == pytest.approx(2.0 / 3.0 * (strain - sigma_y / (2.0 * shear)), rel=0.02)
    assert bird.energies["bird_stress"] > 0.0


def test_eroded_elements_free_their_nodes_and_their_energy_stays():
    """V/V0 beyond TEROD: the element goes, nodes without a live one fly on, every joule stays in the balance."""
    mesh = brick((6, 1, 1), 0.01)
    v = np.zeros_like(mesh.nodes)
    v[:, 0] = np.where(mesh.nodes[:, 0] > 0.045, 20.0, 0.0)
    bird = HexBird(mesh, v, replace(SEED, tension_erosion=1.05))
    start, dt, momentum, energy = bird.kinetic_energy(), 0.3 * stable_step(bird), bird.masses @ bird.v, 0.0
    for step in range(400):
        energy = advance(bird, dt, first=step == 0)
    facts = bird.facts()
    assert facts["eroded_particles"] >= 1
    assert facts["eroded_mass_fraction"] == pytest.approx(facts["eroded_particles"] / 6.0)
    assert bird.energies["eroded"] > 0.0
    assert bird.active.sum() == len(np.unique(bird.cells))
    assert bird.masses @ bird.v == pytest.approx(momentum, abs=1e-12)
    assert energy == pytest.approx(start, rel=0.005)


def test_a_flattened_element_goes_when_its_step_is_too_short():
    """Squeezed at constant volume, an element is eroded where its stable step passes `smallest_step` of the first."""
    mesh = brick((1, 1, 1), 0.01)
    bird = HexBird(
        mesh,
        np.zeros((8, 3)),
        Fluid(grueneisen(938.0, 1670.0, 2.48)),
        HexSettings((0.0, 0.0), smallest_step=0.4),
    )
    bird.step_at_impact(1e-6)
    first = bird.shortest_step / 0.4
    flattest = np.inf
    for flat in np.linspace(1.0, 0.1, 181):
        if bird.alive[0]:
            bird.x = mesh.nodes * np.array([flat, flat**-0.5, flat**-0.5])
            bird.update_density(0.0)
            flattest = min(flattest, flat)
    assert not bird.alive[0]
    size = np.sqrt((flattest**-2 + 2.0 * flattest) / 3.0)  # |B|/V over a cube's
    assert 1.0 / size == pytest.approx(0.4, abs=0.01)
    assert first == pytest.approx(0.01 / (np.sqrt(3.0) * 1670.0), rel=1e-6)
