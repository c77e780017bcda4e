"""SPH of the bird: exact gradients, conservation, viscosity as stated, sound speed, shock viscosity on shocks only."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from birdstrike.reports.verification.columns import SEED, SMOOTHING, advance, block, periodic_bird
from birdstrike.solver.bird.eos.grueneisen import grueneisen
from birdstrike.solver.bird.materials.fluid import Fluid
from birdstrike.solver.bird.sph import Bird
from birdstrike.solver.kernels.bird.sph import shock_share


def ball(velocity_gradient: np.ndarray, viscosity: float = 0.0, jitter: float = 0.0) -> Bird:
    """A jittered ball of bird in a linear velocity field."""
    spacing = 5e-3
    x, box = block((7, 7, 7), spacing)
    x = x - 0.5 * box
    x = x[np.linalg.norm(x, axis=1) < 0.45 * box[0]]
    x += jitter * spacing * np.random.default_rng(0).uniform(-1.0, 1.0, x.shape)
    material = replace(SEED, viscosity=viscosity)
    v = x @ velocity_gradient.T
    return Bird(x, v, SEED.rho0 * spacing**3, SMOOTHING * spacing, material, (1.0, 2.0))


GRADIENT = np.array([[100.0, 300.0, -50.0], [20.0, -150.0, 70.0], [-30.0, 10.0, 80.0]])


def test_rate_of_deformation_of_a_linear_field_is_exact():
    """To rounding, up to the free surface, on a jittered lattice."""
    bird = ball(GRADIENT, jitter=0.2)
    bird.update_density(0.0)
    d = 0.5 * (GRADIENT + GRADIENT.T)
    expected = [d[0, 0], d[1, 1], d[2, 2], d[0, 1], d[1, 2], d[2, 0]]
    assert np.allclose(bird.deformation, expected, rtol=1e-10, atol=1e-8)


def test_rigid_spin_changes_no_density():
    """Half-step velocities on half-step positions: a turning bird does not swell, to rounding, at a large step."""
    spin = np.array([[0.0, -2000.0, 0.0], [2000.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    bird = ball(spin)
    dt = 1e-5
    bird.x += 0.5 * dt * bird.v
    bird.update_density(dt)
    assert np.abs(bird.rho / SEED.rho0 - 1.0).max() < 1e-12


@pytest.mark.parametrize(("viscosity", "couple"), [(0.0, 1e-13), (641.0, 1e-4)])
def test_pair_forces_conserve_linear_and_angular_momentum(viscosity, couple):
    """Of a jittered, compressed ball: resultant force at rounding of the summed magnitudes, and the moment too but for
    the viscous stress, whose pairs are not central."""
    bird = ball(GRADIENT, viscosity=viscosity, jitter=0.2)
    bird.update_density(0.0)
    bird.p[:] = np.random.default_rng(1).uniform(-1e6, 5e7, bird.n)
    bird.update_forces(0.0)
    force = bird.mass * bird.acceleration
    scale = np.abs(force).sum()
    assert np.abs(force.sum(axis=0)).max() < 1e-13 * scale
    assert np.abs(np.cross(bird.x, force).sum(axis=0)).max() < couple * scale * np.abs(bird.x).max()


def test_viscosity_conserves_and_only_dissipates():
    """The power of the viscous pair forces is minus the reported dissipation, and the pairs' share is positive."""
    bird = ball(GRADIENT, viscosity=641.0, jitter=0.2)
    bird.shock[:] = 0.0
    bird.update_density(0.0)
    bird.update_forces(0.0)
    power = bird.mass * float((bird.acceleration * bird.v).sum())
    dissipated = 641.0 * bird.dissipation[:, 0].sum()
    assert power == pytest.approx(-dissipated, rel=1e-10)
    assert dissipated > 0.0


@pytest.mark.parametrize(("direction", "modulus"), [(1, 1.0), (0, 4.0 / 3.0)])
def test_viscous_stress_is_twice_mu_times_the_deviator(direction, modulus):
    """div(2 MU dev D) of a sine wave along x: MU v'' across it (shear) and 4/3 MU v'' along it; within 5 %."""
    mu = 641.0
    bird, box = periodic_bird((16, 4, 4), 5e-3, (0, 1, 2), replace(SEED, viscosity=mu), (0.0, 0.0))
    k = 2.0 * np.pi / box[0]
    bird.v[: bird.n, direction] = np.sin(k * bird.x[: bird.n, 0])
    bird.refresh_images()
    bird.update_density(0.0)
    bird.update_forces(0.0)
    expected = -modulus * mu * k**2 / SEED.rho0 * bird.v[: bird.n, direction]
    measured = bird.acceleration[: bird.n, direction]
    assert measured @ expected / (expected @ expected) == pytest.approx(1.0, abs=0.05)


