"""Strength in updated-Lagrangian SPH: exact conservation, objectivity, erosion, and whole strikes of every model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from birdstrike.reports.verification.columns import SMOOTHING, block, images_of
from birdstrike.solver.bird.eos.linear_polynomial import linear_polynomial
from birdstrike.solver.bird.materials.solid import Solid
from birdstrike.solver.bird.shape import slope_gain
from birdstrike.solver.bird.sph_strength import SolidBird
from birdstrike.solver.case.case import load_case
from birdstrike.solver.kernels.bird.strength import contraction
from birdstrike.solver.simulate import simulate
from tests.solver.bird.bars import SPACING, cuboid, free_body, steps

LAW = linear_polynomial(938.0, [0.0, 2072e6, 6217e6, 10362e6, 0.0, 0.0, 0.0])
ELASTIC = Solid(LAW, 10.2e6)
GRADIENT = np.array([[100.0, 300.0, -50.0], [20.0, -150.0, 70.0], [-30.0, 10.0, 80.0]])


def shaken_ball(material: Solid = ELASTIC) -> SolidBird:
    """A jittered ball in a linear velocity field, with random deviators."""
    random = np.random.default_rng(0)
    x = cuboid((9, 9, 9))
    x = x[np.linalg.norm(x, axis=1) < 4.2 * SPACING]
    x += 0.2 * SPACING * random.uniform(-1.0, 1.0, x.shape)
    bird = free_body(SolidBird, material, x, x @ GRADIENT.T)
    bird.update_density(0.0)
    bird.stress[:] = random.uniform(-1e6, 1e6, bird.stress.shape)
    bird.stress[:, 2] = -bird.stress[:, 0] - bird.stress[:, 1]
    return bird


def test_velocity_gradient_of_a_linear_field_is_exact():
    bird = shaken_ball()
    d = 0.5 * (GRADIENT + GRADIENT.T)
    w = 0.5 * (GRADIENT - GRADIENT.T)
    expected = [d[0, 0], d[1, 1], d[2, 2], d[0, 1], d[1, 2], d[2, 0], w[2, 1], w[0, 2], w[1, 0]]
    assert np.allclose(bird.rates, expected, rtol=1e-10, atol=1e-8)


def test_stress_forces_conserve_both_momenta_and_their_power_is_that_of_the_stress():
    """Resultant, moment and power against -V s:D at rounding, on a jittered ball with free surfaces."""
    bird = shaken_ball()
    bird.update_forces(0.0)
    force = bird.mass * bird.acceleration
    scale = np.abs(force).sum()
    assert np.abs(force.sum(axis=0)).max() < 1e-13 * scale
    assert np.abs(np.cross(bird.x, force).sum(axis=0)).max() < 1e-12 * scale * np.abs(bird.x).max()
    volume = bird.mass / bird.rho
    taken = sum(v * contraction(s, r) for v, s, r in zip(volume, bird.stress, bird.rates, strict=True))
    assert float((force * bird.v).sum()) == pytest.approx(-taken - bird.repelled.sum(), rel=1e-9)


def test_rigid_spin_keeps_the_stress_of_every_particle():
    """A hundred coarse steps of an exact rotation: invariants to rounding."""
    bird = shaken_ball()
    squared = np.array([contraction(s, s) for s in bird.stress])
    half = 0.05
    c, s = (1.0 - half**2) / (1.0 + half**2), 2.0 * half / (1.0 + half**2)
    q, dt = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]), 1e-5
    for _ in range(100):
        after = bird.x @ q.T
        bird.v[:] = (after - bird.x) / dt
        bird.x[:] = after
        bird.update_density(dt)
    assert np.array([contraction(s, s) for s in bird.stress]) == pytest.approx(squared, rel=1e-9)


def test_stretched_plastic_bar_keeps_its_books_and_erodes_at_the_failure_strain():
    """Energy within 1 % while particles fail; what failed carries no stress and its energy is frozen."""
    material = replace(ELASTIC, yield_stress=3e5, failure_strain=0.3)
    x = cuboid((15, 4, 4))
    v = np.zeros_like(x)
    v[:, 0] = 60.0 * np.tanh(x[:, 0] / (2.0 * SPACING))
    bird = free_body(SolidBird, material, x, v, shock=1.0)
    kinetic = bird.kinetic_energy()
    dt = 0.5 * bird.stable_step(material.fastest_wave(60.0))
    energies = np.array(list(steps(bird, dt, int(3e-4 / dt))))
    gone = ~bird.active
    assert 0 < gone.sum() < bird.n
    assert bird.eps_p[gone].min() > 0.3
    assert bird.eps_p[~gone].max() <= 0.3
    assert bird.von_mises()[gone].max() == 0.0
    assert bird.von_mises().max() <= 3e5 * (1.0 + 1e-9)
    assert bird.energies["eroded"] != 0.0
    assert np.abs(energies / kinetic - 1.0).max() < 0.01


def test_expanding_particles_stay_at_the_pressure_cutoff_and_work_with_it():
    """A uniform expansion of 0.1 % a step about rho0: p = PC in place of K mu, and -p dV by the trapezoidal rule."""
    cutoff, dt = -0.1e6, 1e-6
    x = cuboid((5, 5, 5))
    bird = free_body(SolidBird, replace(ELASTIC, pressure_cutoff=cutoff), x, 1e3 / 3.0 * x)
    middle = len(x) // 2
    bird.update_density(0.0)
    volumes, pressures = [938.0 / bird.rho[middle]], [float(bird.p[middle])]
    assert pressures == [0.0]
    for _ in range(3):
        bird.update_density(dt)
        volumes.append(938.0 / bird.rho[middle])
        pressures.append(float(bird.p[middle]))
        assert bird.works[middle, 0] == pytest.approx(
            -0.5 * (pressures[-2] + pressures[-1]) * (volumes[-1] - volumes[-2]), rel=1e-9
        )
    assert volumes[-1] == pytest.approx(1.003, rel=1e-4)
    assert 2072e6 * (1.0 / volumes[1] - 1.0) < 10.0 * cutoff  # what the law alone would give after one step
    assert pressures[1:] == [cutoff] * 3
    assert float(bird.stored[middle]) == pytest.approx(-cutoff * (volumes[-1] - 0.5 * (1.0 + volumes[1])), rel=1e-6)


@pytest.mark.parametrize(("direction", "modulus"), [(1, 10.2e6), (0, 2072e6 + 4.0 / 3.0 * 10.2e6)])
def test_standing_waves_have_the_speeds_of_an_elastic_solid(direction, modulus):
    """A quarter period of a shear and of a longitudinal wave in a periodic block, sqrt(G/rho) and c_L; within 3 %."""
    x, box = block((16, 3, 3), SPACING, "cubic")
    images = images_of(x, box, (0, 1, 2), 2.6 * SMOOTHING * SPACING)
    k, v = 2.0 * np.pi / box[0], np.zeros_like(x)
    v[:, direction] = 1e-3 * np.cos(k * x[:, 0])
    gain = slope_gain("cubic", SMOOTHING)
    bird = SolidBird(x, v, 938.0 * SPACING**3, SMOOTHING * SPACING, ELASTIC, (0.0, 0.0), images=images, gain=gain)
    quarter = 0.25 * 2.0 * np.pi / (k * np.sqrt(modulus / 938.0))
    dt = 0.01 * quarter  # the crossing is told to a step
    shape, amplitude = np.cos(k * x[:, 0]), []
    for _ in steps(bird, dt, int(1.3 * quarter / dt)):
        amplitude.append(float(shape @ bird.v[: bird.n, direction]))
    assert np.argmax(np.array(amplitude) < 0.0) * dt == pytest.approx(quarter, rel=0.03)


MODELS = ("reference_strike_elastic", "reference_strike_plastic_kinematic", "reference_strike_hydrodynamic")
LAWS = {
    "murnaghan": {"B": "128 MPa", "g": "7.98"},
    "polynomial_k": {"c0": "1482.9 m/s", "k": "2.0"},
    "porous": {"z": "0.1", "mixing": "wood"},
    "table": {"mu": "[-0.1, 0.0, 0.1, 0.3]", "p": "['-200 MPa', '0 MPa', '280 MPa', '1200 MPa']"},
}
SMALL = {
    "bird.particles": "500",
    "plate.elements": "[20, 16]",
    "time.end": "1 ms",
    "time.snapshots": "[]",
    "impact.standoff": "1 mm",
}


@pytest.mark.parametrize("name", MODELS)
def test_energy_balances_with_every_model(name):
    summary = simulate(load_case(name, SMALL)).summary
    assert summary["worst_energy_error"] < 0.01
    assert summary["momentum_error"] < 1e-10
    assert summary["angular_momentum_error"] < 1e-6
    assert 0.0 < summary["deepest_overlap_m"] < 3e-3
    assert summary["eroded_mass_fraction"] < (1e-12 if "elastic" in name else 0.2)


@pytest.mark.parametrize("kind", LAWS)
def test_energy_balances_with_every_law(kind):
    law = {f"bird.material.eos.{key}": text for key, text in LAWS[kind].items()}
    changes = SMALL | {"bird.material.eos.kind": kind, "time.end": "0.5 ms"} | law
    summary = simulate(load_case("reference_strike", changes)).summary
    assert summary["worst_energy_error"] < 0.01
    assert summary["momentum_error"] < 1e-10
    assert summary["peak"]["displacement_centre"]["value"] > 1e-4
