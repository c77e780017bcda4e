"""Profile likelihood: how the fit worsens when one parameter is held and all others follow.

Raue et al., "Structural and practical identifiability analysis", Bioinformatics 25 (2009) 1923. Where another parameter
stands at the end of its range, a worse fit is due to that end and not to the data: such points are
marked.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from threadpoolctl import threadpool_limits

from birdstrike.data.formatting import plain
from birdstrike.data.histories import Array
from birdstrike.inversion.estimation.calibration import INDISTINGUISHABLE, Calibrator, Mode
from birdstrike.inversion.estimation.coordinates import Box
from birdstrike.inversion.estimation.whitening import Whitening

Fits = tuple[tuple[Mode, Whitening], ...]
POINTS = 11
AT_END = 1e-3  # of a range


@dataclass(frozen=True)
class Profile:
    """values: (p,) SI; rise: (p,) of minus twice the log posterior; at_bound: (p) other keys at an end.

    among: the keys of all parameters.
    """

    name: str
    values: Array
    rise: Array
    at_bound: tuple[tuple[str, ...], ...]
    among: tuple[str, ...] = ()

    @property
    def sentence(self) -> str:
        """On which sides the data bound the parameter, and what stops it where they do not."""
        best = int(np.argmin(self.rise))
        below, above = self._side(range(best, -1, -1), "below"), self._side(range(best, len(self.rise)), "above")
        return f"{plain(self.name, self.among)}: {below}; {above}"

    def _side(self, places: range, side: str) -> str:
        for place in places:
            if self.rise[place] > INDISTINGUISHABLE:
                others = ", ".join(plain(key, self.among) for key in self.at_bound[place])
                why = f"because {others} reaches the end of its range" if others else "by the data"
                return f"{side} bounded {why}"
        return f"{side} not bounded"


def profiles(calibrator: Calibrator, modes: tuple[Mode, ...]) -> tuple[Profile, ...]:
    """One profile for every parameter, over all the boxes where runs stand behind the emulator."""
    with threadpool_limits(limits=1, user_api="blas"):
        fits = tuple((start, calibrator.whitening(start)) for start in _starts(calibrator, modes))
        return tuple(_profile(calibrator, fits, i) for i in range(len(calibrator.coordinates.names)))


def _profile(calibrator: Calibrator, fits: Fits, i: int) -> Profile:
    best = fits[0][0]
    boxes = calibrator.coordinates.boxes
    low, high = min(b.lows[i] for b in boxes), max(b.highs[i] for b in boxes)
    grid = np.unique(np.append(np.linspace(low, high, POINTS), np.clip(best.z[i], low, high)))
    found = [_best(calibrator, fits, i, float(value)) for value in grid]
    known = [(value, mode) for value, mode in zip(grid, found, strict=True) if mode is not None]
    lowest = min(mode.cost for _, mode in known)
    names = calibrator.coordinates.names
    values = calibrator.coordinates.values(i, np.array([value for value, _ in known]))
    ends = tuple(_at_bound(calibrator, mode, i) for _, mode in known)
    return Profile(names[i], values, np.array([mode.cost - lowest for _, mode in known]), ends, tuple(names))


def _best(calibrator: Calibrator, fits: Fits, i: int, value: float) -> Mode | None:
    """The best of the fits from every start whose box holds the value; None where no box does."""
    starts = [one for one in fits if one[0].box.lows[i] <= value <= one[0].box.highs[i]]
    found = [calibrator.held(mode, whitening, i, value) for mode, whitening in starts]
    return min(found, key=lambda mode: mode.cost) if found else None


def _starts(calibrator: Calibrator, modes: tuple[Mode, ...]) -> tuple[Mode, ...]:
    """The modes, and the best one's nearest point in every box that has none."""
    others = [box for box in calibrator.coordinates.boxes if all(mode.box is not box for mode in modes)]
    return (*modes, *(_moved(calibrator, modes[0], box) for box in others))


def _moved(calibrator: Calibrator, mode: Mode, box: Box) -> Mode:
    """The mode's nearest point in another box."""
    z = np.clip(mode.z, box.lows, box.highs)
    return replace(mode, z=z, theta=calibrator.coordinates.theta(z, box), box=box)


def _at_bound(calibrator: Calibrator, mode: Mode, i: int) -> tuple[str, ...]:
    """Other parameters at the end of where they may be, but for those that are off there."""
    near = np.minimum(mode.z - mode.box.lows, mode.box.highs - mode.z) < AT_END
    named = near & ~mode.box.flat & (np.arange(len(mode.z)) != i)
    return tuple(calibrator.coordinates.names[j] for j in np.flatnonzero(named))
