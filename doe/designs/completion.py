"""The design that a campaign's folder asks for: the one it holds, that one completed to more runs, or a fresh one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.errors import UserError
from birdstrike.data.histories import Array
from birdstrike.doe.campaign.folder import CampaignFolder, design_rows, rows_digest, space_json
from birdstrike.doe.designs.registry import KINDS, Design, make_design
from birdstrike.doe.designs.space import ParameterSpace
from birdstrike.doe.designs.uniform import LARGEST, cd2

STARTS, SWEEPS, CANDIDATES = 30, 20, 200
WORK = 1e9
"""Searches from random starts, passes over all coordinates in each, levels tried for a coordinate; and a bound on
their product with the runs squared, whichever is reached first (15 runs added to 25 of 4 parameters: about 1 s)."""


def completed(held: Array, runs: int, seed: int, progress: Callable[[float], None] = lambda _: None) -> Array:
    """`runs` points (runs, k) in 0..1, the first of them `held` (n, k), of a low centred L2 discrepancy.

    The added points' coordinates stand at the middles of `runs` equal cells; each in turn is put where the discrepancy
    of the whole is least, until none moves (coordinate exchange: R. K. Meyer, C. J. Nachtsheim, Technometrics 37 (1995)
    60). The best of several random starts; the same for the same seed. Held points outside 0..1 count at the border.
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


def planned_design(
    kind: str | Path,
    space: ParameterSpace,
    runs: int,
    seed: int,
    out: str | Path,
    progress: Callable[[float], None] = lambda _: None,
) -> Design:
    """`make_design`, but of a campaign in `out` of the same kind, seed and ranges its runs stay, bit for bit.

    More runs than it holds are added where they fill the box best; a Sobol sequence goes on instead. Raises UserError.
    """
    held = _held(str(kind), space, seed, CampaignFolder(Path(out)))
    if held is None or runs < len(held[0]) or (kind == "sobol" and runs > len(held[0])):
        return make_design(kind, space, runs, seed, progress)
    numbers, values = held
    design = Design(str(kind), seed, space, numbers, values, space.to_unit(values))
    return design if runs == len(numbers) else _extended(design, runs, progress)


def _extended(design: Design, runs: int, progress: Callable[[float], None]) -> Design:
    n, space, seed = len(design.numbers), design.space, design.seed or 0
    unit = completed(design.unit, runs, seed, progress)
    said = f"the {n} runs of the {design.kind} design stay; {runs - n} are added where they fill the box best"
    if design.kind == "orthogonal":
        said += f": together they are no orthogonal array, the first {n} are"
    numbers = np.concatenate([design.numbers, design.numbers.max() + np.arange(1, runs - n + 1)])
    values = np.vstack([design.values, space.to_physical(unit[n:])])
    return replace(design, numbers=numbers, values=values, unit=unit, warnings=(said,))


def _held(
    kind: str, space: ParameterSpace, seed: int, folder: CampaignFolder
) -> tuple[NDArray[np.int64], Array] | None:
    """Run numbers and values of the folder's design where its summary vouches for kind, seed, ranges and every row."""
    summary = folder.read_summary()
    design = summary.get("design", {})
    same = (design.get("kind"), design.get("seed"), summary.get("space")) == (kind, seed, space_json(space))
    if kind not in KINDS or not same or not folder.design.exists():
        return None
    rows = folder.design.read_text(encoding="utf-8").splitlines()[: design["runs"] + 1]
    if rows_digest(rows) != design.get("digest"):
        return None
    return design_rows(rows)
