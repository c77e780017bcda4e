"""The posterior as a corner plot, and Sobol indices over time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure

from birdstrike.data.histories import Array
from birdstrike.reports.figures.quantities import labelled, milliseconds, shown, symbol
from birdstrike.reports.figures.style import BLUE, GREEN, ORANGE, PURPLE, SKY, VERMILION, WIDE, legend_above, styled

BINS = 30
COLOURS = (BLUE, VERMILION, GREEN, ORANGE, PURPLE, SKY)


@styled
def corner_figure(draws: Mapping[str, Array], units: Mapping[str, str], best: Mapping[str, float]) -> Figure:
    """Histograms of every parameter and of every pair; draws: name -> (n,) SI; best: the most probable point, SI."""
    names = list(draws)
    figure = Figure(figsize=(WIDE, WIDE * 0.75), layout="constrained")
    grid = np.atleast_2d(figure.subplots(len(names), len(names)))
    values = {name: shown(draws[name], units[name]) for name in names}
    points = {name: float(shown(np.array(best[name]), units[name])[0]) for name in names}
    for i, row in enumerate(names):
        for j, column in enumerate(names):
            axes = grid[i, j]
            axes.grid(False)
            axes.tick_params(labelsize=7, labelleft=j == 0 < i, labelbottom=i == len(names) - 1)
            if j > i:
                axes.set_axis_off()
            elif i == j:
                axes.hist(values[row][0], BINS, color=SKY)
                axes.axvline(points[row], color=VERMILION, linewidth=1.0)
                axes.set_yticks([])
            else:
                axes.hist2d(values[column][0], values[row][0], BINS, cmap="Blues")
                axes.plot(points[column], points[row], "+", color=VERMILION)
            if i == len(names) - 1:
                axes.set_xlabel(labelled(symbol(column), values[column][1]), fontsize=8)
            if j == 0 < i:
                axes.set_ylabel(labelled(symbol(row), values[row][1]), fontsize=8)
    return figure


@styled
def sobol_figure(times: Sequence[float], total: Mapping[str, Sequence[float | None]]) -> Figure:
    """Total Sobol index of every parameter over time [s]; gaps where the curve does not vary."""
    figure = Figure(figsize=(7.0, 2.8), layout="constrained")
    axes = figure.subplots()
    for number, (name, values) in enumerate(total.items()):
        line = np.array([np.nan if value is None else value for value in values])
        axes.plot(milliseconds(np.array(times)), line, color=COLOURS[number % len(COLOURS)], label=symbol(name))
    axes.set_xlabel("Time [ms]")
    axes.set_ylabel("Total Sobol index [–]")
    axes.set_ylim(-0.03, 1.08)
    legend_above(axes)
    return figure
