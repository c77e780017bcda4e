"""Result of one simulation: sensor histories on a common clock, its energy balance, and a few snapshots."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.display import Displayed, draw_curves, own_axes, shown_channel
from birdstrike.data.formatting import many, reading
from birdstrike.data.units import display, of_reading

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

Array = NDArray[np.floating[Any]]
Indices = NDArray[np.intp]


def farthest(values: Array) -> NDArray[np.intp]:
    """(...) index of the largest reading of curves (..., n): the one farthest from 0, either way; NaN are skipped."""
    return np.asarray(np.nanargmax(np.abs(values), axis=-1))


def largest(values: Array) -> Array:
    """(...) largest reading of curves (..., n), with its sign."""
    return np.take_along_axis(values, farthest(values)[..., None], axis=-1)[..., 0]


def side_of(values: Array) -> float:
    """1 or -1: the side of 0 on which the largest reading of a curve (n,) lies.

    Curves that are compared are read on one side, that of one of them: of a curve that swings as far either way the
    largest reading would leap from one side to the other.
    """
    return -1.0 if values[farthest(values)] < 0.0 else 1.0


@dataclass(frozen=True)
class Snapshot:
    """The simulation at one instant, for pictures and ParaView.

    time: [s]; particles: (n, 3) positions [m]; pressure: (n,) [Pa]; velocity: (n, 3) [m/s];
    eroded: (n,) bool; bird_stress: (n,) von Mises [Pa];
    cells: (k, 8) node numbers of the bird's hexahedra, none when it is of particles;
    nodes: (m, 3) current positions of the shell nodes [m]; quads: (e, 4) node numbers of those not torn;
    plate_stress: (e,) largest von Mises stress through the thickness [Pa].
    """

    time: float
    particles: Array
    pressure: Array
    velocity: Array
    eroded: NDArray[np.bool_]
    bird_stress: Array
    cells: NDArray[np.int64]
    nodes: Array
    quads: NDArray[np.int64]
    plate_stress: Array


@dataclass(frozen=True, repr=False)
class Histories(Displayed):
    """Histories of one simulation.

    time: (n,) [s], uniform; channels: sensor name -> (n,) in SI; units: sensor name -> SI unit ("m", "N", "");
    summary: the run's energies and figures, the content of `summary.json`; snapshots: in order of time.
    """

    time: Array
    channels: Mapping[str, Array]
    units: Mapping[str, str]
    summary: Mapping[str, Any] = field(default_factory=dict)
    snapshots: tuple[Snapshot, ...] = ()

    def at(self, channel: str, times: Array) -> Array:
        """Linear interpolation of one channel at `times` [s]; before the first and after the last sample: NaN."""
        return np.interp(times, self.time, self.channels[channel], left=np.nan, right=np.nan)

    @property
    def headline(self) -> str:
        """Channels, length, and the first channel's peak."""
        count, end = len(self.channels), display(float(self.time[-1]), "s")
        first = next(iter(self.channels), None)
        if first is None:
            return f"Histories: no channel, {len(self.time)} instants to {end[0]:.3g} {end[1]}"
        peak = reading(self.peak(first)[1], self.units[first])
        size = f"{many(count, 'channel')}, {len(self.time)} instants to {end[0]:.3g} {end[1]}"
        return f"Histories: {size}, peak of {first} {peak}"

    def peak(self, channel: str) -> tuple[float, float]:
        """Time [s] and value, SI, of a channel's largest reading: the one farthest from 0, with its sign."""
        values = self.channels[channel]
        top = int(farthest(values))
        return float(self.time[top]), float(values[top])

    def to_dataframe(self) -> pd.DataFrame:
        """A row an instant: time_s, then a column a channel with its SI unit in the name, as in histories.csv."""
        import pandas as pd

        columns = {f"{name}_{self.units[name]}".rstrip("_"): values for name, values in self.channels.items()}
        return pd.DataFrame({"time_s": self.time, **columns})

    def brief(self) -> pd.DataFrame:
        """A row a channel: its peak, and when."""
        import pandas as pd

        rows = []
        for name, unit in self.units.items():
            (at, value), (factor, shown) = self.peak(name), display(1.0, of_reading(unit))
            rows.append({"channel": name, "peak": factor * value, "unit": shown, "at [ms]": 1e3 * at})
        return pd.DataFrame(rows)

    def plot(self, channel: str | None = None, axes: Axes | None = None, **look: Any) -> Axes:
        """One channel (default: the first) over time, in engineers' units; `look` goes to matplotlib's plot."""
        name = shown_channel(channel, self.channels)
        return draw_curves(own_axes(axes), self.time, self.channels[name], name, self.units[name], **look)

    def draw(self) -> tuple[partial[Axes], ...]:
        """The first channels."""
        return tuple(partial(self.plot, name) for name in list(self.channels)[:3])
