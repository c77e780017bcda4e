"""The design seen two parameters at a time: do the simulations fill the box, or lie on a line?"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from birdstrike.data.histories import Array
from birdstrike.doe.designs.space import ParameterSpace
from birdstrike.reports.figures.quantities import labelled, shown
from birdstrike.reports.figures.style import BLUE, GREY, VERMILION, styled

AIR = 0.06  # of a range, beyond its ends


@styled
def design_figure(
    names: Sequence[str],
    space: ParameterSpace,
    values: Array,
    held_out: NDArray[np.bool_],
    limits: Mapping[int, float],
) -> Figure:
    """`values` (n, k) SI in the box of `space`, each axis in the scale of its range; names: labels of the axes.

    held_out: (n,) bool; limits: column -> activity limit SI.
    """
    k, units = len(names), space.units
    figure = Figure(figsize=(7.0, 1.9 * max(k - 1, 1) + 0.7), layout="constrained")
    grid = figure.subplots(max(k - 1, 1), max(k - 1, 1), sharex="col", sharey="row", squeeze=False)
    for row in range(1, k):
        for column in range(k - 1):
            axes = grid[row - 1, column]
            if column >= row:
                axes.remove()
                continue
            _projection(axes, values[:, [column, row]], (units[column], units[row]), held_out)
            _box(axes, space, (column, row), limits)
            if column == 0:
                axes.set_ylabel(labelled(names[row], shown(space.lows, units[row])[1]))
            if row == k - 1:
                axes.set_xlabel(labelled(names[column], shown(space.lows, units[column])[1]))
    _legend(figure, grid[0, 0], bool(limits))
    return figure


def _projection(axes: Axes, pair: Array, units: tuple[str, str], held_out: NDArray[np.bool_]) -> None:
    x, y = shown(pair[:, 0], units[0])[0], shown(pair[:, 1], units[1])[0]
    axes.plot(x[~held_out], y[~held_out], "o", color=BLUE, markersize=4, label="training run")
    if held_out.any():
        axes.plot(x[held_out], y[held_out], "s", color=VERMILION, mfc="white", markersize=4.5, label="held-out run")


def _box(axes: Axes, space: ParameterSpace, columns: tuple[int, int], limits: Mapping[int, float]) -> None:
    """The parameter box with a little air, and dashed lines where a parameter stops to act."""
    ends = space.to_physical(np.array([[-AIR], [1.0 + AIR]]))
    for which, column in enumerate(columns):
        unit = space.units[column]
        low, high = shown(ends[:, column], unit)[0]
        if space.logarithmic[column]:  # symlog also draws a range below 0
            set_scale = axes.set_xscale if which == 0 else axes.set_yscale
            set_scale("symlog", linthresh=min(abs(low), abs(high)))
        (axes.set_xlim if which == 0 else axes.set_ylim)(low, high)
        if column in limits:
            at = float(shown(np.asarray(limits[column]), unit)[0])
            (axes.axvline if which == 0 else axes.axhline)(at, color=GREY, linewidth=1.0, linestyle="--")


def _legend(figure: Figure, first: Axes, with_limits: bool) -> None:
    """In the empty upper triangle of the grid; of two parameters, whose grid has none, above it."""
    handles, labels = first.get_legend_handles_labels()
    if with_limits:
        handles.append(first.plot([], [], color=GREY, linestyle="--", linewidth=1.0)[0])
        labels.append("limit of activity")
    if len(figure.axes) == 1:
        figure.legend(handles, labels, loc="outside upper left", ncols=len(labels))
    else:
        figure.legend(handles, labels, loc="upper right", bbox_to_anchor=(0.98, 0.98))
