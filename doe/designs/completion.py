"""Runs added to a design where they fill the parameter space best: coordinate exchange on the discrepancy."""

from __future__ import annotations

import numpy as np

from birdstrike.data.errors import UserError
from birdstrike.data.histories import Array
from birdstrike.data.progress import Progress, silent
from birdstrike.doe.designs.quality import cd2
from birdstrike.doe.designs.uniform import LARGEST

STARTS, SWEEPS, CANDIDATES = 30, 20, 200
WORK = 1e9
"""Searches from random starts, passes over all coordinates in each, levels tried for a coordinate; and a bound on
their product with the runs squared, whichever is reached first (15 runs added to 25 of 4 parameters: about 1 s)."""


def completed(held: Array, runs: int, seed: int, progress: Progress = silent) -> Array:
    """`runs` points (runs, k) in 0..1, the first of them `held` (n, k), of a low centred L2 discrepancy.

    The added points' coordinates stand at the middles of `runs` equal cells; each in turn is put where the discrepancy
    of the whole is least, until none moves (coordinate exchange: R. K. Meyer, C. J. Nachtsheim, Technometrics 37 (1995)
    60). The best of several random starts; the same for the same seed. Held points outside 0..1 count at the border.
    Raises UserError for more than `LARGEST` runs.
    """
    if runs > LARGEST:
        raise UserError(f"--runs = {runs} is above {LARGEST}, the most to which a design is completed")
    rng, inside = np.random.default_rng([seed, len(held), runs]), np.clip(held, 0.0, 1.0)
    levels = (2.0 * np.arange(runs) + 1.0) / (2.0 * runs)
    added, k = runs - len(held), held.shape[1]
    sweep = added * k * runs * min(runs, CANDIDATES)
    starts = int(np.clip(WORK / (SWEEPS * sweep), 1, STARTS))
    best, lowest = inside, np.inf
    for start in range(starts):
        progress(start / starts)
        points = np.vstack([inside, rng.choice(levels, (added, k))])
        _exchange(points, len(held), levels, int(np.clip(WORK / sweep, 1, SWEEPS)), rng)
        if (value := cd2(points)) < lowest:
            best, lowest = points, value
    return np.vstack([held, best[len(held) :]])


def _exchange(points: Array, first: int, levels: Array, sweeps: int, rng: np.random.Generator) -> None:
    """Move the points from `first` on, one coordinate at a time, in place, until a sweep moves none."""
    pairs = np.prod([_pair(x, x) for x in points.T], axis=0)
    singles = np.prod(_single(points), axis=1)
    for _ in range(sweeps):
        moved = False
        for row in range(first, len(points)):
            for column in range(points.shape[1]):
                tried = levels if len(levels) <= CANDIDATES else rng.choice(levels, CANDIDATES)
                moved |= _place(points, row, column, tried, pairs, singles)
        if not moved:
            return


def _place(points: Array, row: int, column: int, levels: Array, pairs: Array, singles: Array) -> bool:
    """Put one coordinate at the best of `levels` and bring the products up to date; whether it has moved.

    The terms of the squared discrepancy that hold point r, with Q_rm = prod p and T_r = prod s over its other
    coordinates: (2 sum_(m != r) Q_rm p(y, x_m) + Q_rr p(y, y)) / n^2 - 2 T_r s(y) / n (Hickernell 1998, eq. 5.1c).
    """
    n, x = len(points), points[:, column]
    others = pairs[row] / _pair(x[row : row + 1], x)[0]
    single = singles[row] / _single(x[row])
    tried = np.append(levels, x[row])
    factors = _pair(tried, x)
    factors[:, row] = 0.5 * (1.0 + np.abs(tried - 0.5))
    terms = 2.0 * (factors @ others) / n**2 - 2.0 * single * _single(tried) / n
    found = int(np.argmin(terms))
    if terms[found] >= terms[-1] - 1e-14:
        return False
    x[row] = tried[found]
    pairs[row] = pairs[:, row] = others * _pair(tried[found : found + 1], x)[0]
    singles[row] = single * _single(tried[found])
    return True


def _pair(a: Array, b: Array) -> Array:
    """p(a, b) = 1 + |a - 1/2|/2 + |b - 1/2|/2 - |a - b|/2, (len(a), len(b))."""
    z_a, z_b = np.abs(a - 0.5)[:, None], np.abs(b - 0.5)[None, :]
    return 1.0 + 0.5 * (z_a + z_b - np.abs(a[:, None] - b[None, :]))


def _single(x: Array) -> Array:
    """s(x) = 1 + |x - 1/2|/2 - |x - 1/2|^2/2."""
    z = np.abs(x - 0.5)
    return 1.0 + 0.5 * z * (1.0 - z)
