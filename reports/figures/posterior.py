"""The posterior as a corner plot, and Sobol indices over time."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, MaxNLocator, NullLocator

from birdstrike.data.histories import Array
from birdstrike.reports.figures.quantities import labelled, milliseconds, shown, symbol
from birdstrike.reports.figures.style import BLUE, GREEN, ORANGE, PURPLE, SKY, VERMILION, WIDE, legend_above, styled

BINS = 30
LEFT, BELOW, EDGE, GAP = 0.75, 0.5, 0.1, 0.12
"""Room for the labels, at the other edges and between the panels of the corner plot [in]."""
COLOURS = (BLUE, VERMILION, GREEN, ORANGE, PURPLE, SKY)
DASHES = ("-", "--", "-.", ":")
"""Of the parameters in turn: their lines stay apart in a black-and-white print."""


@styled
def corner_figure(
    draws: Mapping[str, Array], units: Mapping[str, str], best: Mapping[str, float], logarithmic: Collection[str] = ()
) -> Figure:
    """Histograms of every parameter and of every pair; draws: name -> (n,) SI; best: the most probable point, SI;
    logarithmic: names drawn in their logarithm."""
    names = list(draws)
    figure, grid = _triangle(len(names))
    values = {name: shown(draws[name], units[name]) for name in names}
    points = {name: float(shown(np.array(best[name]), units[name])[0]) for name in names}
    edges = {name: _edges(values[name][0], name in logarithmic) for name in names}
    for i, row in enumerate(names):
        for j, column in enumerate(names[: i + 1]):
            axes = grid[i, j]
            axes.grid(False)
            axes.tick_params(labelsize=7)
            axes.xaxis.set_major_locator(MaxNLocator(4) if i == len(names) - 1 else NullLocator())
            axes.yaxis.set_major_locator(MaxNLocator(4) if j == 0 < i else NullLocator())
            if column in logarithmic:
                _logarithmic(axes, "x", edges[column], i == len(names) - 1)
            if row in logarithmic and i != j:
                _logarithmic(axes, "y", edges[row], j == 0)
            if i == j:
                axes.hist(values[row][0], edges[row].tolist(), color=SKY)
                axes.axvline(points[row], color=VERMILION, linewidth=1.0)
            else:
                axes.hist2d(values[column][0], values[row][0], [edges[column], edges[row]], cmap="Blues")
                axes.plot(points[column], points[row], "+", color=VERMILION)
            if i == len(names) - 1:
                axes.set_xlabel(labelled(symbol(column, names), values[column][1]), fontsize=8)
            if j == 0 < i:
                axes.set_ylabel(labelled(symbol(row, names), values[row][1]), fontsize=8)
                axes.yaxis.set_label_coords(-0.42, 0.5)
    return figure


def _edges(values: Array, logarithmic: bool) -> Array:
    """(BINS + 1,) edges of equal bins of the values, or of their logarithms."""
    spread = np.geomspace if logarithmic else np.linspace
    return spread(values.min(), values.max(), BINS + 1)


def _logarithmic(axes: Axes, which: Literal["x", "y"], edges: Array, ticks: bool) -> None:
    """An axis in the logarithm of values on one side of 0, with or without ticks."""
    (axes.set_xscale if which == "x" else axes.set_yscale)("symlog", linthresh=float(np.abs(edges).min()))
    axis = axes.xaxis if which == "x" else axes.yaxis
    axis.set_minor_locator(NullLocator())
    if ticks:
        axis.set_major_locator(FixedLocator(edges[[0, BINS // 2, BINS]].tolist()))
        axis.set_major_formatter(lambda value, _: f"{value:.3g}")
    else:
        axis.set_major_locator(NullLocator())


def _triangle(count: int) -> tuple[Figure, Mapping[tuple[int, int], Axes]]:
    """Axes (row, column) on and below the diagonal, of fixed size: no layout has to be searched for."""
    width, height = WIDE, 0.75 * WIDE
    wide, tall = ((size - GAP * (count - 1)) / count for size in (width - LEFT - EDGE, height - BELOW - EDGE))
    figure = Figure(figsize=(width, height))
    return figure, {
        (row, column): figure.add_axes(
            (
                (LEFT + column * (wide + GAP)) / width,
                (BELOW + (count - 1 - row) * (tall + GAP)) / height,
                wide / width,
                tall / height,
            )
        )
        for row in range(count)
        for column in range(row + 1)
    }


@styled
def sobol_figure(times: Sequence[float], total: Mapping[str, Sequence[float | None]]) -> Figure:
    """Total Sobol index of every parameter over time [s]; gaps where the curve does not vary."""
    figure = Figure(figsize=(7.0, 2.8), layout="constrained")
    axes, top = figure.subplots(), 1.08
    for number, (name, values) in enumerate(total.items()):
        line = np.array([np.nan if value is None else value for value in values])
        colour, dashes = COLOURS[number % len(COLOURS)], DASHES[number % len(DASHES)]
        axes.plot(milliseconds(np.array(times)), line, color=colour, linestyle=dashes, label=symbol(name, total))
        top = max(top, 1.04 * float(np.nanmax(line, initial=0.0)))
    axes.set_xlabel("Time [ms]")
    axes.set_ylabel("Total Sobol index [–]")
    axes.set_ylim(-0.03, top)
    legend_above(axes)
    return figure
