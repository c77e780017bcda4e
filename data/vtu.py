"""Snapshots as VTU series for ParaView: the bird's particles or hexahedra and the plate's quadrilaterals."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from birdstrike.data.histories import Array, Snapshot
from birdstrike.data.storage.files import write_atomically


def write_fields(folder: Path, snapshots: Sequence[Snapshot], resting: Array | None = None) -> list[Path]:
    """`bird_0000.vtu` and `plate_0000.vtu` per snapshot, SI, and the series `bird.pvd`, `plate.pvd`; the files written.

    The time [s] stands among the point data and in the series, which ParaView opens with its clock. resting: (m, 3)
    [m], the plate's nodes before the impact; with them its points carry their displacement.
    """
    folder.mkdir(parents=True, exist_ok=True)
    birds = [_write_bird(folder / f"bird_{i:04d}.vtu", snapshot) for i, snapshot in enumerate(snapshots)]
    plates = [_write_plate(folder / f"plate_{i:04d}.vtu", snapshot, resting) for i, snapshot in enumerate(snapshots)]
    times = [snapshot.time for snapshot in snapshots]
    series = [
        _write_series(folder / f"{name}.pvd", files, times) for name, files in (("bird", birds), ("plate", plates))
    ]
    return [*birds, *plates, *series]


def _write_series(path: Path, files: Sequence[Path], times: Sequence[float]) -> Path:
    """A ParaView collection: which file stands for which time [s]."""
    sets = [
        f'    <DataSet timestep="{time!r}" part="0" file="{file.name}"/>'
        for file, time in zip(files, map(float, times), strict=True)
    ]
    lines = ['<?xml version="1.0"?>', '<VTKFile type="Collection" version="0.1">', "  <Collection>", *sets]
    write_atomically(path, "\n".join([*lines, "  </Collection>", "</VTKFile>"]) + "\n")
    return path


def _write_bird(path: Path, snapshot: Snapshot) -> Path:
    import meshio

    count = len(snapshot.particles)
    data: dict[str, ArrayLike] = {
        "pressure_Pa": snapshot.pressure,
        "velocity_m_s": snapshot.velocity,
        "von_mises_Pa": snapshot.bird_stress,
        "eroded": snapshot.eroded.astype(np.int8),
        "time_s": np.full(count, snapshot.time),
    }
    loose = np.flatnonzero(snapshot.eroded) if len(snapshot.cells) else np.arange(count)
    blocks = [("hexahedron", snapshot.cells), ("vertex", loose.reshape(-1, 1))]
    meshio.Mesh(snapshot.particles, [block for block in blocks if len(block[1])], point_data=data).write(path)
    return path


def _write_plate(path: Path, snapshot: Snapshot, resting: Array | None) -> Path:
    import meshio

    cells: dict[str, list[ArrayLike]] = {"von_mises_Pa": [snapshot.plate_stress]}
    points: dict[str, ArrayLike] = {"time_s": np.full(len(snapshot.nodes), snapshot.time)}
    if resting is not None:
        points["displacement_m"] = snapshot.nodes - resting
    meshio.Mesh(snapshot.nodes, [("quad", snapshot.quads)], point_data=points, cell_data=cells).write(path)
    return path
