"""Verlet lists: neighbours within the support plus a skin, rebuilt when a particle has moved half the skin."""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray

from data.errors import RunFailed
from data.histories import Array
from solver.aligned import aligned_zeros
from solver.kernels.columns import ROW, WIDTH
from solver.kernels.neighbours import (
    REACH,
    count_neighbours,
    largest_displacement_squared,
    list_neighbours,
    mean_displacement,
    sort_into_cells,
)

SKIN = 0.12  # of the support; whole strikes take the same time within 5 % from 0.08 to 0.16


class VerletList:
    """Neighbours of the first n of N particles, in compressed rows: of a, `neighbour[start[a]:start[a + 1]]`."""

    def __init__(self, n: int, support: float) -> None:
        self.n = n
        self.support = support
        self.cutoff = (1.0 + SKIN) * support
        self.start = np.zeros(n + 1, np.int64)
        self.neighbour: NDArray[np.uint32] = np.empty(0, np.uint32)
        self.columns: Array = np.empty((0, ROW, 0))
        self.built_at: Array = np.full((n, 3), np.inf)
        self.drift, self.rebuilds = np.zeros(3), 0

    @property
    def rows(self) -> tuple[NDArray[np.int64], NDArray[np.uint32], Array]:
        """start, neighbour, and the scratch (threads, ROW, length) that holds one row's neighbours, see `turn_rows`."""
        return self.start, self.neighbour, self.columns

    def refresh(self, x: Array, active: NDArray[np.bool_]) -> None:
        """Rebuild if the list may have become incomplete; the bird's mean motion, common to all, does not count."""
        mean_displacement(x[: self.n], self.built_at, self.drift)
        moved = largest_displacement_squared(x[: self.n], self.built_at, self.drift)
        if not moved < (0.5 * SKIN * self.support) ** 2:
            self.build(x, active)

    def build(self, x: Array, active: NDArray[np.bool_]) -> None:
        """List the neighbours of the present positions (N, 3). Raises RunFailed when one is not finite."""
        lower = x.min(axis=0) - 1e-9
        span = x.max(axis=0) - lower
        if not np.isfinite(span).all():
            raise RunFailed("a bird particle's position is no longer finite", "lower solver.courant")
        # a stray eroded particle must not blow up the grid: cells grow instead
        edge = max(self.cutoff / REACH, float(np.max(span)) / 256.0)
        shape = (np.floor(span / edge) + 1).astype(np.int64)
        cell_start = np.zeros(int(np.prod(shape)) + 1, np.int64)
        members, sorted_x = np.empty(len(x), np.uint32), np.empty((3, len(x)))
        sort_into_cells(x, active, edge, lower, shape, cell_start, members, sorted_x)
        cells = (self.n, x, active, self.cutoff, edge, lower, shape, cell_start, sorted_x)
        count_neighbours(*cells, self.start)
        longest = int(self.start.max())
        if longest > self.columns.shape[2]:
            lines = (longest // WIDTH + 2) | 1  # odd, so that the columns lie in different sets of the cache
            self.columns = aligned_zeros(numba.config.NUMBA_NUM_THREADS, ROW, lines * WIDTH)
        np.cumsum(self.start, out=self.start)
        if self.start[-1] > len(self.neighbour):
            self.neighbour = np.empty(int(1.3 * self.start[-1]) + 1, np.uint32)
        list_neighbours(*cells, members, self.start, self.neighbour)
        self.built_at = x[: self.n].copy()
        self.rebuilds += 1
