"""Bars and balls of bird with strength, free in space, stepped alone; their energies as the bodies integrate them."""

from __future__ import annotations

from typing import TypeVar

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.reports.verification.columns import SMOOTHING
from birdstrike.solver.bird.materials.solid import Solid
from birdstrike.solver.bird.shape import slope_gain
from birdstrike.solver.bird.sph import Bird

SPACING = 5e-3
Body = TypeVar("Body", bound=Bird)


def cuboid(shape: tuple[int, int, int]) -> Array:
    """Particles (n, 3) [m] of a cubic lattice about the origin."""
    points = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1).reshape(-1, 3)
    return SPACING * (points - points.mean(axis=0))


def free_body(kind: type[Body], material: Solid, x: Array, v: Array, shock: float = 0.0) -> Body:
    """A body of the lattice x with velocities v; shock: factor on the usual coefficients."""
    mass, gain = material.rho0 * SPACING**3, slope_gain("cubic", SMOOTHING)
    return kind(x, v, mass, SMOOTHING * SPACING, material, (shock, 2.0 * shock), gain=gain)


def steps(bird: Bird, dt: float, count: int):
    """Advance and yield the energy [J] of each whole step, kinetic and booked."""
    for step in range(count):
        since = dt if step else 0.0
        bird.update_density(since)
        bird.update_forces(since)
        bird.update_energies(since)
        before = bird.kinetic_energy()
        bird.kick_and_drift(dt if step else 0.5 * dt, dt)
        kinetic = 0.5 * (before + bird.kinetic_energy()) if step else before
        yield kinetic + sum(bird.energies.values())


def angular_momentum(bird: Bird) -> Array:
    """(3,) [N m s], of half-step velocities."""
    return bird.mass * np.cross(bird.x[: bird.n], bird.v[: bird.n]).sum(axis=0)
