"""Neighbour lists: cells of one cut-off length, then a list per particle in rows of whole vectors."""

from __future__ import annotations

import numpy as np
from numba import njit, prange
from numba.np.ufunc import get_thread_id

from birdstrike.solver.kernels.bird.columns import WIDTH

REACH = 1  # cells to either side that the cut-off may touch; 2 was tried and is no faster
COLUMNS = (2 * REACH + 1) ** 2


@njit(cache=True, inline="always")
def cell_index(coordinate, lower, edge, cells):
    """Cell of a coordinate along one axis, within the grid whatever the rounding."""
    return max(min(int((coordinate - lower) / edge), cells - 1), 0)


@njit(cache=True)
def sort_into_cells(x, active, edge, lower, shape, cell_start, members, sorted_x):
    """Counting sort of the active particles into cells; within a cell the particle order is kept.

    x: (N, 3) positions [m]; edge: of a cell, at least the cut-off / REACH [m]; lower: (3,) corner of the grid [m];
    shape: (3,) cells; out: cell_start (cells + 1,), members (N,) particle numbers and sorted_x (3, N) positions in
    cell order.
    """
    cell = np.empty(x.shape[0], np.uint32)
    cell_start[:] = 0
    for a in range(x.shape[0]):
        if active[a]:
            i = cell_index(x[a, 0], lower[0], edge, shape[0])
            j = cell_index(x[a, 1], lower[1], edge, shape[1])
            k = cell_index(x[a, 2], lower[2], edge, shape[2])
            cell[a] = (i * shape[1] + j) * shape[2] + k
            cell_start[cell[a] + 1] += 1
    for c in range(cell_start.shape[0] - 1):
        cell_start[c + 1] += cell_start[c]
    filled = cell_start[:-1].copy()
    for a in range(x.shape[0]):
        if active[a]:
            place = filled[cell[a]]
            filled[cell[a]] += 1
            members[place] = a
            for c in range(3):
                sorted_x[c, place] = x[a, c]


@njit(cache=True, inline="always")
def column_of_cells(a, x, edge, lower, shape, cell_start, side):
    """First and last place in cell order of the cells along z in column `side` (< COLUMNS) about particle a."""
    i = cell_index(x[a, 0], lower[0], edge, shape[0]) + side // (2 * REACH + 1) - REACH
    j = cell_index(x[a, 1], lower[1], edge, shape[1]) + side % (2 * REACH + 1) - REACH
    if i < 0 or j < 0 or i >= shape[0] or j >= shape[1]:
        return 0, 0
    k = cell_index(x[a, 2], lower[2], edge, shape[2])
    row = (i * shape[1] + j) * shape[2]
    return cell_start[row + max(k - REACH, 0)], cell_start[row + min(k + REACH + 1, shape[2])]


@njit(cache=True, parallel=True)
def count_neighbours(n, x, active, cutoff, edge, lower, shape, cell_start, sorted_x, start):
    """start[a + 1] = length of the row of particle a < n, a multiple of WIDTH; 0 for the inactive.

    There is room for the active particles within the cut-off [m] and for at least one more.
    """
    start[0] = 0
    for a in prange(n):
        found = 0
        if active[a]:
            xa, ya, za = x[a, 0], x[a, 1], x[a, 2]
            for side in range(COLUMNS):
                first, last = column_of_cells(a, x, edge, lower, shape, cell_start, side)
                for m in range(np.uint64(first), np.uint64(last)):
                    dx, dy, dz = xa - sorted_x[0, m], ya - sorted_x[1, m], za - sorted_x[2, m]
                    found += 1 if dx * dx + dy * dy + dz * dz < cutoff * cutoff else 0
        start[a + 1] = (found + WIDTH - 1) // WIDTH * WIDTH  # found counts a itself, the one more


@njit(cache=True, parallel=True)
def list_neighbours(n, x, active, cutoff, edge, lower, shape, cell_start, sorted_x, members, start, near, neighbour):
    """Fill the rows that `start` leaves: neighbours in order of cell, then of number, on any number of threads.

    Rows are filled up with their own particle: its pair with itself has no distance and exerts nothing, and the pair
    loops run in whole vectors. Distances go first, in vectors, into near (threads, longest column of
    cells), bytes; then every candidate is written, then kept or written over: no branch has to be guessed. Unsigned
    indices spare the test for negative ones, which costs as much as the rest.
    """
    for a in prange(n):
        if not active[a]:
            continue
        close = near[get_thread_id()]
        place = np.uint64(start[a])
        xa, ya, za = x[a, 0], x[a, 1], x[a, 2]
        for side in range(COLUMNS):
            first, last = column_of_cells(a, x, edge, lower, shape, cell_start, side)
            for m in range(np.uint64(first), np.uint64(last)):
                dx, dy, dz = xa - sorted_x[0, m], ya - sorted_x[1, m], za - sorted_x[2, m]
                close[m - np.uint64(first)] = dx * dx + dy * dy + dz * dz < cutoff * cutoff
            for m in range(np.uint64(first), np.uint64(last)):
                b = members[m]
                neighbour[place] = b
                place += np.uint64(close[m - np.uint64(first)]) & np.uint64(b != a)
        for rest in range(np.int64(place), start[a + 1]):
            neighbour[rest] = a


@njit(cache=True, parallel=True)
def bring_near_forward(n, x, limit, start, neighbour, far, stop):
    """Neighbours within `limit` [m] to the front of their row, the others behind, both in the order they had.

    stop[a]: end of the near ones, to a whole vector; what fills it up are others of the row. far: (threads, length)
    scratch for one row. Nothing is lost, so that the rows can be sorted again as the particles move.
    """
    for a in prange(n):
        behind = far[get_thread_id()]
        xa, ya, za = x[a, 0], x[a, 1], x[a, 2]
        place, left = np.uint64(start[a]), np.uint64(0)
        for m in range(np.uint64(start[a]), np.uint64(start[a + 1])):
            b = neighbour[m]
            dx, dy, dz = xa - x[b, 0], ya - x[b, 1], za - x[b, 2]
            near = np.uint64(dx * dx + dy * dy + dz * dz < limit * limit) & np.uint64(b != a)
            neighbour[place] = b
            behind[left] = b
            place += near
            left += np.uint64(1) - near
        for m in range(left):
            neighbour[place + m] = behind[m]
        found = np.int64(place) - start[a]
        stop[a] = start[a] + (found + WIDTH - 1) // WIDTH * WIDTH


@njit(cache=True)
def mean_displacement(x, x_then, drift):
    """Mean of x - x_then over the particles (n, 3) into drift (3,) [m], summed in order."""
    dx = dy = dz = 0.0
    for a in range(x.shape[0]):
        dx += x[a, 0] - x_then[a, 0]
        dy += x[a, 1] - x_then[a, 1]
        dz += x[a, 2] - x_then[a, 2]
    drift[0], drift[1], drift[2] = dx / x.shape[0], dy / x.shape[0], dz / x.shape[0]


@njit(cache=True)
def largest_displacement_squared(x, x_then, drift):
    """Largest |x - x_then - drift|^2 [m^2] over the particles; drift: (3,) [m], common to all and so harmless.

    Infinite when any of them is not finite.
    """
    largest = 0.0
    for a in range(x.shape[0]):
        dx = x[a, 0] - x_then[a, 0] - drift[0]
        dy = x[a, 1] - x_then[a, 1] - drift[1]
        dz = x[a, 2] - x_then[a, 2] - drift[2]
        squared = dx * dx + dy * dy + dz * dz
        if not squared < np.inf:
            return np.inf
        largest = max(largest, squared)
    return largest
