"""A planar impact in a laterally periodic column: two halves meet head on, and two shocks run apart."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from data.histories import Array
from reports.verification.columns import SEED, advance, periodic_bird
from solver.bird import NullMaterial


@dataclass(frozen=True)
class Impact:
    """At the end: distance (n,) [m] of the particles from the plane of impact, their pressures [Pa], their least and
    largest speeds; front: where theory puts the shock [m]; shock: its speed through the bird [m/s]; pressure, ripple:
    mean and standard deviation over the plateau [Pa]; astray: energy lost or made, of the initial.
    """

    distance: Array
    pressures: Array
    front: float
    shock: float
    pressure: float
    ripple: float
    astray: float


PLATEAU = (0.2, 0.8)  # of the way to the front: past the wall heating at the plane, short of the front's own width


def planar_impact(
    u: float,
    shock: float,
    material: NullMaterial = SEED,
    kind: str = "fcc",
    length: int = 120,
    side: int = 3,
    spacing: float = 5e-3,
) -> Impact:
    """Halves at +-u [m/s] in a column of `length` lattice cells; shock: the expected speed through the bird [m/s].

    The measured speed is the rate at which half the plateau's pressure passes from one lattice plane to the next, in
    the planes' places before the impact: a straight line fitted over the last two thirds of the time.
    """
    bird, box = periodic_bird((length, side, side), spacing, (1, 2), material, kind=kind)
    bird.x[:, 0] -= 0.5 * box[0]
    bird.v[:, 0] = np.where(bird.x[:, 0] < 0.0, u, -u)
    dt = 0.8 * bird.stable_step(material.fastest_wave(u))
    steps = int(0.65 * 0.5 * box[0] / (shock - u) / dt)
    start, stored = bird.kinetic_energy(), 0.0
    plane, place = planes(np.abs(bird.x[: bird.n, 0]))
    reached = np.zeros(steps)
    for step in range(steps):
        advance(bird, dt, first=step == 0)
        stored += bird.volume * bird.work[: bird.n].sum() + (dt if step else 0.0) * bird.dissipation[: bird.n, 1].sum()
        reached[step] = crossing(place, mean_over(plane, bird.p[: bird.n]), 0.5 * material.rho0 * shock * u)
    front = (shock - u) * steps * dt
    distance, pressures = np.abs(bird.x[: bird.n, 0]), bird.p[: bird.n].copy()
    plateau = pressures[(distance > PLATEAU[0] * front) & (distance < PLATEAU[1] * front)]
    late = np.arange(steps) >= steps // 3
    speed = float(np.polyfit(dt * np.arange(steps)[late], reached[late], 1)[0])
    astray = (bird.kinetic_energy() + stored - start) / start
    return Impact(distance, pressures, front, speed, float(plateau.mean()), float(plateau.std()), astray)


def planes(distance: Array) -> tuple[NDArray[np.int64], Array]:
    """Lattice plane of each particle, counted from the plane of impact, and the planes' distances from it [m]."""
    place, plane = np.unique(np.round(distance, 9), return_inverse=True)
    return plane.ravel(), place


def mean_over(plane: NDArray[np.int64], values: Array) -> Array:
    """Mean of the particles' values in each plane."""
    return np.bincount(plane, values) / np.bincount(plane)


def crossing(place: Array, pressures: Array, level: float) -> float:
    """Outermost place at which the pressure falls through `level`, between planes linearly; 0 before there is one."""
    above = np.flatnonzero(pressures > level)
    if not len(above) or above[-1] == len(place) - 1:
        return 0.0
    i = above[-1]
    share = (pressures[i] - level) / (pressures[i] - pressures[i + 1])
    return float(place[i] + share * (place[i + 1] - place[i]))
