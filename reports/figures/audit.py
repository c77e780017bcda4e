"""Figures of the audit: what was planted against what was answered, and power against the size of effects."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, MaxNLocator, NullLocator

from birdstrike.data.units import from_si
from birdstrike.reports.figures.style import BLUE, GREY, VERMILION, WIDE, styled
from birdstrike.solver.case.effects import SHOWN
from birdstrike.solver.effects.registry import effects

COLUMNS = 4
LAST = ("none needed", "ambiguous, truth among them", "ambiguous, truth not among them", "unexplained")


@styled
def confusion_figure(confusion: Mapping[str, Mapping[str, float]]) -> Figure:
    """Rows: what was planted; columns: the answer; shares of the noise draws."""
    answers = sorted({a for row in confusion.values() for a in row if a not in LAST}) + list(LAST)
    matrix = np.array([[row.get(answer, 0.0) for answer in answers] for row in confusion.values()])
    figure = Figure(figsize=(WIDE, 0.3 * len(matrix) + 2.6), layout="constrained")
    axes = figure.subplots()
    axes.imshow(matrix, cmap="Blues", vmin=0.0, vmax=1.0, aspect="auto")
    axes.grid(visible=False)
    axes.set_xticks(range(len(answers)), answers, rotation=40, ha="right")
    axes.set_yticks(range(len(matrix)), [_short(name) for name in confusion])
    for i, row in enumerate(matrix):
        for j, share in enumerate(row):
            if share >= 0.005:
                axes.text(
                    j, i, f"{100 * share:.0f}", ha="center", va="center", color="w" if share > 0.6 else "k", size=7
                )
    axes.set_title("answers in % of the noise draws (rows: planted, columns: answered)")
    return figure


def _short(name: str) -> str:
    return name if len(name) <= 48 else f"{name[:46]}…"


@styled
def power_figure(power: Sequence[Mapping[str, Any]], alpha: float) -> Figure:
    """Probability that the model without effects is rejected against the effect's size, one panel an effect."""
    names = list(dict.fromkeys(one["effect"] for one in power))
    rows = -(-len(names) // COLUMNS)
    figure = Figure(figsize=(WIDE, 1.75 * rows + 0.3), layout="constrained")
    panels = figure.subplots(rows, COLUMNS, squeeze=False, sharey=True)
    for axes in panels.ravel()[len(names) :]:
        axes.remove()
    for axes, name in zip(panels.ravel(), names, strict=False):
        _panel(axes, name, [one for one in power if one["effect"] == name], alpha)
    for axes in panels[:, 0]:
        axes.set_ylabel("power")
    return figure


def _panel(axes: Axes, name: str, power: Sequence[Mapping[str, Any]], alpha: float) -> None:
    """Curves of one effect in the unit that its magnitudes are shown in."""
    si = effects()[name].unit
    unit = SHOWN.get(si, si)
    for experiment in dict.fromkeys(one["experiment"] for one in power):
        part = [one for one in power if one["experiment"] == experiment]
        sizes = [_size(one["magnitude"], unit) for one in part]
        axes.plot(sizes, [one["power"] for one in part], "o-", color=BLUE, ms=3.0, lw=1.0)
        axes.axvline(_size(part[0]["planted"], unit), color=GREY, lw=0.8)
    axes.axhline(alpha, color=VERMILION, lw=0.8, ls=":")
    axes.set_xscale("log")
    axes.set_ylim(-0.03, 1.05)
    axes.set_title(name, fontsize=8.0)
    axes.set_xlabel(unit or "–", fontsize=7.5, labelpad=1.0)
    axes.xaxis.set_major_locator(MaxNLocator(3, min_n_ticks=2))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.tick_params(labelsize=7.0)


def _size(magnitude: float, unit: str) -> float:
    return abs(from_si(magnitude, unit) if unit else magnitude)
