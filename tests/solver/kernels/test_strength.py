"""Strength of the bird at a point: closed forms of J2 plasticity, and objectivity under rotation."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

from birdstrike.solver.kernels.bird.strength import contraction, rate_factor, rotate, update_deviator

E, NU, SIGMA_Y, ET = 200e9, 0.3, 250e6, 20e9
G, K, EP = E / (2.0 * (1.0 + NU)), E / (3.0 * (1.0 - 2.0 * NU)), E * ET / (E - ET)


def constants(beta: float, rate_c: float = 0.0, rate_p: float = 1.0, sigma_y: float = SIGMA_Y) -> np.ndarray:
    return np.array([G, sigma_y, beta * EP, (1.0 - beta) * EP, rate_c, rate_p])


def uniaxial(strains: np.ndarray, strength: np.ndarray) -> np.ndarray:
    """Axial stress of a bar with free sides along a path of axial strains; the sides' strain by root finding."""
    stress, back, eps_p, volume, before = np.zeros(6), np.zeros(6), 0.0, 0.0, 0.0
    axial = []
    for strain in strains:
        step = strain - before

        state = (stress, back, eps_p, volume, step, strength)
        reach = 2.0 * abs(step) + 1e-12
        lateral: float = brentq(side_stress, -reach, reach, args=state, xtol=1e-20, rtol=1e-15)  # pyright: ignore
        rate = strain_rate(step, lateral)
        eps_p = update_deviator(stress, back, eps_p, rate, 0.0, 0.0, 0.0, 1.0, strength)
        volume, before = volume + step + 2.0 * lateral, strain
        axial.append(stress[0] + K * volume)
    return np.array(axial)


def side_stress(lateral, stress, back, eps_p, volume, step, strength) -> float:
    """Lateral stress after a step of axial and lateral strain."""
    trial, trial_back = stress.copy(), back.copy()
    update_deviator(trial, trial_back, eps_p, strain_rate(step, lateral), 0.0, 0.0, 0.0, 1.0, strength)
    return trial[1] + K * (volume + step + 2.0 * lateral)


def strain_rate(axial: float, lateral: float) -> np.ndarray:
    return np.array([axial, lateral, lateral, 0.0, 0.0, 0.0])


@pytest.mark.parametrize("beta", [0.0, 0.3, 1.0])
def test_uniaxial_tension_and_reversal_follow_the_bilinear_law(beta):
    """sigma_y + Et (eps - eps_y) up; back, yield after an elastic span of 2 sigma_y + 2 BETA (sigma - sigma_y)."""
    up = np.linspace(0.0, 0.01, 41)[1:]
    top = SIGMA_Y + ET * (0.01 - SIGMA_Y / E)
    span = 2.0 * (SIGMA_Y + beta * (top - SIGMA_Y))
    down = 0.01 - np.linspace(0.0, 0.01, 41)[1:]
    found = uniaxial(np.concatenate([up, down]), constants(beta))
    elastic_up = np.where(up < SIGMA_Y / E, E * up, SIGMA_Y + ET * (up - SIGMA_Y / E))
    back = 0.01 - down
    elastic_down = np.where(back < span / E, top - E * back, top - span - ET * (back - span / E))
    assert found == pytest.approx(np.concatenate([elastic_up, elastic_down]), rel=1e-10, abs=1e-10 * SIGMA_Y)


@pytest.mark.parametrize("beta", [0.0, 0.5, 1.0])
def test_simple_shear_monotone_and_cyclic(beta):
    """tau: G up to tau_y = sigma_y/sqrt3, then G Ep/(3G + Ep); the elastic span of a reversal as in tension."""
    strength, tau_y, slope = constants(beta), SIGMA_Y / np.sqrt(3.0), G * EP / (3.0 * G + EP)
    stress, back, eps_p, gamma, step = np.zeros(6), np.zeros(6), 0.0, 0.0, 1e-4
    center = radius = None
    for direction, count in ((1.0, 100), (-1.0, 200), (1.0, 150)):
        turn, tau_turn = gamma, stress[3]
        half = tau_y if radius is None else radius
        reach = half if center is None else half + abs(tau_turn - center)
        for _ in range(count):
            gamma += direction * step
            eps_p = update_deviator(
                stress, back, eps_p, np.array([0.0, 0.0, 0.0, 0.5 * direction * step, 0.0, 0.0]), 0, 0, 0, 1.0, strength
            )
            way = abs(gamma - turn)
            expected = G * way if G * way < reach else reach + slope * (way - reach / G)
            assert stress[3] == pytest.approx(tau_turn + direction * expected, rel=1e-10, abs=1e-10 * tau_y)
        radius = tau_y + beta * EP * eps_p / np.sqrt(3.0)
        center = stress[3] - direction * radius
    assert eps_p > 0.015


