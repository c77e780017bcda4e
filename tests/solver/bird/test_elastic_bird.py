"""The elastic bird: it stays in one piece, conserves energy, and rings at the frequencies of a bar."""

from __future__ import annotations

import numpy as np
import pytest

from birdstrike.data.errors import RunFailed
from birdstrike.solver.bird.materials.elastic import elastic
from birdstrike.solver.bird.total_lagrangian import ElasticBird
from tests.solver.bird.bars import SPACING, angular_momentum, cuboid, free_body, steps

SEED = elastic(938.0, 68.9e6, 0.49)
MODERATE = elastic(938.0, 68.9e6, 0.3)
GRADIENT = np.array([[1.2, 0.3, -0.05], [0.02, 0.9, 0.07], [-0.03, 0.01, 1.1]])


def turn(angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def test_deformation_gradient_of_an_affine_map_is_exact_and_hourglass_free():
    """Up to the free surface; inside, no force at all."""
    x = cuboid((7, 7, 7))
    bird = free_body(ElasticBird, SEED, x, np.zeros_like(x))
    bird.x[:] = x @ GRADIENT.T
    bird.update_density(0.0)
    bird.update_forces(0.0)
    assert np.allclose(bird.lattice_row[:, 6:15], GRADIENT.ravel(), atol=1e-12)
    scale = np.abs(bird.acceleration).max()
    assert np.abs(bird.penalty).max() < 1e-10 * scale
    middle = np.linalg.norm(x, axis=1) < 0.1 * SPACING
    assert np.abs(bird.acceleration[middle]).max() < 1e-10 * scale


def test_stress_is_that_of_uniaxial_tension_and_turns_with_the_body():
    """Small strain: E in a bar with free sides; any rotation leaves von Mises and pressure as they are."""
    x, strain = cuboid((5, 5, 5)), 1e-6
    bird = free_body(ElasticBird, MODERATE, x, np.zeros_like(x))
    stretch = np.diag([1.0 + strain, 1.0 - 0.3 * strain, 1.0 - 0.3 * strain])
    bird.x[:] = x @ stretch.T
    bird.update_density(0.0)
    assert bird.von_mises() == pytest.approx(68.9e6 * strain, rel=1e-5)
    assert bird.p == pytest.approx(-68.9e6 * strain / 3.0, rel=1e-5)
    found = []
    for angle in (0.0, 0.4, 2.0):
        bird.x[:] = x @ (turn(angle) @ GRADIENT).T
        bird.update_density(0.0)
        found.append((bird.von_mises(), bird.p.copy()))
    assert np.allclose(found[1], found[0], rtol=1e-10)
    assert np.allclose(found[2], found[0], rtol=1e-10)


def test_forces_are_minus_the_gradient_of_the_stored_energy_and_conserve():
    """Without hourglass control, by finite differences; with it, resultant force and moment vanish to rounding."""
    x = cuboid((4, 4, 4))
    bird = free_body(ElasticBird, MODERATE, x, np.zeros_like(x))
    shaken = x @ GRADIENT.T + 0.1 * SPACING * np.random.default_rng(0).uniform(-1.0, 1.0, x.shape)

    def stored(particle: int, move: float) -> float:
        bird.x[:] = shaken
        bird.x[particle, 1] += move
        bird.update_density(0.0)
        return bird.volume * bird.energy.sum()

    slope = (stored(21, 1e-8) - stored(21, -1e-8)) / 2e-8
    stored(21, 0.0)
    bird.update_forces(0.0)
    force = bird.mass * bird.acceleration
    assert force[21, 1] - bird.mass * bird.penalty[21, 1] == pytest.approx(-slope, rel=1e-5)
    scale = np.abs(force).sum()
    assert np.abs(force.sum(axis=0)).max() < 1e-13 * scale
    assert np.abs(np.cross(bird.x, force).sum(axis=0)).max() < 1e-13 * scale * np.abs(x).max()


def test_bar_rings_at_its_longitudinal_frequency():
    """Half a period is L/c, c = sqrt(E/rho), of a bar six times as long as wide; within 3 %."""
    x = cuboid((30, 5, 5))
    length = 30 * SPACING
    v = np.zeros_like(x)
    v[:, 0] = 0.1 * np.sin(np.pi * x[:, 0] / length)
    bird = free_body(ElasticBird, MODERATE, x, v)
    dt = 0.5 * bird.stable_step(MODERATE.fastest_wave(1e-3))
    end, elongation = x[:, 0] > 0.45 * length, []
    for _ in steps(bird, dt, int(1.2 * length / np.sqrt(68.9e6 / 938.0) / dt)):
        elongation.append(bird.x[: bird.n][end, 0].mean() - x[end, 0].mean())
    back = int(np.argmax(np.array(elongation[5:]) < 0.0)) + 5
    assert back > 5
    assert back * dt == pytest.approx(length / np.sqrt(68.9e6 / 938.0), rel=0.03)


def test_spun_bar_stays_whole_and_keeps_its_angular_momentum():
    """Two turns at a tip speed that stretches it by a tenth: momentum to rounding, energy within 1 %, no gap."""
    x = cuboid((17, 4, 4))
    spin = 1500.0
    v = spin * np.stack([-x[:, 1], x[:, 0], np.zeros(len(x))], axis=1)
    bird = free_body(ElasticBird, SEED, x, v)
    dt = 0.5 * bird.stable_step(SEED.fastest_wave(1e-3))
    start, kinetic = angular_momentum(bird), bird.kinetic_energy()
    energies = np.array(list(steps(bird, dt, int(4.0 * np.pi / spin / dt))))
    assert np.abs(energies / kinetic - 1.0).max() < 0.01
    assert np.linalg.norm(angular_momentum(bird) - start) < 0.01 * np.linalg.norm(start)
    stretch = np.linalg.norm(bird.lattice_row[:, 6:15].reshape(-1, 3, 3), ord=2, axis=(1, 2))
    assert 1.0 < stretch.max() < 1.4
    assert bird.jacobian.min() > 0.9


def test_stretched_bar_does_not_fracture_and_comes_back():
    """Pulled to 1.4 lengths it springs back to 0.7 and out again: smooth strain, energy kept within 1 %."""
    x = cuboid((17, 4, 4))
    v = np.zeros_like(x)
    v[:, 0] = 4500.0 * x[:, 0]
    bird = free_body(ElasticBird, SEED, x, v)
    dt = 0.2 * bird.stable_step(SEED.fastest_wave(1e-3))
    kinetic = bird.kinetic_energy()
    lengths, errors = [], []
    for energy in steps(bird, dt, int(9e-4 / dt)):
        lengths.append(np.ptp(bird.x[:, 0]) / np.ptp(x[:, 0]))
        errors.append(energy / kinetic - 1.0)
        middle = np.abs(x[:, 0]) < 6.1 * SPACING
        along = bird.lattice_row[middle, 6]
        assert along.max() < 1.6 * along.mean()
    assert max(lengths) > 1.3
    assert min(lengths) < 0.8
    assert lengths[-1] > 1.1
    assert np.abs(errors).max() < 0.01
    assert bird.energies["bird_hourglass"] < 0.05 * kinetic


def test_a_particle_turned_inside_out_ends_the_run():
    x = cuboid((5, 5, 5))
    bird = free_body(ElasticBird, SEED, x, np.zeros_like(x))
    bird.x[:, 0] *= -1.0
    with pytest.raises(RunFailed, match=r"inside out; lower solver\.courant"):
        bird.update_density(1e-6)
