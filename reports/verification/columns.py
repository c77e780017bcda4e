"""Blocks of bird without edges: lattices that repeat by images, for planar impacts and decaying waves."""

from __future__ import annotations

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.solver.bird.eos.grueneisen import grueneisen
from birdstrike.solver.bird.materials.fluid import Fluid
from birdstrike.solver.bird.shape import LATTICES, slope_gain
from birdstrike.solver.bird.sph import Bird, Images

SEED = Fluid(grueneisen(938.0, 1670.0, 2.48), pressure_cutoff=-1e5)
SMOOTHING = 1.2


def block(cells: tuple[int, int, int], spacing: float, kind: str = "fcc") -> tuple[Array, Array]:
    """Particles (n, 3) [m] of a box of lattice cells from the origin, and the box's edges (3,) [m]."""
    cell, ratio = LATTICES[kind]
    corners = np.stack(np.meshgrid(*map(np.arange, cells), indexing="ij"), axis=-1).reshape(-1, 1, 3)
    edge = ratio * spacing
    return ((corners + cell + 0.25) * edge).reshape(-1, 3), edge * np.array(cells)


def images_of(x: Array, box: Array, axes: tuple[int, ...], reach: float) -> Images:
    """Periodic images within `reach` [m] of the box, along the given axes."""
    shifts = np.array(np.meshgrid(*[(-1, 0, 1) if axis in axes else (0,) for axis in range(3)])).reshape(3, -1).T * box
    parents, moves = [], []
    for shift in shifts[np.any(shifts != 0.0, axis=1)]:
        moved = x + shift
        near = np.all((moved > -reach) & (moved < box + reach) | (shift == 0.0), axis=1)
        parents.append(np.flatnonzero(near))
        moves.append(np.tile(shift, (int(near.sum()), 1)))
    return Images(np.concatenate(parents), np.concatenate(moves))


def periodic_bird(
    cells: tuple[int, int, int],
    spacing: float,
    axes: tuple[int, ...],
    material: Fluid = SEED,
    shock: tuple[float, float] = (1.0, 2.0),
    kind: str = "fcc",
) -> tuple[Bird, Array]:
    """A resting block that repeats along `axes`, and its box [m]."""
    x, box = block(cells, spacing, kind)
    h = SMOOTHING * spacing
    images = images_of(x, box, axes, 2.6 * h)
    bird = Bird(
        x, np.zeros_like(x), material.rho0 * spacing**3, h, material, shock, images, slope_gain(kind, SMOOTHING)
    )
    return bird, box


def advance(bird: Bird, dt: float, first: bool = False) -> None:
    """One step of a bird alone."""
    since = 0.0 if first else dt
    bird.update_density(since)
    bird.update_forces(since)
    bird.kick_and_drift(0.5 * dt if first else dt, dt)
