"""A campaign's yield: parameters in, curves out, on one clock."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.display import Displayed, draw_curves, own_axes, shown_channel
from birdstrike.data.histories import Array, largest
from birdstrike.data.ranges import Ranges

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes


SMOOTH_LOSS = 0.05
"""Largest eroded share of the bird of a smooth run, where the campaign states none."""


@dataclass(frozen=True, repr=False)
class Dataset(Displayed, Ranges):
    """Finished runs of a campaign.

    names: dotted case keys of the k parameters; units: SI unit of each; lows, highs: (k,) the case's ranges;
    runs: (n,) run numbers as in `design.csv` (from 1); parameters: (n, k) SI;
    time: (m,) [s]; curves: sensor name -> (n, m) SI; channel_units: sensor name -> SI unit;
    smooth: (n,) False where a run left the smooth regime (a larger share of the bird eroded than smooth_loss, which the
    bird's material declares): kept, not fitted;
    scales: "linear" or "logarithmic" of each parameter's range, all linear where left out;
    case_hash: hash of the resolved base case, so that a measurement is not inverted with another case's runs;
    drifts: sensor -> drift of its instrument by the case, SI a second, which the curves hold.
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
    smooth_loss: float = SMOOTH_LOSS
    scales: tuple[str, ...] = ()
    drifts: Mapping[str, float] = field(default_factory=dict)

    def named(self, theta: Array) -> dict[str, float]:
        """Parameters (k,) SI by their dotted case keys."""
        return dict(zip(self.names, map(float, theta), strict=True))

    @property
    def ranges(self) -> dict[str, tuple[float, float]]:
        """Dotted case key -> the parameter's range, SI."""
        return {name: (float(a), float(b)) for name, a, b in zip(self.names, self.lows, self.highs, strict=True)}

    def nearest(self, theta: Array) -> int:
        """Row of the run whose parameters lie nearest to theta (k,) SI, as fractions of the ranges in their scales."""
        apart = self.to_unit(self.parameters) - self.to_unit(theta)
        return int(np.argmin((apart**2).sum(axis=1)))

    @property
    def distinct(self) -> NDArray[np.bool_]:
        """(n,) False for a run that repeats the values of an earlier one: the same curves, from which nothing is
        learnt, and its twin would predict it exactly when it is left out."""
        first = np.unique(self.parameters, axis=0, return_index=True)[1]
        return np.isin(np.arange(len(self.runs)), first)

    def sampled(self, channel: str, times: Array) -> Array:
        """One channel of every run at `times` [s], (n, len(times)); NaN outside the record."""
        return np.stack([np.interp(times, self.time, y, left=np.nan, right=np.nan) for y in self.curves[channel]])

    @property
    def headline(self) -> str:
        """Runs, parameters, channels."""
        left = len(self.runs) - int(self.smooth.sum())
        rough = f" ({left} outside the smooth regime)" if left else ""
        keys = ", ".join(name.rsplit(".", 1)[-1] for name in self.names)
        return f"Dataset: {len(self.runs)} runs{rough} over {keys}; channels {', '.join(self.curves)}"

    def to_dataframe(self) -> pd.DataFrame:
        """A row a run: number, parameters, the largest reading of every channel (SI), and whether it is smooth."""
        import pandas as pd

        peaks = {
            f"peak_{name}_{self.channel_units[name]}".rstrip("_"): largest(rows) for name, rows in self.curves.items()
        }
        columns = {name: self.parameters[:, i] for i, name in enumerate(self.names)}
        return pd.DataFrame({"run": self.runs, **columns, **peaks, "smooth": self.smooth})

    def plot(self, channel: str | None = None, axes: Axes | None = None, **look: Any) -> Axes:
        """All runs of one channel (default: the first) over time; `look` goes to matplotlib's plot."""
        name = shown_channel(channel, self.curves)
        given: dict[str, Any] = {"color": "tab:blue", "alpha": 0.4, "linewidth": 0.8, **look}
        return draw_curves(own_axes(axes), self.time, self.curves[name], name, self.channel_units[name], **given)

    def draw(self) -> tuple[partial[Axes], ...]:
        """The first channels."""
        return tuple(partial(self.plot, name) for name in list(self.curves)[:3])
