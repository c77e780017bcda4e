"""Figures of a diagnosis: how likely each model is and what it needs, residuals and curves before and after."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import groupby
from operator import itemgetter
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from birdstrike.data.units import display, of_reading
from birdstrike.inversion.labels import in_words, label_parts
from birdstrike.inversion.results.diagnosis import Diagnosis
from birdstrike.reports.figures.quantities import probability_text
from birdstrike.reports.figures.style import BLACK, GREY, WIDE, legend_above, styled

BAR = "#4C5B70"
STATES = {"before": ("#6B6B6B", "-"), "after": ("#882255", (0, (5, 2)))}
"""In colours that no bird model or method has, since a report shows these too: dark grey, and the wine of the muted
scheme in P. Tol, Colour Schemes, SRON/EPS/TN/09-002 (2021)."""
BANDS = {"all": "#E9E9E9", "noise": "#C4C4C4"}
BRACKET = 1.13  # place of the families' brackets beside the bars
MOST_ROWS = 10
REPORTED = 0.01  # probability from which on a model outside the 95 % set is shown
SHARES = (0.05, 60.0)  # % of the peak: axis of the required model error


@styled
def probability_figure(found: Diagnosis) -> Figure:
    """Left: posterior probabilities, in brackets by family. Right: the model error that each model requires."""
    rows = shown_models(found)[::-1]
    family = {one.name: one.family for one in found.effects}
    figure = Figure(figsize=(WIDE, 0.24 * len(rows) + 0.95), layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True, width_ratios=[1.6, 1.0])
    for y, name in enumerate(rows):
        inside = name in found.confidence_set
        _bar(left, y, found.probabilities.get(name, 0.0), inside)
        if name in found.required_discrepancy:
            _required(right, y, found.required_discrepancy[name], inside)
    _brackets(left, [family.get(name, "pairs") for name in rows], found.families)
    left.set_yticks(range(len(rows)), [in_words(name) for name in rows])
    left.set_xlim(0.0, 1.62)
    left.set_xticks(np.linspace(0.0, 1.0, 6))
    left.set_title("how likely: posterior probability")
    right.set_xscale("log")
    right.set_xlim(*SHARES)
    right.set_xticks([0.1, 1.0, 10.0], ["0.1 %", "1 %", "10 %"])
    right.set_title("model error needed")
    for axes in (left, right):
        axes.grid(axis="y", visible=False)
        axes.tick_params(axis="y", length=0)
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
    own = {name: family.get(name, "pairs") for name in kept}
    return sorted(kept, key=lambda n: (-found.families.get(own[n], 0.0), own[n], -shares.get(n, 0.0)))


def _bar(axes: Axes, y: float, probability: float, inside: bool) -> None:
    """One probability; pale outside the 95 % set."""
    axes.barh(y, max(probability, 0.003), height=0.66, color=BAR, alpha=1.0 if inside else 0.35)
    words = {"va": "center", "fontsize": 8.5, "fontweight": "bold" if inside else "normal"}
    axes.text(probability + 0.015, y, probability_text(probability), **words)


def _required(axes: Axes, y: float, share: float | None, inside: bool) -> None:
    """One required model error; an arrow where half of the peak is not enough."""
    end = SHARES[1] if share is None else max(100.0 * share, 1.1 * SHARES[0])
    alpha = 1.0 if inside else 0.4
    axes.plot([SHARES[0], end], [y, y], color=BAR, lw=2.0, alpha=alpha)
    axes.plot(end, y, ">" if share is None else "o", color=BAR, markersize=5, alpha=alpha, clip_on=False)
    least = share is not None and 100.0 * share <= SHARES[0]
    needed = "over 50 %" if share is None else f"{'up to ' if least else ''}{100.0 * share:.2g} %"
    right = end > 8.0
    axes.annotate(
        needed,
        (end, y),
        (-8, 4) if right else (8, 0),
        textcoords="offset points",
        ha="right" if right else "left",
        va="bottom" if right else "center",
        fontsize=8.0,
    )


def _brackets(axes: Axes, families: Sequence[str], totals: Mapping[str, float]) -> None:
    """Each family with its probability beside its rows, `families` from below."""
    for family, rows in groupby(enumerate(families), key=itemgetter(1)):
        first, *others = (y for y, _ in rows)
        last = others[-1] if others else first
        axes.plot([BRACKET] * 2, [first - 0.33, last + 0.33], color=GREY, lw=1.0)
        share = f" {probability_text(totals[family])}" if family in totals else ""
        words = f"{family.replace('_', ' ')}{share}"
        axes.text(BRACKET + 0.03, 0.5 * (first + last), words, va="center", fontsize=8.5)


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
    axes.fill_between(time, -band, band, color=BANDS["all"], lw=0, label=words)
    axes.fill_between(time, -noise, noise, color=BANDS["noise"], lw=0, label="2 sd: noise alone")
    axes.axhline(0.0, color=GREY, lw=0.7)
    residuals = {key: values["measured"] - values["baseline"] - values[key] for key in STATES}
    residuals = {key: one for key, one in residuals.items() if np.isfinite(one).any()}
    for key, one in residuals.items():
        colour, dash = STATES[key]
        axes.plot(time, one, color=colour, linestyle=dash, lw=1.2, label=f"record less model, {key}")
    axes.set_title(f"{name.replace('_', ' ')}, residual [{shown}]")
    largest = max(float(np.nanmax(np.abs(one))) for one in residuals.values())
    top = 1.15 * max(largest, float(np.median(band)))
    axes.set_ylim(-top, top)


def _displayed(part: pd.DataFrame, unit: str) -> tuple[Any, dict[str, Any], str]:
    """Time [ms] and columns in the unit that is shown."""
    scale, shown = display(1.0, of_reading(unit))
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
        axes.set_title(f"{name.replace('_', ' ')} [{shown}]")
    legend_above(next(iter(panels.values())))
    return figure
