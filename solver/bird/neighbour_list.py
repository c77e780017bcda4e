"""Verlet lists: neighbours within the support plus a skin, sorted and rebuilt as the particles move."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.errors import RunFailed
from birdstrike.data.histories import Array
from birdstrike.solver.arrays import aligned_zeros
from birdstrike.solver.kernels.bird.columns import ROW, WIDTH
from birdstrike.solver.kernels.bird.neighbours import (
    REACH,
    bring_near_forward,
    count_neighbours,
    largest_displacement_squared,
    list_neighbours,
    mean_displacement,
    sort_into_cells,
)
from birdstrike.solver.threads import MOST_THREADS

SKIN = 0.18  # of the support, of the rows; they are complete until two particles may have closed that much
NEAR = 0.05  # of the support, of their near part, which is sorted out anew the more often


class VerletList:
    """Neighbours of the first n of N particles, in compressed rows: of a, `neighbour[start[a]:start[a + 1]]`.

    Their near part, `neighbour[start[a]:stop[a]]`, holds all within the support and few others. skin: of the support.
    """

    def __init__(self, n: int, support: float, skin: float = SKIN) -> None:
        self.n, self.support, self.skin = n, support, skin
        self.near = min(skin, NEAR)
        self.cutoff = (1.0 + skin) * support
        self.start, self.stop = np.zeros(n + 1, np.int64), np.zeros(n, np.int64)
        self.neighbour: NDArray[np.uint32] = np.empty(0, np.uint32)
        self.columns: Array = np.empty((0, ROW, 0))
        self.far: NDArray[np.uint32] = np.empty((0, 0), np.uint32)
        self.built_at, self.sorted_at = np.full((n, 3), np.inf), np.full((n, 3), np.inf)
        self.drift, self.rebuilds = np.zeros(3), 0

    @property
    def rows(self) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.uint32], Array]:
        """start, stop, neighbour, and scratch (threads, ROW, length) for the neighbours of a row, see `turn_rows`."""
        return self.start, self.stop, self.neighbour, self.columns

    @property
    def mean_length(self) -> float:
        """Of the rows' near part."""
        return float((self.stop - self.start[:-1]).mean())

    def refresh(self, x: Array, active: NDArray[np.bool_]) -> None:
        """Sort the rows, or rebuild them, if their near part may have become incomplete.

        The bird's mean motion, common to all, does not count.
        """
        if self._moved_less(x, self.sorted_at, self.near):
            return
        if self._moved_less(x, self.built_at, self.skin - self.near):
            self.sort(x)
        else:
            self.build(x, active)

    def _moved_less(self, x: Array, since: Array, skin: float) -> bool:
        """Whether no pair may have closed by this share of the support since then."""
        mean_displacement(x[: self.n], since, self.drift)
        moved = largest_displacement_squared(x[: self.n], since, self.drift)
        return bool(moved < (0.5 * skin * self.support) ** 2)

    def sort(self, x: Array) -> None:
        """Near part of every row first."""
        limit = (1.0 + self.near) * self.support
        bring_near_forward(self.n, x, limit, self.start, self.neighbour, self.far, self.stop)
        self.sorted_at[:] = x[: self.n]

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
        members = np.empty(len(x), np.uint32)
        # `sort` fills `sorted_at` anew at the end: until then its memory holds the positions in order of the cells
        sorted_x = self.sorted_at.reshape(3, -1) if len(x) == self.n else np.empty((3, len(x)))
        sort_into_cells(x, active, edge, lower, shape, cell_start, members, sorted_x)
        cells = (self.n, x, active, self.cutoff, edge, lower, shape, cell_start, sorted_x)
        count_neighbours(*cells, self.start)
        longest = int(self.start.max())
        if longest > self.columns.shape[2]:
            lines = (longest // WIDTH + 2) | 1  # odd, so that the columns lie in different sets of the cache
            self.columns = aligned_zeros(MOST_THREADS, ROW, lines * WIDTH)
            self.far = np.zeros((MOST_THREADS, lines * WIDTH), np.uint32)
        np.cumsum(self.start, out=self.start)
        if self.start[-1] > len(self.neighbour):
            self.neighbour = np.empty(int(1.05 * self.start[-1]) + 1, np.uint32)
        near = np.empty((MOST_THREADS, (2 * REACH + 1) * int(np.diff(cell_start).max())), np.uint8)
        list_neighbours(*cells, members, self.start, near, self.neighbour)
        self.built_at[:] = x[: self.n]
        self.rebuilds += 1
        self.sort(x)
