"""Blocks of hexahedra: bars and columns for waves, impacts and patch tests."""

from __future__ import annotations

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.solver.bird.eos.grueneisen import grueneisen
from birdstrike.solver.bird.hex_mesh import CORNERS, HexMesh
from birdstrike.solver.bird.hexahedra import HexBird
from birdstrike.solver.bird.materials.fluid import Fluid

SEED = Fluid(grueneisen(938.0, 1670.0, 2.48), pressure_cutoff=-1e5)


def brick(cells: tuple[int, int, int], edge: float | tuple[float, float, float]) -> HexMesh:
    """A box of cells of the given edges [m] from the origin."""
    counts = np.array(cells)
    grid = np.stack(np.meshgrid(*[np.arange(n + 1) for n in cells], indexing="ij"), axis=-1).reshape(-1, 3)
    low = np.stack(np.meshgrid(*map(np.arange, cells), indexing="ij"), axis=-1).reshape(-1, 1, 3)
    stride = np.array([(counts[1] + 1) * (counts[2] + 1), counts[2] + 1, 1])
    return HexMesh(grid.astype(float) * np.broadcast_to(edge, 3), ((low + CORNERS) @ stride).astype(np.int64))


def skewed(mesh: HexMesh, by: float, seed: int = 0) -> HexMesh:
    """The same mesh with every node moved at random by up to `by` [m] in each direction."""
    moves = np.random.default_rng(seed).uniform(-by, by, mesh.nodes.shape)
    return HexMesh(mesh.nodes + moves, mesh.cells)


def advance(bird: HexBird, dt: float, first: bool = False, held: Array | None = None) -> float:
    """One step of a bird alone with its energies; their sum with the kinetic one at the whole step that was left [J].

    held: (n, 3) True where a freedom keeps its velocity.
    """
    since = 0.0 if first else dt
    bird.update_density(since)
    bird.update_forces(since)
    bird.update_energies(since)
    if held is not None:
        bird.acceleration[held.astype(bool)] = 0.0
    before = bird.kinetic_energy()
    bird.kick(0.5 * dt if first else dt)
    bird.drift(dt)
    return 0.5 * (before + bird.kinetic_energy()) + sum(bird.energies.values())


def stable_step(bird: HexBird) -> float:
    """Shortest of the elements' stable steps at rest [s]."""
    bird.find_steps()
    return float(bird.step.min())
