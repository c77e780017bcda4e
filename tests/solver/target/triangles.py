"""Meshes of triangles for tests: quadrilaterals cut in two, and the Abaqus file of a mesh of both."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.histories import Array

Numbers = NDArray[np.int64]


def cut(quads: Numbers, crossed: bool = False) -> Numbers:
    """Every quadrilateral (e, 4) cut along a diagonal, every other one along the other where crossed; (2 e, 4)."""
    one = np.stack([quads[:, [0, 1, 2, 2]], quads[:, [0, 2, 3, 3]]], axis=1)
    two = np.stack([quads[:, [0, 1, 3, 3]], quads[:, [1, 2, 3, 3]]], axis=1)
    other = crossed & (np.arange(len(quads)) % 2 == 1)
    return np.where(other[:, None, None], two, one).reshape(-1, 4)


def mixed(quads: Numbers, cut_ones: NDArray[np.bool_]) -> Numbers:
    """Some of the quadrilaterals cut; triangles last."""
    return np.concatenate([quads[~cut_ones], cut(quads[cut_ones])])


def abaqus_file(
    path: Path, nodes: Array, blocks: Sequence[tuple[str, str, int, Numbers]], sets: Mapping[str, Numbers]
) -> Path:
    """As a pre-processor writes it. blocks: kind of element, its set, first number, corners."""
    lines = ["*HEADING", "*NODE"]
    lines += [f"{i + 1}, {x:.17g}, {y:.17g}, {z:.17g}" for i, (x, y, z) in enumerate(nodes)]
    for kind, name, first, corners in blocks:
        lines.append(f"*ELEMENT, TYPE={kind}, ELSET={name}")
        lines += [", ".join(str(n) for n in (first + i, *(row + 1))) for i, row in enumerate(corners)]
    for name, given in sets.items():
        lines.append(f"*NSET, NSET={name}")
        lines += [", ".join(str(n + 1) for n in given[k : k + 12]) for k in range(0, len(given), 12)]
    path.write_text("\n".join(lines) + "\n")
    return path
