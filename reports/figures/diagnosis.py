"""Figures of a diagnosis: probabilities by family, curves and residuals before and after, required discrepancy."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from birdstrike.data.units import display, to_display
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

FAMILIES = {
    "none": GREY,
    "support": BLUE,
    "plate": GREEN,
    "impact": VERMILION,
    "bird": ORANGE,
    "instrument": PURPLE,
    "pairs": BLACK,
    "something_else": SKY,
}
MOST_BARS = 14


@styled
def probability_figure(content: Mapping[str, Any]) -> Figure:
    """Bars of the posterior probabilities, grouped and coloured by family; the 95 % set in full colour."""
    rows = _rows(content)
    figure = Figure(figsize=(WIDE, 0.26 * len(rows) + 0.9), layout="constrained")
    axes = figure.subplots()
    place = np.arange(len(rows))[::-1]
    for y, (name, family, probability, inside) in zip(place, rows, strict=True):
        axes.barh(y, max(probability, 0.002), color=FAMILIES.get(family, GREY), alpha=1.0 if inside else 0.35)
        axes.text(
            min(probability + 0.01, 0.93), y, f"{probability:.2f}" if probability >= 0.005 else "< 0.01", va="center"
        )
    axes.set_yticks(
        place,
        [
            f"{name.replace('_', ' ')}  ({family.replace('_', ' ')})" if name != family else name.replace("_", " ")
            for name, family, _, _ in rows
        ],
    )
    axes.set_xlim(0.0, 1.0)
    axes.set_xlabel("posterior probability; full colour: the 95 % set")
    return figure


def _rows(content: Mapping[str, Any]) -> list[tuple[str, str, float, bool]]:
    """(name, family, probability, in the set), families by their probability, effects within them."""
    family = {one["name"]: one["family"] for one in content["effects"]}
    shares = {name: value for name, value in content["probabilities"].items()}
    inside = set(content["confidence_set"])
    totals = content["families"]
    kept = [name for name in shares if name in inside or shares[name] >= 0.01 or name == "none"]
    kept = sorted(kept, key=lambda name: -shares[name])[:MOST_BARS]
    ordered = sorted(kept, key=lambda name: (-totals.get(family.get(name, "pairs"), 0.0), -shares[name]))
    return [(name, family.get(name, "pairs"), shares[name], name in inside) for name in ordered]


@styled
def residual_figure(curves: pd.DataFrame, units: Mapping[str, str]) -> Figure:
    """Per channel: record and models above, residuals before and after with the error bands below."""
    channels = list(dict.fromkeys(curves["channel"]))
    columns = 2 if len(channels) > 1 else 1
    rows = -(-len(channels) // columns)
    figure = Figure(figsize=(WIDE, 3.3 * rows), layout="constrained")
    grid = figure.subplots(2 * rows, columns, sharex=True, height_ratios=[1.6, 1.2] * rows, squeeze=False)
    for i, name in enumerate(channels):
        r, c = divmod(i, columns)
        _channel(grid[2 * r, c], grid[2 * r + 1, c], curves[curves["channel"] == name], name, units[name], i == 0)
    for i in range(len(channels), rows * columns):
        r, c = divmod(i, columns)
        grid[2 * r, c].set_visible(False)
        grid[2 * r + 1, c].set_visible(False)
    for c in range(columns):
        grid[-1, c].set_xlabel("time [ms]")
    legend_above(grid[0, 0])
    return figure


def _channel(upper: Any, lower: Any, part: pd.DataFrame, name: str, unit: str, first: bool) -> None:
    scale, shown = to_display(1.0, unit), display(1.0, unit)[1]
    time = 1e3 * part["time_s"].to_numpy()
    values = {key: scale * part[key].to_numpy(float) for key in ("measured", "sigma", "error", "before", "after")}
    upper.plot(time, values["measured"], ".", color=BLACK, markersize=2.5, label="record" if first else None)
    lower.fill_between(time, -2 * values["error"], 2 * values["error"], color=SKY, alpha=0.25, lw=0)
    lower.fill_between(time, -2 * values["sigma"], 2 * values["sigma"], color=GREY, alpha=0.35, lw=0)
    for key, colour, dash, words in (("before", VERMILION, "-", "before"), ("after", BLUE, (0, (5, 2)), "after")):
        if np.isfinite(values[key]).any():
            upper.plot(time, values[key], color=colour, linestyle=dash, lw=1.1, label=words if first else None)
            lower.plot(time, values["measured"] - values[key], color=colour, linestyle=dash, lw=0.9)
    lower.axhline(0.0, color=GREY, lw=0.7)
    upper.set_title(f"{name.replace('_', ' ')} [{shown or '-'}]")
    lower.set_ylabel("residual")


@styled
def required_figure(effects: Sequence[Mapping[str, Any]], confidence_set: Sequence[str]) -> Figure:
    """The smallest model error, as a share of the peak, with which each model is consistent."""
    known = [one for one in effects if one["name"] != "something_else"]
    none = [one for one in known if one["name"] == "none"]
    rest = sorted((one for one in known if one["name"] != "none"), key=lambda one: one["required_discrepancy"] or 9.9)[
        :11
    ]
    rows = none + rest
    figure = Figure(figsize=(WIDE, 0.25 * len(rows) + 0.9), layout="constrained")
    axes = figure.subplots()
    place = np.arange(len(rows))[::-1]
    for y, one in zip(place, rows, strict=True):
        value = one["required_discrepancy"]
        colour = BLUE if one["name"] in confidence_set else GREY
        axes.plot([0.05, 100.0 * (value or 0.5)], [y, y], color=colour, lw=2.0)
        axes.plot(100.0 * (value or 0.5), y, "o" if value else ">", color=colour, markersize=5)
    axes.set_yticks(place, [one["name"].replace("_", " ") for one in rows])
    axes.set_xscale("log")
    axes.set_xlim(0.05, 60.0)
    axes.set_xlabel("required model error [% of the peak]; blue: in the 95 % set")
    return figure
