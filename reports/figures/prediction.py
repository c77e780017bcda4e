"""A prediction: one sensor's bands over time, and where the width of its largest reading comes from."""

from __future__ import annotations

from collections.abc import Mapping

from matplotlib.figure import Figure

from birdstrike.data.histories import Array
from birdstrike.inversion.prediction.budget import SOURCES
from birdstrike.reports.figures.quantities import labelled, milliseconds, shown_readings
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
    legend_above,
    styled,
)

COLOURS = dict(zip(SOURCES, (BLUE, VERMILION, ORANGE, GREEN, PURPLE, GREY), strict=True))


@styled
def bands_figure(name: str, unit: str, time: Array, quantiles: Mapping[str, Array], limit: float | None) -> Figure:
    """quantiles: as in prediction.csv, SI."""
    figure = Figure(figsize=(WIDE, 3.4), layout="constrained")
    on = figure.subplots()
    at = milliseconds(time)
    own = {key: shown_readings(values, unit)[0] for key, values in quantiles.items()}
    display = shown_readings(time, unit)[1]
    on.fill_between(at, own["q025"], own["q975"], color=SKY, alpha=0.35, linewidth=0.0, label="95 %")
    on.fill_between(at, own["q25"], own["q75"], color=BLUE, alpha=0.35, linewidth=0.0, label="50 %")
    on.plot(at, own["q50"], color=BLUE, label="median")
    if limit is not None:
        on.axhline(float(shown_readings(time * 0.0 + limit, unit)[0][0]), color=BLACK, linestyle="--", label="limit")
    on.set_ylabel(labelled(name, display))
    on.set_xlabel("Time [ms]")
    legend_above(on)
    return figure


@styled
def budget_figure(sources: Mapping[str, Mapping[str, float]]) -> Figure:
    """sources: sensor -> source -> share of the variance of its largest reading."""
    figure = Figure(figsize=(WIDE, 1.2 + 0.42 * len(sources)), layout="constrained")
    on = figure.subplots()
    names = list(sources)[::-1]
    left = [0.0] * len(names)
    for source in SOURCES:
        widths = [100.0 * sources[name][source] for name in names]
        on.barh([name.replace("_", " ") for name in names], widths, left=left, color=COLOURS[source], label=source)
        left = [a + b for a, b in zip(left, widths, strict=True)]
    on.set_xlim(0.0, 100.0)
    on.set_xlabel("share of the variance of the largest reading [%]")
    on.grid(visible=False, axis="y")
    legend_above(on)
    return figure
