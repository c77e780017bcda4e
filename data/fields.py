"""Snapshots as VTU files for ParaView: the bird's particles or hexahedra and the plate's quadrilaterals."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from data.histories import Snapshot


def write_fields(folder: Path, snapshots: Sequence[Snapshot]) -> list[Path]:
    """`bird_0000.vtu` and `plate_0000.vtu` per snapshot, SI, its time [s] among the point data; the files written."""
    folder.mkdir(parents=True, exist_ok=True)
    written: list[Path] = []
    for i, snapshot in enumerate(snapshots):
        written.append(_write_bird(folder / f"bird_{i:04d}.vtu", snapshot))
        written.append(_write_plate(folder / f"plate_{i:04d}.vtu", snapshot))
    return written


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


def _write_plate(path: Path, snapshot: Snapshot) -> Path:
    import meshio

    cells: dict[str, list[ArrayLike]] = {"von_mises_Pa": [snapshot.plate_stress]}
    points: dict[str, ArrayLike] = {"time_s": np.full(len(snapshot.nodes), snapshot.time)}
    meshio.Mesh(snapshot.nodes, [("quad", snapshot.quads)], point_data=points, cell_data=cells).write(path)
    return path