def test_shear_wave_decays_at_the_viscous_rate():
    """exp(-MU k^2 t/rho): the viscosity that acts in time is the one of the case, the shock viscosity adds < 1 %."""
    mu = 641.0
    bird, box = periodic_bird((12, 3, 3), 5e-3, (0, 1, 2), replace(SEED, viscosity=mu))
    k = 2.0 * np.pi / box[0]
    bird.v[: bird.n, 1] = 5.0 * np.sin(k * bird.x[: bird.n, 0])
    bird.refresh_images()
    start = np.sqrt((bird.v[: bird.n, 1] ** 2).mean())
    dt, steps = 1e-6, 150
    for step in range(steps):
        advance(bird, dt, first=step == 0)
    rate = -np.log(np.sqrt((bird.v[: bird.n, 1] ** 2).mean()) / start) / ((steps - 0.5) * dt)
    assert rate == pytest.approx(mu * k**2 / SEED.rho0, rel=0.05)
    shock = bird.dissipation[: bird.n, 1].sum()
    assert shock < 0.01 * mu * bird.dissipation[: bird.n, 0].sum()


def standing_wave_speed(cells: int) -> float:
    """Sound speed [m/s] from the quarter period of a standing wave of one box length."""
    unbroken = replace(SEED, pressure_cutoff=-1e9)
    bird, box = periodic_bird((cells, 3, 3), 5e-3, (0, 1, 2), unbroken, (0.0, 0.0))
    k = 2.0 * np.pi / box[0]
    shape = np.sin(k * bird.x[: bird.n, 0])
    bird.v[: bird.n, 0] = 0.5 * shape
    bird.refresh_images()
    dt = 0.4 * bird.stable_step(SEED.eos.sound_speed)
    amplitude = []
    while not amplitude or amplitude[-1] > 0.0:
        advance(bird, dt, first=not amplitude)
        amplitude.append(shape @ bird.v[: bird.n, 0])
    a, b = amplitude[-2:]
    return 0.5 * np.pi / (k * (len(amplitude) - 1.5 + a / (a - b)) * dt)


def test_sound_wave_converges_to_the_speed_of_sound():
    """Second order in spacing over wavelength: the slope's gain makes the lattice sum itself exact."""
    coarse, fine = (1.0 - standing_wave_speed(cells) / SEED.eos.sound_speed for cells in (12, 24))
    assert 0.0 < fine < 0.006
    assert np.log2(coarse / fine) == pytest.approx(2.0, abs=0.3)


def test_shock_share_tells_compression_from_shear_and_stagnation():
    assert shock_share(np.array([-1.0, 0.0, 0.0, 0.0, 0.0, 0.0])) == pytest.approx(1.0)
    assert shock_share(np.array([-1.0, -1.0, -1.0, 0.0, 0.0, 0.0])) == 1.0
    assert shock_share(np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])) == 0.0
    assert shock_share(np.array([0.0, 0.0, 0.0, 3.0, 0.0, 0.0])) == 0.0
    assert shock_share(np.array([-2.0, 1.0, 0.999, 0.0, 0.0, 0.0])) < 1e-4


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_shock_share_of_a_compression_that_is_sheared_as_well(axis):
    """5/3 div^2/(div^2 + D':D'): beside -1 along an axis, D':D' = 2/3 + 2 s^2 makes it 1/2 at s^2 = 5/6."""
    rate = np.zeros(6)
    rate[axis], rate[3 + axis] = -1.0, np.sqrt(5.0 / 6.0)
    assert shock_share(rate) == pytest.approx(0.5, rel=1e-12)


def test_sheared_bird_is_warmed_by_its_viscosity_and_its_pressure_rises_by_grueneisens_gamma():
    """Simple shear at constant volume: energy MU rate^2 dt, pressure gamma times it; inside a ball within 2 %."""
    viscosity, rate, dt, gamma = 641.0, 2000.0, 1e-8, 1.5
    shear = np.zeros((3, 3))
    shear[0, 1] = rate
    spacing, material = 5e-3, Fluid(grueneisen(938.0, 1670.0, 2.48, g0=gamma), -1e6, viscosity)
    x = ball(shear).x
    bird = Bird(x, x @ shear.T, 938.0 * spacing**3, SMOOTHING * spacing, material, (1.0, 2.0))
    for step in (0.0, dt):
        bird.update_density(step)
        bird.update_forces(step)
    inside = np.linalg.norm(x, axis=1) < spacing
    heat = viscosity * rate**2 * dt
    assert bird.energy[inside] == pytest.approx(np.full(inside.sum(), heat), rel=0.02)
    assert bird.p[inside] == pytest.approx(gamma * bird.energy[inside], rel=2e-3)


def test_linear_shear_raises_no_shock_viscosity():
    """In pure shear the reconstructed velocities have no jump: nothing is dissipated but by MU."""
    shear = np.zeros((3, 3))
    shear[0, 1] = 2000.0
    bird = ball(shear, viscosity=1.0)
    bird.update_density(0.0)
    bird.update_forces(0.0)
    assert bird.dissipation[:, 1].sum() < 1e-12 * bird.dissipation[:, 0].sum() * 1500.0
