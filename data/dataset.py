"""A campaign's yield: parameters in, curves out, on one clock; and ranges of parameters, each in its scale."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.display import Displayed, draw_curves, own_axes, shown_channel
from birdstrike.data.histories import Array, largest

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes


SMOOTH_LOSS = 0.05
"""Largest eroded share of the bird of a smooth run, where the campaign states none."""


class Ranges:
    """What has ranges lows..highs (k,) SI and scales, "linear" or "logarithmic" of each, linear where left out.

    A logarithmic range lies on one side of 0. Fractions are of the range in its scale.
    """

    lows: Array
    highs: Array
    scales: tuple[str, ...]

    @property
    def logarithmic(self) -> NDArray[np.bool_]:
        """(k,) where the scale is the logarithm."""
        return np.array([scale == "logarithmic" for scale in self.scales or ("linear",) * len(self.lows)])

    def to_physical(self, unit: Array) -> Array:
        """(n, k) or (k,) fractions of the ranges -> SI values of the same shape."""
        linear = self.lows + unit * (self.highs - self.lows)
        if not self.logarithmic.any():
            return linear
        low, high = self._logarithms(self.lows), self._logarithms(self.highs)
        values = np.sign(self.lows) * np.exp(low + unit * (high - low))
        inside = np.clip(values, self.lows, self.highs)  # rounding of exp and log leaves no range
        return np.where(self.logarithmic, np.where((unit >= 0.0) & (unit <= 1.0), inside, values), linear)

    def to_unit(self, values: Array) -> Array:
        """SI values (n, k) or (k,) -> fractions of the ranges; outside 0..1 where a value lies outside its range."""
        linear = (values - self.lows) / (self.highs - self.lows)
        if not self.logarithmic.any():
            return linear
        low, high = self._logarithms(self.lows), self._logarithms(self.highs)
        logarithmic = (self._logarithms(values) - low) / np.where(self.logarithmic, high - low, 1.0)
        return np.where(self.logarithmic, logarithmic, linear)

    def slopes(self, values: Array) -> Array:
        """(k,) by what fraction of each range `to_unit` grows per SI unit at values (k,)."""
        linear = 1.0 / (self.highs - self.lows)
        if not self.logarithmic.any():
            return linear
        width = self._logarithms(self.highs) - self._logarithms(self.lows)
        return np.where(self.logarithmic, 1.0 / np.where(self.logarithmic, values * width, 1.0), linear)

    def outside(self, values: Array) -> NDArray[np.bool_]:
        """(n, k) beyond the range by more than rounding (1e-9 of the range's width)."""
        unit = self.to_unit(values)
        return (unit < -1e-9) | (unit > 1.0 + 1e-9)

    def _logarithms(self, values: Array) -> Array:
        """log |v| on the range's side of 0, of the smallest positive number beyond it; 0 in linear columns."""
        towards = np.where(self.logarithmic, np.maximum(values * np.sign(self.lows), np.finfo(float).tiny), 1.0)
        return np.log(towards)


def fraction(value: float, low: float, high: float, logarithmic: bool) -> float:
    """Place of one value on its range low..high in its scale, 0..1 inside."""
    if logarithmic:
        return math.log(value / low) / math.log(high / low)
    return (value - low) / (high - low)


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
