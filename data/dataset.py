"""A campaign's yield: parameters in, curves out, on one clock."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.histories import Array


@dataclass(frozen=True)
class Dataset:
    """Finished runs of a campaign.

    names: dotted case keys of the k parameters; units: SI unit of each; lows, highs: (k,) the case's ranges;
    runs: (n,) run numbers as in `design.csv` (from 1); parameters: (n, k) SI;
    time: (m,) [s]; curves: sensor name -> (n, m) SI; channel_units: sensor name -> SI unit;
    smooth: (n,) False where a run left the smooth regime (more than 5 % of the bird eroded): kept, not fitted;
    case_hash: hash of the resolved base case, so that a measurement is not inverted with another case's runs.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    lows: Array
    highs: Array
    runs: NDArray[np.int64]
    parameters: Array
    time: Array
    curves: Mapping[str, Array]
    channel_units: Mapping[str, str]
    smooth: NDArray[np.bool_]
    case_hash: str

    def scaled(self) -> Array:
        """Parameters mapped to 0..1 over their ranges, (n, k)."""
        return (self.parameters - self.lows) / (self.highs - self.lows)

    def sampled(self, channel: str, times: Array) -> Array:
        """One channel of every run at `times` [s], (n, len(times)); NaN outside the record."""
        return np.stack([np.interp(times, self.time, y, left=np.nan, right=np.nan) for y in self.curves[channel]])
