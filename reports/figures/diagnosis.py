"""Figures of a diagnosis: the record with both models and their residuals; what the data say of every effect."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from birdstrike.data.units import display, to_display
from birdstrike.reports.figures.style import BLACK, BLUE, GREY, SKY, VERMILION, WIDE, legend_above, styled

LEAST_P = 1e-4


@styled
def before_after_figure(curves: pd.DataFrame, units: Mapping[str, str]) -> Figure:
    """Per channel: curves above, residuals with the band of noise and numerical error below."""
    channels = list(dict.fromkeys(curves["channel"]))
    figure = Figure(figsize=(WIDE, 3.9 * len(channels)), layout="constrained")
    grid = figure.subplots(2 * len(channels), 1, sharex=True, height_ratios=[2.0, 1.2] * len(channels), squeeze=False)[
        :, 0
    ]
    for i, name in enumerate(channels):
        _channel(grid[2 * i], grid[2 * i + 1], curves[curves["channel"] == name], name, units[name], first=i == 0)
    grid[-1].set_xlabel("time [ms]")
    legend_above(grid[0])
    return figure


def _channel(upper: Any, lower: Any, part: Any, name: str, unit: str, first: bool) -> None:
    scale, shown = to_display(1.0, unit), display(1.0, unit)[1]
    time = 1e3 * part["time_s"].to_numpy()
    values = {key: scale * part[key].to_numpy(float) for key in ("measured", "error", "before", "after")}
    upper.plot(time, values["measured"], ".", color=BLACK, markersize=2.5, label="record" if first else None)
    lower.fill_between(time, -2 * values["error"], 2 * values["error"], color=SKY, alpha=0.3, lw=0, label=None)
    for key, colour, dash, words in (
        ("before", VERMILION, "-", "before"),
        ("after", BLUE, (0, (5, 2)), "after the effect is added"),
    ):
        if np.isfinite(values[key]).any():
            upper.plot(time, values[key], color=colour, linestyle=dash, label=words if first else None)
            lower.plot(time, values["measured"] - values[key], color=colour, linestyle=dash, lw=1.0)
    lower.axhline(0.0, color=GREY, lw=0.7)
    upper.set_ylabel(f"{name.replace('_', ' ')}\n[{shown or '-'}]")
    lower.set_ylabel(f"residual [{shown or '-'}]\n(band: 2 sigma)")


@styled
def consistency_figure(effects: Sequence[Mapping[str, Any]], alpha: float) -> Figure:
    """p-value of every model on a log scale, the likeliest on top; beyond the line the data allow it."""
    figure = Figure(figsize=(WIDE, 0.24 * len(effects) + 1.1), layout="constrained")
    axes = figure.subplots()
    p = np.maximum([one["p_consistent"] for one in effects], LEAST_P)
    place = np.arange(len(effects))[::-1]
    colours = [BLUE if value >= alpha else GREY for value in p]
    axes.hlines(place, LEAST_P, p, color=colours, lw=2.0)
    axes.scatter(p, place, color=colours, s=22, zorder=3)
    axes.axvline(alpha, color=VERMILION, lw=1.0)
    axes.set_xscale("log")
    axes.set_xlim(0.8 * LEAST_P, 1.3)
    axes.set_yticks(place, [one["name"] for one in effects])
    axes.set_xlabel(f"p of the data under the model (line: {alpha:g}; to its right the data allow the model)")
    axes.grid(axis="y", visible=False)
    return figure
