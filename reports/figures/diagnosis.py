"""Figures of a diagnosis: how likely each model is and what it needs, residuals and curves before and after."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from birdstrike.data.units import display, to_display
from birdstrike.inversion.labels import in_words, label_parts
from birdstrike.inversion.results.diagnosis import Diagnosis
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
STATES = {"before": (VERMILION, "-"), "after": (BLUE, (0, (5, 2)))}
MOST_ROWS = 10
REPORTED = 0.01  # probability from which on a model outside the 95 % set is shown
SHARES = (0.05, 60.0)  # % of the peak: axis of the required model error


@styled
def probability_figure(found: Diagnosis) -> Figure:
    """Left: posterior probabilities, coloured by family. Right: the model error that each model requires."""
    rows = shown_models(found)
    family = {one.name: one.family for one in found.effects}
    figure = Figure(figsize=(WIDE, 0.24 * len(rows) + 1.15), layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True, width_ratios=[1.25, 1.0])
    for y, name in enumerate(reversed(rows)):
        own, inside = family.get(name, "pairs"), name in found.confidence_set
        _bar(left, y, found.probabilities.get(name, 0.0), FAMILIES.get(own, GREY), inside)
        if name in found.required_discrepancy:
            _required(right, y, found.required_discrepancy[name], FAMILIES.get(own, GREY), inside)
    left.set_yticks(range(len(rows)), [in_words(name) for name in reversed(rows)])
    left.set_xlim(0.0, 1.12)
    left.set_xticks(np.linspace(0.0, 1.0, 6))
    left.set_title("how likely: posterior probability")
    right.set_xscale("log")
    right.set_xlim(*SHARES)
    right.set_xticks([0.1, 1.0, 10.0], ["0.1 %", "1 %", "10 %"])
    right.set_title("model error needed")
    for axes in (left, right):
        axes.grid(axis="y", visible=False)
        axes.tick_params(axis="y", length=0)
    _family_legend(figure, found.families, [family.get(name, "pairs") for name in rows])
    return figure


def shown_models(found: Diagnosis) -> list[str]:
    """The likeliest models, families by their probability and models within them; `none` is always among them."""
    family = {one.name: one.family for one in found.effects}
    shares, inside = found.probabilities, set(found.confidence_set)
    likely = [name for name in shares if name in inside or shares[name] >= REPORTED]
    needs = {
        name: value
        for name, value in found.required_discrepancy.items()
        if value is not None and label_parts(name)[1] not in found.left_out
    }
    kept = dict.fromkeys(["none", *likely[: MOST_ROWS - 3], *sorted(needs, key=lambda name: needs[name])[:2]])
    totals = found.families
    return sorted(kept, key=lambda n: (-totals.get(family.get(n, "pairs"), 0.0), -shares.get(n, 0.0)))


def _bar(axes: Axes, y: float, probability: float, colour: str, inside: bool) -> None:
    """One probability; pale outside the 95 % set."""
    axes.barh(y, max(probability, 0.003), height=0.66, color=colour, alpha=1.0 if inside else 0.35)
    axes.text(
        probability + 0.015, y, _told(probability), va="center", fontsize=8.5, fontweight="bold" if inside else "normal"
    )


def _told(probability: float) -> str:
    """Two decimals; of the least that they round to 0, a limit."""
    return f"{probability:.2f}" if probability >= 0.005 else "< 0.01"


def _required(axes: Axes, y: float, share: float | None, colour: str, inside: bool) -> None:
    """One required model error; an arrow where half of the peak is not enough."""
    end = SHARES[1] if share is None else max(100.0 * share, 1.1 * SHARES[0])
    alpha = 1.0 if inside else 0.4
    axes.plot([SHARES[0], end], [y, y], color=colour, lw=2.0, alpha=alpha)
    axes.plot(end, y, ">" if share is None else "o", color=colour, markersize=5, alpha=alpha, clip_on=False)
    least = share is not None and 100.0 * share <= SHARES[0]
    told = "over 50 %" if share is None else f"{'up to ' if least else ''}{100.0 * share:.2g} %"
    right = end > 8.0
    axes.annotate(
        told,
        (end, y),
        (-8, 4) if right else (8, 0),
        textcoords="offset points",
        ha="right" if right else "left",
        va="bottom" if right else "center",
        fontsize=8.0,
    )


def _family_legend(figure: Figure, totals: Mapping[str, float], shown: list[str]) -> None:
    """Families with their probabilities."""
    names = [name for name in sorted(totals, key=lambda n: -totals[n]) if name in shown]
    patches = [Patch(color=FAMILIES.get(n, GREY), label=f"{n.replace('_', ' ')} {_told(totals[n])}") for n in names]
    figure.legend(handles=patches, loc="outside upper left", ncols=8, handlelength=1.0, columnspacing=1.2)


@styled
def residual_figure(curves: pd.DataFrame, units: Mapping[str, str]) -> Figure:
    """Per channel: residuals before and after on the same axes, with the bands of noise and of all errors together."""
    figure, panels = _panels(curves, 1.9, 0.7)
    for name, axes in panels.items():
        _residuals(axes, curves.loc[curves["channel"] == name], name, units[name])
    legend_above(next(iter(panels.values())), columns=4)
    return figure


def _panels(curves: pd.DataFrame, row: float, rest: float) -> tuple[Figure, dict[str, Axes]]:
    """A figure with axes for every channel, at most two beside each other; row, rest: its height [in]."""
    channels = list(dict.fromkeys(curves["channel"]))
    columns = min(len(channels), 2)
    rows = -(-len(channels) // columns)
    figure = Figure(figsize=(WIDE, row * rows + rest), layout="constrained")
    grid = figure.subplots(rows, columns, sharex=True, squeeze=False)
    for axes in grid.flat[len(channels) :]:
        axes.set_visible(False)
    for axes in grid.flat[max(len(channels) - columns, 0) : len(channels)]:  # the lowest of each column
        axes.set_xlabel("time [ms]")
        axes.tick_params(labelbottom=True)
    return figure, dict(zip(channels, grid.flat, strict=False))


def _residuals(axes: Axes, part: pd.DataFrame, name: str, unit: str) -> None:
    """One channel."""
    time, values, shown = _displayed(part, unit)
    band, noise = 2.0 * values["error"], 2.0 * values["sigma"]
    words = "2 sd: noise, numerical and model error"
    axes.fill_between(time, -band, band, color=SKY, alpha=0.25, lw=0, label=words)
    axes.fill_between(time, -noise, noise, color=GREY, alpha=0.45, lw=0, label="2 sd: noise alone")
    axes.axhline(0.0, color=GREY, lw=0.7)
    residuals = {key: values["measured"] - values["baseline"] - values[key] for key in STATES}
    residuals = {key: one for key, one in residuals.items() if np.isfinite(one).any()}
    for key, one in residuals.items():
        colour, dash = STATES[key]
        axes.plot(time, one, color=colour, linestyle=dash, lw=1.2, label=f"record less model, {key}")
    axes.set_title(f"{name.replace('_', ' ')}, residual [{shown or '-'}]")
    largest = max(float(np.nanmax(np.abs(one))) for one in residuals.values())
    top = 1.15 * max(largest, float(np.median(band)))
    axes.set_ylim(-top, top)


def _displayed(part: pd.DataFrame, unit: str) -> tuple[Any, dict[str, Any], str]:
    """Time [ms] and columns in the unit that is shown."""
    scale, shown = to_display(1.0, unit), display(1.0, unit)[1]
    columns = ("measured", "sigma", "error", "baseline", "before", "after", "before_solver", "after_solver")
    return 1e3 * part["time_s"].to_numpy(), {key: scale * part[key].to_numpy(float) for key in columns}, shown


@styled
def curves_figure(curves: pd.DataFrame, units: Mapping[str, str]) -> Figure:
    """Per channel: the record and the model before and after."""
    figure, panels = _panels(curves, 2.3, 0.6)
    for name, axes in panels.items():
        time, values, shown = _displayed(curves.loc[curves["channel"] == name], units[name])
        axes.plot(time, values["measured"], ".", color=BLACK, markersize=2.5, label="record")
        for key, (colour, dash) in STATES.items():
            if np.isfinite(values[key]).any():
                axes.plot(time, values[key], color=colour, linestyle=dash, lw=1.2, label=f"model, {key}")
        axes.set_title(f"{name.replace('_', ' ')} [{shown or '-'}]")
    legend_above(next(iter(panels.values())))
    return figure
