"""Small vibrations and small static deflections of a plate, from the very forces that the time loop uses.

The stiffness of every element is the derivative of its forces by its freedoms, taken by central differences on a
copy of the plate whose elements share no node; a preload's geometric stiffness comes with it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csc_array, diags_array
from scipy.sparse.linalg import eigsh, spsolve

from birdstrike.data.histories import Array
from birdstrike.solver.target.assembly import Target
from birdstrike.solver.target.mesh import shell_mesh
from birdstrike.solver.target.nodes import Nodes
from birdstrike.solver.target.shell_block import ShellBlock
from birdstrike.solver.target.supports import NAMED, rim_supports

STEP = 1e-7  # of an element's size: rounding and curvature of the forces both far below 1e-6


def element_stiffnesses(plate: Target) -> list[tuple[NDArray[np.int64], Array]]:
    """Of each block the nodes (e, n) and the stiffness (e, 6 n, 6 n) [N/m, N, N m] of its elements as they lie now.

    The freedoms go node by node, x, y, z and rotations.
    """
    return [_stiffnesses_of(plate, block) for block in plate.straining]


def _stiffnesses_of(plate: Target, shells: ShellBlock) -> tuple[NDArray[np.int64], Array]:
    """Of one block."""
    e, n = len(shells.quads), shells.corners
    ends = shells.quads[:, :n]
    numbers = np.minimum(np.arange(4), n - 1) + n * np.arange(e)[:, None]
    apart = shell_mesh(plate.x[ends].reshape(-1, 3), numbers)
    block = type(shells)(apart.nodes, apart.quads, [one.elastic() for one in shells.sections], shells.section)
    trial = Target(apart, Nodes(apart.nodes), [block], rim_supports(apart, NAMED["free"]))
    size = float(np.sqrt(block.shape[:, 4].min()))
    columns = []
    for freedom in range(6 * n):
        node, axis = divmod(freedom, 6)
        columns.append([])
        for sign in (1.0, -1.0):
            trial.clear_stress()
            block.stress[:], block.hourglass[:] = shells.stress, shells.hourglass
            block.resultant[:] = shells.resultant
            trial.x[:], trial.v[:], trial.omega[:] = apart.nodes, 0.0, 0.0
            motion, amount = (trial.v, STEP * size) if axis < 3 else (trial.omega, STEP)
            motion[node::n, axis % 3] = sign * amount
            trial.x[:] += trial.v
            trial.update_forces(1.0)
            columns[-1].append(trial.nodal.reshape(e, 6 * n) / (2.0 * amount))
    return ends, np.stack([minus - plus for plus, minus in columns], axis=2)


def stiffness_and_mass(plate: Target) -> tuple[csc_array, Array]:
    """Symmetric stiffness and diagonal mass of the freedoms that the frame does not hold, in nodal axes.

    Freedom 6 p + i of node p; held ones are in it too, `free_freedoms` holds the others.
    """
    m = len(plate.x)
    stiffness = edge_stiffness(plate)
    for ends, own in element_stiffnesses(plate):
        symmetric, size = 0.5 * (own + own.transpose(0, 2, 1)), own.shape[1]
        freedom = (6 * ends[:, :, None] + np.arange(6)).reshape(-1, size)
        rows, columns = np.repeat(freedom, size, axis=1), np.tile(freedom, (1, size))
        entries = (symmetric.ravel(), (rows.ravel(), columns.ravel()))
        stiffness = csc_array(coo_array(entries, shape=(6 * m, 6 * m))) + stiffness
    if plate.rivets is not None:
        stiffness = stiffness + plate.rivets.stiffness(m)
    if plate.ties is not None:
        moving = plate.ties.matrix(m)
        stiffness = csc_array(moving.T @ stiffness @ moving)
    turn = nodal_axes(plate)
    mass: Array = np.repeat(np.stack([plate.mass, plate.inertia], axis=1), 3, axis=1).ravel().astype(np.float64)
    return csc_array(turn @ stiffness @ turn.T), mass


def edge_stiffness(plate: Target) -> csc_array:
    """The edge springs' own part (6 m, 6 m)."""
    edges, m = plate.supports, len(plate.x)
    across = edges.normal[:, :, None] * edges.normal[:, None, :]
    in_plane, transverse, rotational = (edges.springs[:, i, None, None] for i in range(3))
    block = np.zeros((len(edges.nodes), 6, 6))
    block[:, :3, :3] = transverse * across + in_plane * (np.eye(3) - across)
    block[:, 3:, 3:] = rotational * np.eye(3)
    freedom = 6 * edges.nodes[:, None] + np.arange(6)
    rows, columns = np.repeat(freedom, 6, axis=1), np.tile(freedom, (1, 6))
    return csc_array(coo_array((block.ravel(), (rows.ravel(), columns.ravel())), shape=(6 * m, 6 * m)))


def nodal_axes(plate: Target) -> csc_array:
    """Turns global components into those of each node's own axes, (6 m, 6 m)."""
    m = len(plate.x)
    freedom = np.arange(6 * m).reshape(2 * m, 3)
    rows, columns = np.repeat(freedom, 3, axis=1), np.tile(freedom, (1, 3))
    axes = np.repeat(plate.nodes.axes, 2, axis=0)
    return csc_array(coo_array((axes.ravel(), (rows.ravel(), columns.ravel())), shape=(6 * m, 6 * m)))


def free_freedoms(plate: Target) -> NDArray[np.int64]:
    """Numbers of the freedoms that the frame does not hold, and that follow no others."""
    held = (plate.nodes.held[:, None] >> np.arange(6)) & 1
    return np.flatnonzero((held == 0) & (plate.mass > 0.0)[:, None])


def natural_frequencies(plate: Target, count: int = 3) -> tuple[Array, Array]:
    """Lowest `count` frequencies [Hz] of the plate as it is now, and their shapes (count, m, 6) in nodal axes.

    A plate that the frame leaves free to move as a whole has first up to six of about 0 Hz (below 0.1 % of the others).
    """
    stiffness, mass = stiffness_and_mass(plate)
    free = free_freedoms(plate)
    inner = csc_array(stiffness[free][:, free])
    # The shift keeps a free plate's singular stiffness from being factorised; it lies far below any vibration.
    squared, vectors = eigsh(inner, count, diags_array(mass[free]), sigma=-1.0, v0=np.ones(len(free)))
    order = np.argsort(squared)
    shapes = np.zeros((count, len(mass)))
    shapes[:, free] = vectors.T
    return np.sqrt(np.maximum(squared[order], 0.0)) / (2.0 * np.pi), shapes[order].reshape(count, -1, 6)


def static_deflection(plate: Target, load: Array) -> Array:
    """Small displacements (m, 6) [m, rad] in nodal axes under nodal forces (m, 3) [N]."""
    stiffness, mass = stiffness_and_mass(plate)
    free = free_freedoms(plate)
    force = np.zeros((len(plate.x), 6))
    force[:, :3] = load
    result = np.zeros(len(mass))
    inner = csc_array(stiffness[free][:, free])
    result[free] = np.asarray(spsolve(inner, (nodal_axes(plate) @ force.ravel())[free]))
    return result.reshape(-1, 6)
