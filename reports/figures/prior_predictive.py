"""Prior predictive: every simulation of the campaign behind the record, and both relative to their mean."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from numpy.typing import NDArray

from birdstrike.data.histories import Array
from birdstrike.reports.figures.curves import RecordCurve, draw_left_out, is_dense
from birdstrike.reports.figures.quantities import labelled, milliseconds, shown_readings, shown_span
from birdstrike.reports.figures.style import ORANGE, SKY, VERMILION, WIDE, legend_above, styled
from birdstrike.reports.figures.switches import CAMPAIGN, MARK, RECORD, look


@styled
def prior_predictive_figure(
    channel: str,
    si_unit: str,
    time: Array,
    curves: Array,
    smooth: NDArray[np.bool_],
    record: RecordCurve,
    outside: NDArray[np.bool_],
) -> Figure:
    """`curves` (n, m) SI at `time` (m,) s, `smooth` (n,); the record of r instants, its points `outside` (r,)."""
    figure = Figure(figsize=(WIDE, 5.4), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(1.7, 1))
    start, end = shown_span(record.time, float(time[-1]))
    seen = (time >= start) & (time <= end)
    time, curves = time[seen], curves[:, seen]
    mean = curves[smooth if smooth.any() else slice(None)].mean(axis=0)
    at_record = np.interp(record.time, time, mean, left=np.nan, right=np.nan)
    for axes, simulated, base in ((above, curves, np.zeros(())), (below, curves - mean, at_record)):
        _simulations(axes, time, simulated, smooth, si_unit)
        _points(axes, record, base, outside, si_unit)
    unit = shown_readings(np.zeros(1), si_unit)[1]
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
    axes.set_ylabel(labelled(channel, shown_readings(np.zeros(1), si_unit)[1]))
    axes.set_xlabel("Time of the simulation [ms]")
    legend_above(axes, columns=4)
    return figure


def _simulations(axes: Axes, time: Array, curves: Array, smooth: NDArray[np.bool_], si_unit: str) -> None:
    """One thin line a simulation; those that eroded more than the smooth regime allows stand out."""
    for chosen, colour, label in ((smooth, SKY, "simulated"), (~smooth, ORANGE, "simulated, > 5 % eroded")):
        if chosen.any():
            values = shown_readings(curves[chosen], si_unit)[0]
            lines = [np.column_stack((milliseconds(time), row)) for row in values]
            gid = MARK + CAMPAIGN
            axes.add_collection(LineCollection(lines, colors=colour, linewidths=0.7, alpha=0.8, label=label, gid=gid))
    axes.autoscale_view()


def _points(axes: Axes, record: RecordCurve, base: Array, outside: NDArray[np.bool_], si_unit: str) -> None:
    """The record less `base`, (r,) or one value, SI."""
    values, at, dense = record.values - base, milliseconds(record.time), is_dense(record.values)
    shown_values, marker = shown_readings(values, si_unit)[0], "" if dense else "o"
    axes.plot(at, shown_values, lw=0.8, marker=marker, markersize=4.5, mfc="white", label=record.label, **look(RECORD))
    if record.left_out is not None:
        draw_left_out(axes, at, shown_readings(record.left_out - base, si_unit)[0], dense)
    if outside.any():
        label = f"outside all simulations ({int(outside.sum())} of {int(np.isfinite(values).sum())})"
        axes.plot(at[outside], shown_values[outside], "o", color=VERMILION, ms=4.5, label=label, gid=MARK + RECORD)
