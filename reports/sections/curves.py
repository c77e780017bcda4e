"""The record against the verification runs, and the campaign's cloud behind it."""

from __future__ import annotations

import numpy as np

from data.histories import Array
from reports.blocks import Picture, Section, drawing
from reports.figures.cloud import cloud_figure
from reports.figures.comparison import VerifiedCurve, comparison_figure
from reports.figures.quantities import quantity, words
from reports.findings import cloud_text, error_text, offset_text
from reports.record import cloud, largest_miss, origin, peak
from reports.results import Method, Results


def section(results: Results) -> Section:
    """One comparison and one cloud for every channel of the record."""
    blocks = [make(results, channel) for channel in results.channels for make in (_comparison, _cloud)]
    return Section("curves", f"Record ({origin(results.measured)}) and simulated curves", tuple(blocks))


def _comparison(results: Results, channel: str) -> Picture:
    time, values = results.measured.points(channel)
    unit = results.measured.units[channel]
    verified = {name: _verified(method, channel) for name, method in results.methods.items()}
    label = f"record, {origin(results.measured)}"
    figure = comparison_figure(channel, unit, time, values, noise(results, channel), label, verified)
    return drawing(f"comparison-{channel}", figure, _comparison_caption(results, channel))


def _verified(method: Method, channel: str) -> VerifiedCurve:
    history = method.verification
    return VerifiedCurve(history.time + method.time_offset, history.channels[channel], method.at_record[channel])


def noise(results: Results, channel: str) -> Array | None:
    """Standard deviation (r,) SI at the record's points: from its own column, else from the case; None if unknown."""
    if channel in results.measured.sigma:
        return results.measured.sigma[channel][~np.isnan(results.measured.channels[channel])]
    sensor = results.case.sensors.get(channel)
    if sensor is None or sensor.noise is None:
        return None
    return np.full(results.measured.points(channel)[0].size, sensor.noise)


def _comparison_caption(results: Results, channel: str) -> str:
    time, values = results.measured.points(channel)
    unit = results.measured.units[channel]
    at, top = peak(time, values)
    parts = [f"The record ({origin(results.measured)}) peaks at {quantity(top, unit)}, {quantity(at, 's')}."]
    for method in results.methods.values():
        miss = largest_miss(results, channel, method.name)
        if len(results.channels) == 1:
            parts.append(f"{method.name.capitalize()}: {error_text(results, method)}, {offset_text(method)};")
        parts.append(f"largest residual of the {method.name} {quantity(miss.residual, unit)} at {quantity(miss.time, 's')}.")
    known = "The grey band is two standard deviations of the record's noise."
    unknown = "The record's noise is not known, so no band is drawn."
    below = "Below: residual, simulated minus record; triangles mark the simulated peaks."
    return " ".join([*parts, below, unknown if noise(results, channel) is None else known])


def _cloud(results: Results, channel: str) -> Picture:
    seen, dataset = cloud(results, channel), results.dataset
    offset = results.methods[results.best].time_offset
    figure = cloud_figure(
        channel,
        results.measured.units[channel],
        dataset.time + offset,
        dataset.curves[channel],
        dataset.smooth,
        seen.time,
        seen.values,
        seen.outside,
        f"record, {origin(results.measured)}",
    )
    eroded = int((~dataset.smooth).sum())
    caption = (
        f"The campaign: {len(dataset.runs)} simulated strikes over the parameter ranges"
        + (f", {eroded} of them lost more than 5 % of the bird (orange, not counted as cloud)" if eroded else "")
        + f"; {cloud_text(results, channel)}. Below: {words(channel)} less the mean of the strikes. "
        + "A record outside the cloud cannot be reached by any choice of these parameters alone."
    )
    return drawing(f"cloud-{channel}", figure, caption)
