"""The record as it was measured: what of it is used, what was cut and why, its reading at rest, and its noise."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from birdstrike.data.curves import Measured
from birdstrike.data.formatting import reading
from birdstrike.data.histories import Array
from birdstrike.inversion.observations.reader import BESIDE, CLIPPED, FROZEN, HELD, OUTLIER, OUTSIDE, ChannelRecord
from birdstrike.reports.figures.quantities import labelled, milliseconds, shown_readings, words
from birdstrike.reports.figures.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    WIDE,
    styled,
    write_figure,
)

COLOURS = {OUTSIDE: GREY, CLIPPED: VERMILION, BESIDE: ORANGE, FROZEN: PURPLE, OUTLIER: GREEN}
SIGMAS = 2.0


@dataclass(frozen=True)
class DrawnChannel:
    """One channel: time (n,) [s], values (n,) SI with NaN in gaps; cuts: reason -> its instants [s]; rest: (n,) the
    reading at rest, SI, None where it is zero; noise: standard deviation, SI, and where it comes from."""

    name: str
    unit: str
    time: Array
    values: Array
    cuts: Mapping[str, Array]
    rest: Array | None
    noise: float
    source: str

    @classmethod
    def of(cls, measured: Measured, channel: ChannelRecord) -> DrawnChannel:
        """As the reader has read it."""
        rest = None if channel.baseline is None else channel.baseline.at(measured.time)
        cuts = {cut.reason: cut.times for cut in channel.cuts}
        noise = channel.noise
        return cls(
            name=channel.name,
            unit=channel.unit,
            time=measured.time,
            values=measured.channels[channel.name],
            cuts=cuts,
            rest=rest,
            noise=noise.level,
            source=noise.source,
        )


@styled
def record_figure(channels: Sequence[DrawnChannel]) -> Figure:
    """One above the other."""
    figure = Figure(figsize=(WIDE, 1.0 + 2.6 * len(channels)), layout="constrained")
    for axes, channel in zip(np.atleast_1d(figure.subplots(len(channels), 1, sharex=True)), channels, strict=True):
        _draw(axes, channel)
    return figure


def draw_record(measured: Measured, channels: Iterable[ChannelRecord], path: Path) -> None:
    """The figure as a PNG, SVG or PDF file; raises as `write_figure` does."""
    write_figure(record_figure([DrawnChannel.of(measured, channel) for channel in channels]), path)


def _draw(axes: Axes, channel: DrawnChannel) -> None:
    at = milliseconds(channel.time)
    values, unit = shown_readings(channel.values, channel.unit)
    cut = np.isin(channel.time, np.concatenate([np.zeros(0), *channel.cuts.values()]))
    kept = np.where(cut, np.nan, values)
    band = SIGMAS * shown_readings(np.array([channel.noise]), channel.unit)[0][0]
    axes.fill_between(
        at, kept - band, kept + band, color=SKY, alpha=0.45, lw=0, label=f"± {SIGMAS:g} sigma of the noise"
    )
    axes.plot(at, values, color=GREY, lw=0.6)
    size = 3 if len(at) < 60 else 1.5 if HELD in channel.cuts else 0  # each kept one stands alone between held ones
    axes.plot(at, kept, color=BLACK, lw=0.9, marker="o" if size else "", markersize=size, label="used")
    for reason, times in channel.cuts.items():
        which = np.isin(channel.time, times)
        label = f"{reason.split(' (')[0].rstrip(',')}: {len(times)}"
        axes.plot(
            at[which], values[which], ls="none", marker="x", markersize=4, color=COLOURS.get(reason, GREY), label=label
        )
    if channel.rest is not None:
        axes.plot(
            at, shown_readings(channel.rest, channel.unit)[0], color=BLUE, ls="--", lw=1.6, label="reading at rest"
        )
    noise = reading(channel.noise, channel.unit, 2)
    axes.set_title(f"{words(channel.name)}: noise {noise} ({channel.source})")
    axes.set_ylabel(labelled(channel.name, unit))
    axes.set_xlabel("time [ms]")
    axes.legend(loc="best", fontsize=7.5)
