"""Calibrated bird models: held-out errors with their intervals, and curves beside the record."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from birdstrike.data.histories import Histories
from birdstrike.reports.figures.curves import RecordCurve, draw_record
from birdstrike.reports.figures.quantities import labelled, milliseconds, shown_readings, shown_span
from birdstrike.reports.figures.style import BLUE, GREEN, ORANGE, PURPLE, SKY, VERMILION, WIDE, legend_above, styled
from birdstrike.reports.figures.switches import CALIBRATED, MARK, PUBLISHED, WIDTHS

COLOURS = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY)
DASHES = ("-", (0, (6, 1.5)), (0, (6, 1.5, 1.2, 1.5)), (0, (1.2, 1.2)), (0, (9, 2.5)), (0, (3, 1)))
MOST_LETTERS = 90
"""Of the shots' names side by side below an axis; more would run into one another, and are turned."""

Errors = Mapping[str, tuple[float, tuple[float, float]]]
"""Model -> held-out error and its 95 % interval."""


@styled
def heldout_figure(shots: Mapping[str, Errors], names: Sequence[str]) -> Figure:
    """A column a shot, a point a model: held-out error over the noise, with its bootstrap interval; 1 is noise."""
    figure = Figure(figsize=(WIDE, 3.2), layout="constrained")
    axes = figure.subplots()
    width = 0.7 / max(len(names), 1)
    for i, name in enumerate(names):
        at = np.arange(len(shots)) + (i - 0.5 * (len(names) - 1)) * width
        values = np.array([errors[name][0] for errors in shots.values()])
        ends = np.array([errors[name][1] for errors in shots.values()])
        bars = np.abs(ends.T - values)
        axes.errorbar(at, values, bars, fmt="o", color=COLOURS[i % len(COLOURS)], capsize=3, label=name)
    axes.axhline(1.0, color="black", linewidth=0.7, linestyle=":")
    axes.set_yscale("log")
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.set_xticks(range(len(shots)), list(shots))
    if sum(map(len, shots)) > MOST_LETTERS:
        axes.tick_params(axis="x", rotation=20)
    axes.set_ylabel("Held-out error over noise [–]")
    axes.grid(axis="x", visible=False)
    legend_above(axes, columns=5)
    return figure


@styled
def curves_figure(
    channels: Mapping[str, str],
    records: Mapping[str, RecordCurve],
    calibrated: Mapping[str, Histories],
    published: Mapping[str, Histories],
    names: Sequence[str],
) -> Figure:
    """One panel a channel (name -> SI unit): its record, models with calibrated constants in full lines, with published
    ones in thin ones."""
    figure = Figure(figsize=(WIDE, 0.7 + 2.3 * len(channels)), layout="constrained")
    panels = figure.subplots(len(channels), 1, sharex=True, squeeze=False)[:, 0]
    until = max((float(run.time[-1]) for runs in (calibrated, published) for run in runs.values()), default=np.inf)
    span = shown_span(next(iter(records.values())).time, until)
    for axes, (channel, unit) in zip(panels, channels.items(), strict=True):
        for runs, mark in ((published, PUBLISHED), (calibrated, CALIBRATED)):
            for i, name in enumerate(names):
                if name not in runs or channel not in runs[name].channels:
                    continue
                run = runs[name]
                axes.plot(
                    milliseconds(run.time),
                    shown_readings(run.channels[channel], unit)[0],
                    color=COLOURS[i % len(COLOURS)],
                    linestyle=DASHES[i % len(DASHES)],
                    gid=MARK + mark,
                    label=f"{name}, {mark}",
                    linewidth=WIDTHS[mark],
                )
        draw_record(axes, records[channel], unit, span[1])
        axes.set_ylabel(labelled(channel, shown_readings(np.zeros(1), unit)[1]))
        axes.margins(y=0.08)
    panels[-1].set_xlim(*milliseconds(np.asarray(span)))
    panels[-1].set_xlabel("Time on the record's clock [ms]")
    legend_above(panels[0], columns=3)
    return figure
