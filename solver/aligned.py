"""Arrays that start on a cache line: a packed row then lies in whole lines, and a vector crosses none."""

from __future__ import annotations

import math

import numpy as np

from data.histories import Array

LINE = 8  # doubles in a cache line


def aligned_zeros(*shape: int) -> Array:
    """Zeros of this shape, the first on a cache line."""
    size = math.prod(shape)
    memory = np.zeros(size + LINE)
    skip = -(memory.ctypes.data // memory.itemsize) % LINE
    return memory[skip : skip + size].reshape(shape)
