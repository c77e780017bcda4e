"""Waves, shocks and shear flow in hexahedra, against theory."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from birdstrike.solver.bird.hexahedra import HexBird, HexSettings
from birdstrike.solver.bird.materials.elastic import elastic
from birdstrike.solver.bird.materials.solid import Solid
from tests.solver.bird.bricks import SEED, advance, brick, stable_step

YOUNG, RHO = 68.9e6, 938.0


def rubber(poisson: float) -> Solid:
    """A solid of the bird's Young's modulus."""
    return elastic(RHO, YOUNG, poisson)


def wave_period(poisson: float, hourglass: str) -> float:
    """Period [s] of the first longitudinal mode of a free slender bar 0.2 m long, by the phase of its tip velocity."""
    mesh = brick((40, 2, 2), 0.005)
    speed = 0.01 * np.cos(np.pi * mesh.nodes[:, 0] / 0.2)
    material = rubber(poisson)
    bird = HexBird(
        mesh, np.column_stack([speed, 0.0 * speed, 0.0 * speed]), material, HexSettings((0.0, 0.0), hourglass)
    )
    dt = 0.8 * stable_step(bird)
    tip = mesh.nodes[:, 0] < 1e-9
    v, t = [], []
    while len(v) < 4 or np.sum(np.diff(np.sign(v)) != 0) < 3:
        advance(bird, dt, first=not v)
        v.append(float(bird.v[tip, 0].mean()))
        t.append((len(v) - 0.5) * dt)
    crossings = np.flatnonzero(np.diff(np.sign(v)) != 0)
    zero = [t[i] - v[i] * (t[i + 1] - t[i]) / (v[i + 1] - v[i]) for i in crossings]
    return zero[2] - zero[0]


@pytest.mark.parametrize("hourglass", ["viscous", "stiffness"])
def test_bar_rings_at_the_frequency_of_theory(hourglass):
    """First longitudinal mode of a free bar: f = sqrt(E/rho)/(2 L), less (nu pi r/L)^2/2 (Rayleigh), within 0.5 %."""
    polar = (2 * 0.01**2 / 12.0) / 1.0  # radius of gyration squared about the axis, of a square of 10 mm
    expected = 2.0 * 0.2 / np.sqrt(YOUNG / RHO) * (1.0 + 0.5 * (0.3 * np.pi / 0.2) ** 2 * polar)
    assert wave_period(0.3, hourglass) == pytest.approx(expected, rel=5e-3)


@pytest.mark.parametrize("u", [45.55, 200.0])
def test_hugoniot_pressure_of_planar_impact(u):
    """A column thrown at u against a rigid wall: p = rho0 (C + S1 u) u within 1 %, and so the shock's speed.

    Sides held (planar), plateau mean behind the front; the energy consumed between two instants gives the mass flow
    through the shock and hence its speed; the energy balance closes to 0.1 %.
    """
    mesh = brick((150, 1, 1), 0.004)
    bird = HexBird(mesh, np.tile([-u, 0.0, 0.0], (len(mesh.nodes), 1)), SEED)
    held = np.zeros_like(mesh.nodes)
    held[:, 1:] = 1.0
    wall = mesh.nodes[:, 0] < 1e-9
    bird.v[wall], held[wall] = 0.0, 1.0
    start = bird.kinetic_energy()
    shock = 1670.0 + 2.48 * u
    dt, kinetic, energy = 0.3 * stable_step(bird), [], 0.0
    steps = int(0.7 * 0.6 / shock / dt)
    for step in range(steps):
        energy = advance(bird, dt, first=step == 0, held=held)
        kinetic.append(bird.kinetic_energy())
    front = (shock - u) * steps * dt
    centre = bird.x[bird.elements, 0].mean(axis=1)
    plateau = (centre > 0.2 * front) & (centre < 0.8 * front)
    stress = (bird.pressure + bird.q)[plateau].mean()
    assert stress == pytest.approx(938.0 * shock * u, rel=0.01)
    third = steps // 3
    flow = (kinetic[third] - kinetic[-1]) / (0.5 * u**2) / ((steps - 1 - third) * dt)
    assert flow / (938.0 * 0.004**2) == pytest.approx(shock, rel=0.01)
    assert energy == pytest.approx(start, rel=1e-3)


def test_sheared_viscous_block_dissipates_what_theory_says():
    """Simple shear at gamma' by prescribed velocities: MU gamma'^2 V per second, no shock viscosity."""
    mesh = brick((3, 3, 3), 0.01)
    material = replace(SEED, viscosity=500.0)
    bird = HexBird(mesh, mesh.nodes[:, [2, 0, 0]] * np.array([50.0, 0.0, 0.0]), material)
    for step in range(21):
        advance(bird, 1e-6, first=step == 0, held=np.ones_like(mesh.nodes))
    expected = 500.0 * 50.0**2 * 0.03**3 * 20 * 1e-6
    assert bird.energies["bird_viscous"] == pytest.approx(expected, rel=1e-9)
    assert abs(bird.energies["bird_shock"]) < 1e-12 * expected
