"""What of a parameter the solver can feel: activity limits of the erosion strains, and the emulator's inputs.

Tension erosion removes a particle when V/V0 > TEROD, for TEROD > 1 only; compression erosion when V/V0 < CEROD, for
0 < CEROD < 1 only. On the other side of 1 the card is off and the curve is flat. "Off" is the limit of an unreachable
threshold (TEROD towards infinity, CEROD towards 0), not the neighbour of 1, where erosion is at its strongest.

A parameter whose range is logarithmic enters by its logarithm, in which its design spreads the runs: linearly nine of
ten runs over three decades would lie in a tenth of the range, closer than the shortest length of a process.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.histories import Array

LIMIT = 1.0
FEWEST_RUNS = 5


def runs_needed(parameters: int) -> int:
    """Finished, smooth runs that an emulator of so many parameters needs at the least."""
    return max(FEWEST_RUNS, parameters + 1)


def _tension(value: Array) -> Array:
    """1/TEROD while active, 0 (an infinite threshold) while off."""
    return np.where(value > LIMIT, 1.0 / np.maximum(value, LIMIT), 0.0)


def _compression(value: Array) -> Array:
    """CEROD while active, 0 while off."""
    return np.where((value > 0.0) & (value < LIMIT), value, 0.0)


FEATURES = {"tension_erosion": _tension, "compression_erosion": _compression}
"""Last part of a dotted case key -> the emulator's input; any other parameter is its own feature, or its logarithm."""


def features(names: Sequence[str], theta: Array, scales: Sequence[str] = ()) -> Array:
    """Emulator inputs (n, k) of parameters theta (n, k) in SI; scales (k): of their ranges, all linear if left out."""
    columns = [
        FEATURES.get(_key(name), _logarithm if logarithmic else np.asarray)(theta[:, i])
        for i, (name, logarithmic) in enumerate(zip(names, which_logarithmic(names, scales), strict=True))
    ]
    return np.stack(columns, axis=1)


def which_logarithmic(names: Sequence[str], scales: Sequence[str]) -> tuple[bool, ...]:
    """Whether a parameter enters by its logarithm."""
    given = scales or ("linear",) * len(names)
    return tuple(s == "logarithmic" and _key(name) not in FEATURES for name, s in zip(names, given, strict=True))


def _logarithm(value: Array) -> Array:
    """log |v|: a logarithmic range lies on one side of 0."""
    return np.log(np.abs(value))


def _key(name: str) -> str:
    return name.rsplit(".", 1)[-1]


@dataclass(frozen=True)
class Region:
    """A box of parameters without an activity limit inside, where runs stand behind the emulator.

    lows, highs: (k,) SI; flat: (k,) True where the parameter is off in this box: no value in it changes a curve.
    """

    lows: Array
    highs: Array
    flat: NDArray[np.bool_]


def regions(
    names: Sequence[str], lows: Array, highs: Array, runs: Array, scales: Sequence[str] = ()
) -> tuple[Region, ...]:
    """The boxes of the case's ranges lows..highs (k,) that the smooth runs (n, k) cover; scales (k): of the ranges.

    A range is trusted one mean spacing, in its scale, beyond the runs' ends. No derivative is taken across an activity
    limit, so a range that contains one is cut there. Its active part is trusted only as far towards the limit as an
    active smooth run reaches, beyond which the bird may be lost at once, and not at all with fewer runs than it takes
    to separate the parameters there. Where a parameter is off, one run speaks for all values.
    """
    needed = len(names) + 1
    pieces = [
        _pieces(_key(name), lows[i], highs[i], runs[:, i], needed, logarithmic)
        for i, (name, logarithmic) in enumerate(zip(names, which_logarithmic(names, scales), strict=True))
    ]
    boxes = [np.array(box, dtype=np.float64).T for box in product(*pieces)]
    return tuple(Region(low, high, flat.astype(bool)) for low, high, flat in boxes)


Piece = tuple[float, float, bool]  # low, high, off


def covered(boxes: Sequence[Region], runs: Array) -> NDArray[np.bool_]:
    """(n,) whether each run (n, k) lies in one of the boxes, ends included."""
    inside = [((runs >= b.lows - _slack(b)) & (runs <= b.highs + _slack(b))).all(axis=1) for b in boxes]
    return np.any(inside, axis=0)


def _slack(box: Region) -> Array:
    return 1e-9 * (box.highs - box.lows)


def _pieces(key: str, low: float, high: float, runs: Array, needed: int, logarithmic: bool) -> list[Piece]:
    """Parts of one parameter's range that the runs (n,) cover; an active part needs so many runs."""
    if key not in FEATURES:
        return [(*(_trusted_logarithms if logarithmic else _trusted)(low, high, runs), False)]
    below, above = (low, min(high, LIMIT)), (max(low, LIMIT), high)
    off, on = (below, above) if key == "tension_erosion" else (above, below)
    active = FEATURES[key](runs) > 0.0
    pieces: list[Piece] = []
    if off[0] < off[1] and not active.all():
        pieces.append((*off, True))
    if active.sum() >= needed:
        start, end = _trusted(*on, runs[active])
        towards_limit = (
            (float(runs[active].min()), end) if key == "tension_erosion" else (start, float(runs[active].max()))
        )
        pieces.append((*towards_limit, False))
    return pieces


def _trusted(low: float, high: float, runs: Array) -> tuple[float, float]:
    """The extent of runs (n,) widened by the mean spacing of n runs in low..high, inside low..high."""
    spacing = (high - low) / max(len(runs) - 1, 1)
    return max(low, float(runs.min()) - spacing), min(high, float(runs.max()) + spacing)


def _trusted_logarithms(low: float, high: float, runs: Array) -> tuple[float, float]:
    """`_trusted` of the logarithms of a range on one side of 0."""
    (start, end), sign = np.sort(np.log(np.abs([low, high]))), np.sign(low)
    found = sign * np.exp(_trusted(float(start), float(end), np.log(np.abs(runs))))
    low, high = np.clip(np.sort(found), low, high)  # rounding leaves no range
    return float(low), float(high)
