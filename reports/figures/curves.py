"""Measured against verified: the curves with their peaks, and below them the residuals with the noise band."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from birdstrike.data.histories import Array
from birdstrike.reports.figures.quantities import (
    labelled,
    milliseconds,
    quantity,
    reading,
    residual_label,
    shown_readings,
    shown_span,
)
from birdstrike.reports.figures.style import BLACK, METHOD_MARKERS, WIDE, legend_above, styled
from birdstrike.reports.figures.switches import MARK, RECORD, look

LEFT_OUT = "record, left out of the fit"
LIGHT = "#9C9C9C"
LATE = 0.6
"""Share of the axes' end from which on a peak's value stands before its drop line: behind it, it leaves the axes."""


@dataclass(frozen=True)
class VerifiedCurve:
    """One method's verification run: `time` (n,) s on the record's clock, `values` (n,) SI, `at_record` (m,) SI."""

    time: Array
    values: Array
    at_record: Array


@dataclass(frozen=True)
class RecordCurve:
    """A record's channel: `time` (m,) s, `values` (m,) SI with NaN in gaps, `sigma` (m,) SI or None, its label.

    left_out: (m,) SI, the readings that the fit left out, NaN elsewhere; clipped: time [s] and value, SI, at which the
    sensor stood at its end, where that hides the record's peak.
    """

    time: Array
    values: Array
    sigma: Array | None
    label: str
    left_out: Array | None = None
    clipped: tuple[float, float] | None = None

    @property
    def peak(self) -> tuple[float, float]:
        """Time [s] and value, SI, of the largest reading that was used, or where the sensor stood at its end."""
        top = int(np.nanargmax(np.abs(self.values)))
        return self.clipped or (float(self.time[top]), float(self.values[top]))

    @property
    def read(self) -> NDArray[np.bool_]:
        """(m,) True where the channel has a reading, used or left out."""
        return np.isfinite(self.values) | (False if self.left_out is None else np.isfinite(self.left_out))


@styled
def comparison_figure(channel: str, si_unit: str, record: RecordCurve, verified: Mapping[str, VerifiedCurve]) -> Figure:
    """`verified`: method -> its run."""
    figure = Figure(figsize=(WIDE, 5.4), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(2.6, 1))
    span = shown_span(record.time, max((float(one.time[-1]) for one in verified.values()), default=np.inf))
    draw_record(above, record, si_unit, span[1])
    for method, curve in verified.items():
        _simulated(above, method, curve, si_unit, span, -1.0 if record.peak[1] < 0.0 else 1.0)
        _residual(below, method, record.time, curve.at_record - record.values, si_unit)
    noise_band(below, record.time, record.sigma, si_unit)
    _frame(above, below, channel, si_unit, span)
    return figure


def draw_record(axes: Axes, record: RecordCurve, si_unit: str, until: float) -> None:
    """Points for a sparse record, a line for a dense one; bars of two standard deviations where they are known.

    Readings that the fit left out are light, and have an entry of their own in the legend. until: end of the axes [s].
    """
    values = shown_readings(record.values, si_unit)[0]
    dense, at = is_dense(record.values), milliseconds(record.time)
    points = {"linestyle": "-" if dense else "none", "marker": "" if dense else "o", "label": record.label}
    axes.plot(at, values, lw=1.1, markersize=5.5, markerfacecolor="white", zorder=5, **{**look(RECORD), **points})
    if record.left_out is not None:
        draw_left_out(axes, at, shown_readings(record.left_out, si_unit)[0], dense)
    if record.sigma is not None and not dense:
        bars = 2 * shown_readings(record.sigma, si_unit)[0]
        drawn = axes.errorbar(at, values, bars, fmt="none", ecolor=BLACK, elinewidth=0.8)
        for part in drawn.lines[2]:
            part.set_gid(MARK + RECORD)
    _mark_peak(axes, record, si_unit, until)


def draw_left_out(axes: Axes, at: Array, values: Array, dense: bool) -> None:
    """Stretches of left-out readings (m,) at `at` (m,) [ms] as light lines, single ones as light open circles."""
    given = np.isfinite(values)
    beside = np.pad(given, 1)
    single = given & ~(beside[:-2] | beside[2:]) if dense else given
    style = {"color": LIGHT, "gid": MARK + RECORD, "zorder": 4}
    label = LEFT_OUT
    if (given & ~single).any():
        axes.plot(at, np.where(single, np.nan, values), lw=1.6, label=label, **style)
        label = ""
    if single.any():
        axes.plot(at[single], values[single], "o", ms=4.0, mfc="white", label=label, **style)


def is_dense(record: Array) -> bool:
    """Whether a record (m,), NaN in gaps, has too many points to be drawn one by one."""
    return int(np.isfinite(record).sum()) > 80


def _simulated(
    axes: Axes, method: str, curve: VerifiedCurve, si_unit: str, span: tuple[float, float], side: float
) -> None:
    """The curve over the span that is shown, with a triangle on its peak on the record's side of 0 (1 or -1)."""
    seen = (curve.time >= span[0]) & (curve.time <= span[1])
    values, at = shown_readings(curve.values[seen], si_unit)[0], milliseconds(curve.time[seen])
    label = f"simulated: verification of the {method}"
    axes.plot(at, values, label=label, **look(method))
    top = int(np.nanargmax(side * values))
    axes.plot(at[top], values[top], marker="v", markersize=6, zorder=6, **look(method))


def _mark_peak(axes: Axes, record: RecordCurve, si_unit: str, until: float) -> None:
    """A drop line to the time axis and the peak's value beside it, clear of the curve and within the axes."""
    time, value = record.peak
    at, top = float(milliseconds(np.asarray(time))), float(shown_readings(np.asarray(value), si_unit)[0])
    mark = MARK + RECORD
    side, to = (1, "left") if time < LATE * until else (-1, "right")
    axes.vlines(at, 0.0, top, color=BLACK, linewidth=0.7, linestyle=":", gid=mark)
    size, when, beyond = reading(value, si_unit), quantity(time, "s"), "≥" if value > 0.0 else "≤"
    axes.annotate(
        f"peak {beyond} {size}, clipped from {when} on" if record.clipped else f"peak {size} at {when}",
        xy=(at, 0.0),
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
        shown_readings(residual, si_unit)[0],
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
    band = 2 * shown_readings(sigma, si_unit)[0]
    axes.fill_between(milliseconds(time), -band, band, color="#E2E2E2", linewidth=0, zorder=0)
    axes.text(1.0, 1.02, "grey: ±2σ of the noise", transform=axes.transAxes, ha="right", va="bottom", fontsize=8)


def _frame(above: Axes, below: Axes, channel: str, si_unit: str, span: tuple[float, float]) -> None:
    unit = shown_readings(np.zeros(1), si_unit)[1]
    above.set_ylabel(labelled(channel, unit))
    below.set_ylabel(residual_label(unit))
    below.set_xlabel("Time on the record's clock [ms]")
    below.set_xlim(*milliseconds(np.asarray(span)))
    above.margins(y=0.08)
    legend_above(above, columns=3)
