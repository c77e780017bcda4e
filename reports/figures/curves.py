"""Measured against verified: the curves with their peaks, and below them the residuals with the noise band."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from birdstrike.data.histories import Array
from birdstrike.reports.figures.quantities import labelled, milliseconds, residual_label, shown, shown_span, significant
from birdstrike.reports.figures.style import BLACK, METHOD_MARKERS, WIDE, legend_above, styled
from birdstrike.reports.figures.switches import MARK, RECORD, look

LATE = 0.7
"""Share of the record's end from which on a peak's value stands before its drop line: behind it, it leaves the axes."""


@dataclass(frozen=True)
class VerifiedCurve:
    """One method's verification run: `time` (n,) s on the record's clock, `values` (n,) SI, `at_record` (m,) SI."""

    time: Array
    values: Array
    at_record: Array


@styled
def comparison_figure(
    channel: str,
    si_unit: str,
    time: Array,
    record: Array,
    sigma: Array | None,
    record_label: str,
    verified: Mapping[str, VerifiedCurve],
) -> Figure:
    """`time` (m,) s, `record` (m,) SI with NaN in gaps, `sigma` (m,) SI or None; `verified`: method -> its run."""
    figure = Figure(figsize=(WIDE, 5.4), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(2.6, 1))
    draw_record(above, time, record, sigma, si_unit, record_label)
    for method, curve in verified.items():
        _simulated(above, method, curve, si_unit, shown_span(time))
        _residual(below, method, time, curve.at_record - record, si_unit)
    noise_band(below, time, sigma, si_unit)
    _frame(above, below, channel, si_unit, time)
    return figure


def draw_record(axes: Axes, time: Array, record: Array, sigma: Array | None, si_unit: str, label: str) -> None:
    """Points for a sparse record, a line for a dense one; bars of two standard deviations where they are known."""
    values, unit = shown(record, si_unit)
    dense = is_dense(record)
    at = milliseconds(time)
    style = {**look(RECORD), "linestyle": "-" if dense else "none", "marker": "" if dense else "o", "label": label}
    axes.plot(at, values, lw=1.1, markersize=5.5, markerfacecolor="white", zorder=5, **style)
    if sigma is not None and not dense:
        bars = 2 * shown(sigma, si_unit)[0]
        drawn = axes.errorbar(at, values, bars, fmt="none", ecolor=BLACK, elinewidth=0.8)
        for part in drawn.lines[2]:
            part.set_gid(MARK + RECORD)
    _mark_peak(axes, at, values, unit)


def is_dense(record: Array) -> bool:
    """Whether a record (m,), NaN in gaps, has too many points to be drawn one by one."""
    return int(np.isfinite(record).sum()) > 80


def _simulated(axes: Axes, method: str, curve: VerifiedCurve, si_unit: str, span: tuple[float, float]) -> None:
    """The curve over the span that is shown, with a triangle on its peak."""
    seen = (curve.time >= span[0]) & (curve.time <= span[1])
    values, at = shown(curve.values[seen], si_unit)[0], milliseconds(curve.time[seen])
    label = f"simulated: verification of the {method}"
    axes.plot(at, values, label=label, **look(method))
    top = int(np.nanargmax(np.abs(values)))
    axes.plot(at[top], values[top], marker="v", markersize=6, zorder=6, **look(method))


def _mark_peak(axes: Axes, time: Array, values: Array, unit: str) -> None:
    """A drop line to the time axis and the peak's value beside it, clear of the curve and within the axes."""
    top = int(np.nanargmax(np.abs(values)))
    mark = MARK + RECORD
    side, to = (1, "left") if time[top] < LATE * time[-1] else (-1, "right")
    axes.vlines(time[top], 0.0, values[top], color=BLACK, linewidth=0.7, linestyle=":", gid=mark)
    axes.annotate(
        f"peak {f'{significant(float(values[top]))} {unit}'.rstrip()} at {significant(float(time[top]))} ms",
        xy=(time[top], 0.0),
        xytext=(5 * side, 5),
        textcoords="offset points",
        horizontalalignment=to,
        fontsize=8,
        gid=mark,
        path_effects=[withStroke(linewidth=2.5, foreground="white")],  # curves may cross it
    )


def _residual(axes: Axes, method: str, time: Array, residual: Array, si_unit: str) -> None:
    marker = "" if is_dense(residual) else METHOD_MARKERS[method]
    axes.plot(
        milliseconds(time),
        shown(residual, si_unit)[0],
        linewidth=1.1,
        marker=marker,
        markersize=4,
        **look(method),
    )


def noise_band(axes: Axes, time: Array, sigma: Array | None, si_unit: str) -> None:
    """Two standard deviations of the record's noise: residuals inside it say nothing."""
    axes.axhline(0.0, color=BLACK, linewidth=0.7)
    if sigma is None:
        return
    band = 2 * shown(sigma, si_unit)[0]
    axes.fill_between(milliseconds(time), -band, band, color="#E2E2E2", linewidth=0, zorder=0)
    axes.text(1.0, 1.02, "grey: ±2σ of the noise", transform=axes.transAxes, ha="right", va="bottom", fontsize=8)


def _frame(above: Axes, below: Axes, channel: str, si_unit: str, time: Array) -> None:
    unit = shown(np.zeros(1), si_unit)[1]
    above.set_ylabel(labelled(channel, unit))
    below.set_ylabel(residual_label(unit))
    below.set_xlabel("Time on the record's clock [ms]")
    below.set_xlim(*milliseconds(np.asarray(shown_span(time))))
    above.margins(y=0.08)
    legend_above(above, columns=3)