def test_rigidly_spinning_stressed_body_keeps_its_stress():
    """A thousand turns at coarse steps about a skew axis: the invariants stay, and the stress turns with the body."""
    start = np.array([3.0, -1.0, -2.0, 0.5, -0.7, 0.9])
    axis = np.array([1.0, 2.0, -2.0]) / 3.0
    stress, back = start.copy(), 0.5 * start
    strength = constants(0.5, sigma_y=np.inf)
    steps = 64
    half = 2.0 * np.tan(np.pi / steps)  # of the Rodrigues vector: exactly `steps` steps a turn
    wx, wy, wz = half * axis
    for _ in range(1000 * steps):
        update_deviator(stress, back, 0.0, np.zeros(6), wx, wy, wz, 1.0, strength)
    assert stress == pytest.approx(start, abs=1e-9)
    assert back == pytest.approx(0.5 * start, abs=1e-9)
    assert contraction(stress, stress) == pytest.approx(contraction(start, start), rel=1e-10)


def test_rotation_is_that_of_the_matrix():
    tensor = np.array([3.0, -1.0, -2.0, 0.5, -0.7, 0.9])
    w, dt = np.array([0.3, -0.4, 0.2]), 0.5
    spin = np.array([[0.0, -w[2], w[1]], [w[2], 0.0, -w[0]], [-w[1], w[0], 0.0]])
    q = np.linalg.solve(np.eye(3) - 0.5 * dt * spin, np.eye(3) + 0.5 * dt * spin)
    full = np.array([[3.0, 0.5, 0.9], [0.5, -1.0, -0.7], [0.9, -0.7, -2.0]])
    turned = q @ full @ q.T
    rotate(tensor, w[0], w[1], w[2], dt)
    assert tensor == pytest.approx(turned[[0, 1, 2, 0, 1, 2], [0, 1, 2, 1, 2, 0]], rel=1e-13)


@pytest.mark.parametrize("steps", [200, 400])
def test_large_simple_shear_has_the_jaumann_sinusoid(steps):
    """tau = G sin(gamma), sigma_xx = G (1 - cos(gamma)): the known answer of the rate, at second order."""
    gamma = 3.0
    rate, w = np.array([0.0, 0.0, 0.0, 0.5 * gamma, 0.0, 0.0]), -0.5 * gamma
    stress, back = np.zeros(6), np.zeros(6)
    for _ in range(steps):
        update_deviator(stress, back, 0.0, rate, 0.0, 0.0, w, 1.0 / steps, constants(1.0, sigma_y=np.inf))
    ceiling = 0.5 * gamma * (gamma / steps) ** 2 * G
    assert stress[3] == pytest.approx(G * np.sin(gamma), abs=ceiling)
    assert stress[0] == pytest.approx(G * (1.0 - np.cos(gamma)), abs=ceiling)


def test_cowper_symonds_scales_the_yield_stress():
    """1 + (rate/C)^(1/P): at rate = C the yield stress doubles, at 32 C with P = 5 it trebles, C = 0 is off."""
    assert rate_factor(40.0, 0.0, 5.0) == 1.0
    assert rate_factor(40.0, 40.0, 5.0) == 2.0
    assert rate_factor(1280.0, 40.0, 5.0) == pytest.approx(3.0, rel=1e-12)
    stress, back, eps_p = np.zeros(6), np.zeros(6), 0.0
    rate, dt = np.array([40.0, -20.0, -20.0, 0.0, 0.0, 0.0]), 1e-5
    for _ in range(100):
        eps_p = update_deviator(stress, back, eps_p, rate, 0, 0, 0, dt, constants(1.0, 40.0, 5.0))
    assert np.sqrt(1.5 * contraction(stress, stress)) == pytest.approx(2.0 * (SIGMA_Y + EP * eps_p), rel=1e-10)
