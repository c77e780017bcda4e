"""Planar impact: pressure and speed of the shock against the Rankine-Hugoniot relations; and its energy balance."""

from __future__ import annotations

import numpy as np
import pytest

from birdstrike.reports.verification.columns import SEED, periodic_bird


@pytest.mark.parametrize("kind", ["fcc", "cubic"])
@pytest.mark.parametrize("u", [45.55, 200.0])
def test_hugoniot_pressure_of_planar_impact(u, kind):
    """Two halves meet at +-u in a laterally periodic column: behind the shocks p = rho0 (C + S1 u) u within 3 %.

    The shock runs through the bird at C + S1 u within 3 %, told from the kinetic energy that it consumes between two
    instants; energy closes within 1 %.
    """
    bird, box = periodic_bird((90, 3, 3), 5e-3, (1, 2), kind=kind)
    bird.x[:, 0] -= 0.5 * box[0]
    bird.v[:, 0] = np.where(bird.x[:, 0] < 0.0, u, -u)
    _, shock, _ = SEED.eos.hugoniot(u)
    dt = 0.8 * bird.stable_step(SEED.eos.shocked_sound_speed(u))
    steps = int(0.65 * 0.5 * box[0] / (shock - u) / dt)
    start = bird.kinetic_energy()
    stored, consumed = 0.0, []
    for step in range(steps):
        bird.update_density(dt if step else 0.0)
        bird.update_forces(dt if step else 0.0)
        stored += bird.volume * bird.work[: bird.n].sum() + dt * bird.dissipation[: bird.n, 1].sum()
        bird.kick_and_drift(dt if step else 0.5 * dt, dt)
        consumed.append(start - bird.kinetic_energy())
    front = (shock - u) * steps * dt
    distance, pressure = np.abs(bird.x[: bird.n, 0]), bird.p[: bird.n] / (SEED.rho0 * shock * u)
    plateau = (distance > 0.2 * front) & (distance < 0.8 * front)
    assert pressure[plateau].mean() == pytest.approx(1.0, abs=0.03)
    early = steps // 3
    mass_flow = (consumed[-1] - consumed[early]) / (0.5 * u**2) / ((steps - 1 - early) * dt)
    assert mass_flow / (2.0 * box[1] * box[2] * SEED.rho0) == pytest.approx(shock, rel=0.03)
    assert bird.kinetic_energy() + stored == pytest.approx(start, rel=0.01)
