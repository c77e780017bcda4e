"""The record against the verification runs, and the campaign's simulations behind it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from birdstrike.data.curves import Measured
from birdstrike.data.histories import Array
from birdstrike.inversion.observations.reader import HELD
from birdstrike.inversion.results.ingredients import MeasuredFigures
from birdstrike.reports.blocks import Picture, Section, drawing
from birdstrike.reports.figures.curves import RecordCurve, VerifiedCurve, comparison_figure
from birdstrike.reports.figures.prior_predictive import prior_predictive_figure
from birdstrike.reports.figures.quantities import quantity, reading, words
from birdstrike.reports.results.findings import channel_error, offset_text, prior_text, worst_text
from birdstrike.reports.results.measurement import origin, origins, peak, peak_of, record_peak, record_position
from birdstrike.reports.results.results import InversionResults, Results


def section(results: Results) -> Section:
    """One comparison and one prior predictive for every channel of the record."""
    blocks = [make(results, channel) for channel in results.channels for make in (_comparison, _prior)]
    title = f"{_records(results)} and the simulated curves"
    return Section("curves", title, (*blocks, *_of_later_shots(results)))


def comparisons(results: InversionResults) -> Section:
    """The comparisons alone, where there is no campaign."""
    title = f"{_records(results)} and the verification"
    blocks = [_comparison(results, channel) for channel in results.channels]
    return Section("curves", title, (*blocks, *_of_later_shots(results)))


def _records(results: InversionResults) -> str:
    return f"The record{'s' if results.later else ''} ({origins(results.records)})"


def _of_later_shots(results: InversionResults) -> list[Picture]:
    """The same of the shots that were inverted together with the first one."""
    return [
        _comparison(one, channel, number)
        for number, one in enumerate(results.later, start=2)
        for channel in one.channels
    ]


def _comparison(results: InversionResults, channel: str, shot: int = 0) -> Picture:
    """shot: number of a later shot, by which its captions begin."""
    own, whose = (f"-shot{shot}", f"Shot {shot}, {Path(results.record.path).name}. ") if shot else ("", "")
    return drawing(
        f"comparison-{channel}{own}", comparison(results, channel), whose + _comparison_caption(results, channel)
    )


def comparison(results: InversionResults, channel: str) -> Figure:
    """The record against the verification runs, and the residuals."""
    return comparison_figure(
        channel=channel,
        si_unit=results.record.units[channel],
        record=record_curve(results, channel),
        verified={method: _verified(results, method, channel) for method in results.finished},
    )


def record_curve(results: InversionResults, channel: str) -> RecordCurve:
    """The record's points that the fit used, and lightly those that it left out, repetitions of a slow logger aside."""
    return fitted_curve(results.record, channel, results.inversion.measured, f"record, {origin(results.record)}")


def fitted_curve(record: Measured, channel: str, figures: MeasuredFigures, label: str) -> RecordCurve:
    """The same of any record above rest, whose points that a fit used `figures` tell."""
    used, top, known = (
        figures.fitted(record).channels[channel],
        peak_of(record, channel, figures),
        figures.known_noise(channel),
    )
    repeated = np.isin(record.time, figures.cut(channel, HELD))
    left_out = np.where(np.isfinite(used) | repeated, np.nan, record.channels[channel])
    return RecordCurve(
        time=record.time,
        values=used,
        sigma=None if known is None else np.full(record.time.size, known),
        label=label,
        left_out=left_out if np.isfinite(left_out).any() else None,
        clipped=(top.time, top.value) if top.clipped else None,
    )


def _verified(results: InversionResults, method: str, channel: str) -> VerifiedCurve:
    run = results.verified[method]
    return VerifiedCurve(run.time + results.offset, run.channels[channel], results.simulated[method][channel])


def noise(results: InversionResults, channel: str) -> Array | None:
    """Standard deviation (r,) SI at the record's times; None where it is only assumed."""
    known = results.inversion.measured.known_noise(channel)
    return None if known is None else np.full(results.record.time.size, known)


def _comparison_caption(results: InversionResults, channel: str) -> str:
    unit = results.record.units[channel]
    top = record_peak(results, channel)
    parts = [f"The record ({origin(results.record)}) has its peak of {top.text}."]
    for method in results.finished:
        run = results.verified[method]
        at, value = peak(run.time + results.offset, run.channels[channel], top.side)
        parts.append(
            f"{method.capitalize()} (simulated): peak {reading(value, unit)} at {quantity(at, 's')}; "
            f"{channel_error(results, method, channel)}; largest residual {worst_text(results, channel, method)}."
        )
    clocks = offset_text(results)
    parts.append(f"{clocks[0].upper()}{clocks[1:]}. Below: simulated minus record. Triangles: simulated peaks.")
    measured = results.inversion.measured
    size = f"{reading(measured.noise[channel], unit, 2)} ({measured.noise_source[channel]})"
    parts += [results.filter_text] if results.filter_text else []
    known = f"Grey band: two standard deviations of the record's noise, {size}."
    unknown = f"No noise is stated for the record, so no band is drawn; {size} was used."
    return " ".join([*parts, unknown if noise(results, channel) is None else known])


def _prior(results: Results, channel: str) -> Picture:
    dataset = results.dataset
    eroded = int((~dataset.smooth).sum())
    lost = f", of which {eroded} lost more than 5 % of the bird (orange, not smooth)" if eroded else ""
    caption = (
        f"Prior predictive: the campaign's {len(dataset.runs)} simulations over the parameters' ranges{lost}; "
        f"{prior_text(results, channel)}. Below: {words(channel)} less the mean of the simulations. "
        "No values of these parameters reach what lies far outside."
    )
    return drawing(f"prior-predictive-{channel}", prior_predictive(results, channel), caption)


def prior_predictive(results: Results, channel: str) -> Figure:
    """Every simulation of the campaign behind the record."""
    seen, dataset = record_position(results, channel), results.dataset
    return prior_predictive_figure(
        channel=channel,
        si_unit=results.record.units[channel],
        time=dataset.time + results.offset,
        curves=dataset.curves[channel],
        smooth=dataset.smooth,
        record=record_curve(results, channel),
        outside=seen.outside,
    )
