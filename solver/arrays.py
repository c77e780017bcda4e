"""Layout of arrays that kernels run over: memory on cache lines, and the elements that meet at a node."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.histories import Array

LINE = 8  # doubles in a cache line


def aligned_zeros(*shape: int) -> Array:
    """Zeros of this shape, the first on a cache line."""
    size = math.prod(shape)
    memory = np.zeros(size + LINE)
    skip = -(memory.ctypes.data // memory.itemsize) % LINE
    return memory[skip : skip + size].reshape(shape)


def node_rows(elements: NDArray[np.int64], nodes: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """For every node the places of its elements' corners in the raveled (e, corners) table, in compressed rows.

    Of node p: `member[start[p]:start[p + 1]]`, in order; place = corners * element + corner.
    """
    flat = elements.ravel()
    start = np.concatenate([[0], np.cumsum(np.bincount(flat, minlength=nodes))])
    return start.astype(np.int64), np.argsort(flat, kind="stable").astype(np.int64)
