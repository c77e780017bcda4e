"""Prior predictive: every simulation of the campaign behind the record, and both relative to their mean."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from numpy.typing import NDArray

from birdstrike.data.histories import Array
from birdstrike.reports.figures.curves import is_dense
from birdstrike.reports.figures.quantities import labelled, milliseconds, shown, shown_span
from birdstrike.reports.figures.style import ORANGE, SKY, VERMILION, WIDE, legend_above, styled
from birdstrike.reports.figures.switches import CAMPAIGN, MARK, RECORD, look


@styled
def prior_predictive_figure(
    channel: str,
    si_unit: str,
    time: Array,
    curves: Array,
    smooth: NDArray[np.bool_],
    record_time: Array,
    record: Array,
    outside: NDArray[np.bool_],
    record_label: str,
) -> Figure:
    """`curves` (n, m) SI at `time` (m,) s, `smooth` (n,); the record (r,) SI, its points `outside` (r,)."""
    figure = Figure(figsize=(WIDE, 5.4), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(1.7, 1))
    start, end = shown_span(record_time)
    seen = (time >= start) & (time <= end)
    time, curves = time[seen], curves[:, seen]
    mean = curves[smooth if smooth.any() else slice(None)].mean(axis=0)
    at_record = np.interp(record_time, time, mean, left=np.nan, right=np.nan)
    for axes, simulated, points in ((above, curves, record), (below, curves - mean, record - at_record)):
        _simulations(axes, time, simulated, smooth, si_unit)
        _points(axes, record_time, points, outside, si_unit, record_label)
    unit = shown(np.zeros(1), si_unit)[1]
    above.set_ylabel(labelled(channel, unit))
    below.set_ylabel(labelled("off the mean", unit))
    below.set_xlabel("Time on the record's clock [ms]")
    below.set_xlim(*milliseconds(np.array([start, end])))
    legend_above(above, columns=4)
    return figure


@styled
def campaign_figure(channel: str, si_unit: str, time: Array, curves: Array, smooth: NDArray[np.bool_]) -> Figure:
    """`curves` (n, m) SI at `time` (m,) s, `smooth` (n,): the simulations alone."""
    figure = Figure(figsize=(WIDE, 3.4), layout="constrained")
    axes = figure.subplots()
    _simulations(axes, time, curves, smooth, si_unit)
    axes.set_ylabel(labelled(channel, shown(np.zeros(1), si_unit)[1]))
    axes.set_xlabel("Time of the simulation [ms]")
    legend_above(axes, columns=4)
    return figure


def _simulations(axes: Axes, time: Array, curves: Array, smooth: NDArray[np.bool_], si_unit: str) -> None:
    """One thin line a simulation; those that eroded more than the smooth regime allows stand out."""
    for chosen, colour, label in ((smooth, SKY, "simulated"), (~smooth, ORANGE, "simulated, > 5 % eroded")):
        if chosen.any():
            values = shown(curves[chosen], si_unit)[0]
            lines = [np.column_stack((milliseconds(time), row)) for row in values]
            gid = MARK + CAMPAIGN
            axes.add_collection(LineCollection(lines, colors=colour, linewidths=0.7, alpha=0.8, label=label, gid=gid))
    axes.autoscale_view()


def _points(axes: Axes, time: Array, values: Array, outside: NDArray[np.bool_], si_unit: str, label: str) -> None:
    shown_values, at = shown(values, si_unit)[0], milliseconds(time)
    marker = "" if is_dense(values) else "o"
    axes.plot(at, shown_values, lw=0.8, marker=marker, markersize=4.5, mfc="white", label=label, **look(RECORD))
    if outside.any():
        label = f"outside all simulations ({int(outside.sum())} of {int(np.isfinite(values).sum())})"
        axes.plot(at[outside], shown_values[outside], "o", color=VERMILION, ms=4.5, label=label, gid=MARK + RECORD)
