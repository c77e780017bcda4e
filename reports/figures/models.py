"""The bird models side by side in one sensor: curves with the record, the residuals or the impulse below."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.ndimage import uniform_filter1d

from birdstrike.data.histories import Array
from birdstrike.reports.figures.curves import RecordCurve, draw_record, is_dense, noise_band
from birdstrike.reports.figures.quantities import labelled, milliseconds, residual_label, shown_readings
from birdstrike.reports.figures.style import BLACK, WIDE, legend_above, styled
from birdstrike.reports.figures.switches import look

RUNNING = 1e-4  # s: forces of a bird of particles are rough, the plate answers to their mean


@dataclass(frozen=True)
class ModelCurve:
    """One model's curve: switch and title; `time` (n,) s on the record's clock, `values` (n,) SI.

    at_record: (m,) SI at the record's instants, None without a record; impulse: (n,) N s, None for what is no force;
    leading: drawn heavier.
    """

    key: str
    title: str
    time: Array
    values: Array
    at_record: Array | None = None
    impulse: Array | None = None
    leading: bool = False


@styled
def models_figure(
    channel: str,
    si_unit: str,
    models: Sequence[ModelCurve],
    record: RecordCurve | None,
    momentum: float,
    span: tuple[float, float],
) -> Figure:
    """One panel of curves, one of residuals where there is a record, one of impulse where the sensor is a force.

    momentum: the bird's, normal to the plate [N s]; span: shown, of the record's clock [s].
    """
    has_impulse = any(model.impulse is not None for model in models)
    ratios = [2.2, *([1.0] if record is not None else []), *([1.15] if has_impulse else [])]
    figure = Figure(figsize=(WIDE, 1.0 + 1.42 * sum(ratios)), layout="constrained")
    panels = list(figure.subplots(len(ratios), 1, sharex=True, height_ratios=ratios, squeeze=False)[:, 0])
    _curves(panels[0], channel, si_unit, models, record, span)
    if record is not None:
        _residuals(panels[1], models, record, si_unit)
    if has_impulse:
        _impulses(panels[-1], models, momentum, span)
    panels[-1].set_xlabel(f"Time on the {'record' if record is not None else 'simulation'}'s clock [ms]")
    panels[-1].set_xlim(*milliseconds(np.asarray(span)))
    legend_above(panels[0], columns=3)
    return figure


def _curves(
    axes: Axes,
    channel: str,
    si_unit: str,
    models: Sequence[ModelCurve],
    record: RecordCurve | None,
    span: tuple[float, float],
) -> None:
    if record is not None:
        draw_record(axes, record, si_unit, span[1])
    for model in models:
        seen = (model.time >= span[0]) & (model.time <= span[1])
        values, at = shown_readings(model.values, si_unit)[0], milliseconds(model.time[seen])
        bold = running_mean(model.time, values) if model.impulse is not None else values
        wide = 2.2 if model.leading else 1.5
        axes.plot(at, bold[seen], lw=wide, label=f"simulated, {model.title}", **look(model.key))
        if model.impulse is not None:
            axes.plot(at, values[seen], **{**look(model.key), "linestyle": "-"}, lw=0.6, alpha=0.35, zorder=1)
    axes.set_ylabel(labelled(channel, shown_readings(np.zeros(1), si_unit)[1]))
    axes.margins(y=0.08)


def running_mean(time: Array, values: Array) -> Array:
    """Values (n,) at equal steps averaged over RUNNING about each instant, centred, so that nothing is delayed."""
    half = round(0.5 * RUNNING / float(time[1] - time[0]))
    return uniform_filter1d(values, 2 * half + 1, mode="nearest")


def _residuals(axes: Axes, models: Sequence[ModelCurve], record: RecordCurve, si_unit: str) -> None:
    marker = "" if is_dense(record.values) else "."
    for model in models:
        if model.at_record is not None:
            residual = shown_readings(model.at_record - record.values, si_unit)[0]
            axes.plot(
                milliseconds(record.time)[record.read], residual[record.read], lw=1.1, marker=marker, **look(model.key)
            )
    noise_band(axes, record.time, record.sigma, si_unit)
    axes.set_ylabel(residual_label(shown_readings(np.zeros(1), si_unit)[1]))


def _impulses(axes: Axes, models: Sequence[ModelCurve], momentum: float, span: tuple[float, float]) -> None:
    """Each model's impulse and a dotted line at the bird's normal momentum."""
    for model in models:
        if model.impulse is not None:
            seen = (model.time >= span[0]) & (model.time <= span[1])
            axes.plot(milliseconds(model.time[seen]), model.impulse[seen], **look(model.key))
    axes.axhline(momentum, color=BLACK, linewidth=1.0, linestyle=":")
    words = {"xycoords": ("axes fraction", "data"), "textcoords": "offset points", "fontsize": 8}
    axes.annotate(f"bird's normal momentum {momentum:.1f} N s", xy=(0.0, momentum), xytext=(4, 3), **words)
    axes.margins(y=0.16)
    axes.set_ylabel("Impulse [N s]")
