"""Uniform designs U_n: n levels in every column, placed for the least centred L2 discrepancy."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.errors import UserError
from birdstrike.data.histories import Array
from birdstrike.data.progress import Progress, silent
from birdstrike.doe.designs.design import DesignKind
from birdstrike.doe.designs.quality import cd2

Levels = NDArray[np.int64]

LARGEST = 2000
"""Most runs: the exchange keeps an n x n table (32 MB here)."""

HOT, COLD = 25.0, 60.0
"""First and last temperature of an annealing as fractions of a swap's typical effect (chosen by trial on 25 x 4)."""

STARTS = 8
SWAPS = 2_000_000
WORK = 50_000_000
"""Number of annealings; swaps tried in each, and their number times the runs, whichever is reached first.

For 25 runs of 4 parameters 16 million swaps, 2 to 3 s; the bound is in swaps, so that a seed means one design.
"""


def uniform_design(runs: int, columns: int, seed: int, progress: Progress = silent) -> Array:
    """(runs, columns) in 0..1, levels at (2i - 1)/(2 runs), each once in every column.

    The best of `STARTS` annealings by swaps, one from the best good-lattice-point design, the rest from random
    permutations (K.-T. Fang, R. Li, A. Sudjianto, Design and Modeling for Computer Experiments, 2006, ch. 3-4).
    Raises UserError for more than `LARGEST` runs.
    """
    if runs > LARGEST:
        raise UserError(f"--runs = {runs} is outside 2 .. {LARGEST} for a uniform design; use --design sobol")
    if columns == 1 or runs == 2:  # one column has one design, up to the order; two runs have nothing to gain
        return centred(np.tile(np.arange(runs), (columns, 1)).T)
    if (runs, columns, seed) not in _FOUND:
        _FOUND[runs, columns, seed] = _best(runs, columns, seed, progress)
    return centred(_FOUND[runs, columns, seed])


_FOUND: dict[tuple[int, int, int], Levels] = {}
"""Designs made in this process, by runs, columns and seed: an audit asks for the same one with every record."""


def _best(runs: int, columns: int, seed: int, progress: Progress) -> Levels:
    """The best of all annealings, (runs, columns)."""
    rng = np.random.default_rng(seed)
    starts = [_good_lattice(runs, columns)]
    starts += [np.stack([rng.permutation(runs) for _ in range(columns)], axis=1) for _ in range(STARTS - 1)]
    found = []
    for i, start in enumerate(starts):
        progress(i / STARTS)
        found.append(_annealed(start, rng))
    return min(found, key=discrepancy)


def centred(levels: Levels) -> Array:
    """Levels 0..n-1 at the middle of n equal cells."""
    return (2.0 * levels.astype(np.float64) + 1.0) / (2.0 * len(levels))


def discrepancy(levels: Levels) -> float:
    """Squared centred L2 discrepancy of a U-type design."""
    return cd2(centred(levels))


def _annealed(start: Levels, rng: np.random.Generator) -> Levels:
    """The best design of one annealing from `start`.

    Temperatures follow the size of a swap's effect, about 1/n of the discrepancy of a good design; that comes from a
    short cold search, so that the schedule holds for any number of runs and columns.
    """
    from birdstrike.doe.designs.annealing import anneal  # brings in numba: only a uniform design pays for that

    runs, columns = start.shape
    steps, reach = max(min(SWAPS, WORK // runs), 1000), max(1, runs // 8)
    levels, best = np.ascontiguousarray(start.T), np.empty((columns, runs), dtype=np.int64)
    anneal(levels, steps // 20, reach, 1e-12, 1e-15, rng, best)
    scale = discrepancy(best.T) / runs
    anneal(levels, steps, reach, scale / HOT, scale / COLD, rng, best)
    return best.T


def _good_lattice(runs: int, columns: int) -> Levels:
    """The best power-generator lattice: level of run i in column j = i h^j mod n, over (at most 200) h prime to n."""
    i = np.arange(1, runs + 1)
    few = int(np.clip(2e7 / runs**2, 5, 200))  # a start only: not worth more than a second
    lattices = []
    for h in range(1, runs):
        generators = [pow(h, j, runs) for j in range(columns)]
        if math.gcd(h, runs) == 1 and len(set(generators)) == columns:
            lattices.append(np.stack([(i * g) % runs for g in generators], axis=1))
        if len(lattices) == few:
            break
    if not lattices:  # too few units modulo n for that many columns
        return np.tile(np.arange(runs), (columns, 1)).T
    return min(lattices, key=discrepancy)


UNIFORM = DesignKind("uniform", uniform_design)
