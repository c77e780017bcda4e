"""The clamped aluminium plate 525 x 430 x 10 mm: its step response, and its frequencies from the assembled operator."""

from __future__ import annotations

import numpy as np
import pandas as pd
from scipy.sparse import csc_matrix, diags
from scipy.sparse.linalg import eigsh

from data.histories import Array
from data.paths import REFERENCE
from solver.plate import Plate, ShellMaterial
from solver.shell_mesh import plate_mesh

ALUMINIUM = ShellMaterial(71e9, 0.3, 2780.0)
LENGTH, WIDTH, THICKNESS = 0.525, 0.430, 0.010


def clamped(elements: tuple[int, int]) -> Plate:
    """The plate on `elements` shells along length and width."""
    return Plate(plate_mesh(LENGTH, WIDTH, elements), THICKNESS, ALUMINIUM, "clamped")


def step_load(plate: Plate, force: float) -> Array:
    """`force` [N] in -z spread uniformly over the central 100 x 100 mm, as nodal forces (m, 3)."""
    corners = plate.mesh.nodes[plate.quads][:, :, :2]
    overlap = np.minimum(corners.max(axis=1), 0.05) - np.maximum(corners.min(axis=1), -0.05)
    share = force * np.clip(overlap, 0.0, None).prod(axis=1) / 0.01 / 4.0
    load = np.zeros_like(plate.x)
    np.add.at(load[:, 2], plate.quads.ravel(), -np.repeat(share, 4))
    return load


def respond(plate: Plate, load: Array, end: float) -> tuple[Array, Array]:
    """Time [s] and centre displacement [m] under a load held from t = 0."""
    dt = 0.9 * plate.stable_step()
    centre = int(np.argmin(np.hypot(plate.x[:, 0], plate.x[:, 1])))
    steps = int(end / dt)
    w = np.zeros(steps)
    for step in range(steps):
        plate.update_forces(dt if step else 0.0)
        w[step] = -plate.x[centre, 2]
        plate.kick_and_drift(dt if step else 0.5 * dt, dt, load)
    return dt * np.arange(steps), w


def reference(column: str) -> tuple[Array, Array]:
    """Time [s] and displacement [m] of one independent solution."""
    table = pd.read_csv(REFERENCE / "plate_step_response.csv", comment="#")
    return table["t_ms"].to_numpy() * 1e-3, table[column].to_numpy() * 1e-3


def rms_of_peak(time: Array, w: Array, column: str) -> float:
    """RMS difference from an independent solution, in % of its peak."""
    t, expected = reference(column)
    return 100.0 * float(np.sqrt(np.mean((np.interp(t, time, w) - expected) ** 2)) / expected.max())


BENDING = ((0, 2), (1, 3), (1, 4))
"""Freedoms of a flat plate's bending: deflection and two turns, as (velocity or spin, column of the nodal forces)."""


def frequencies(plate: Plate, count: int = 3) -> Array:
    """Lowest natural frequencies [Hz] of the plate as it lies, by Lanczos on the assembled bending operator.

    The operator is read off the nodal forces of small unit motions: nodes three apart in both directions share no
    element, so nine sets of nodes times three freedoms give every column.
    """
    nodes = len(plate.x)
    across = len(np.unique(np.round(plate.mesh.nodes[:, 1], 9)))
    i, j = np.divmod(np.arange(nodes), across)
    rows, columns, entries = [], [], []
    for colour in range(9):
        mine = np.flatnonzero(3 * (i % 3) + j % 3 == colour)
        owner = np.full(nodes, -1)
        for di in (-1, 0, 1):
            for dj in (-1, 0, 1):
                inside = (i[mine] + di >= 0) & (i[mine] + di < nodes // across) & (j[mine] + dj >= 0)
                inside &= j[mine] + dj < across
                owner[(mine + di * across + dj)[inside]] = mine[inside]
        touched = np.flatnonzero(owner >= 0)
        for freedom in range(3):
            force = _force_of_unit_motion(plate, mine, freedom)
            rows.append((3 * touched[:, None] + np.arange(3)).ravel())
            columns.append(np.repeat(3 * owner[touched] + freedom, 3))
            entries.append(-force[touched].ravel())
    stiffness = csc_matrix((np.concatenate(entries), (np.concatenate(rows), np.concatenate(columns))))
    free = np.repeat(~plate.fixed, 3)
    inertia = np.column_stack([plate.mass, plate.inertia, plate.inertia]).ravel()[free]
    k = stiffness[free][:, free]
    squared = eigsh(0.5 * (k + k.T), count, diags(inertia, format="csc"), sigma=0.0, return_eigenvectors=False)
    return np.sqrt(np.sort(squared)) / (2.0 * np.pi)


def _force_of_unit_motion(plate: Plate, nodes: np.ndarray, freedom: int) -> Array:
    """Bending forces (m, 3) of a unit displacement or turn of `nodes`, from a motion small enough to be linear."""
    small = 1e-9
    plate.clear_stress()
    plate.v[:], plate.omega[:] = 0.0, 0.0
    kind, column = BENDING[freedom]
    (plate.v, plate.omega)[kind][nodes, 2 if kind == 0 else column - 3] = small
    plate.update_forces(1.0)
    plate.v[:], plate.omega[:] = 0.0, 0.0
    return plate.nodal[:, [2, 3, 4]] / small
