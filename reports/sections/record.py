"""The record as it was measured, and how it was read: what was cut, the reading at rest, the noise."""

from __future__ import annotations

import numpy as np

from birdstrike.data.formatting import many
from birdstrike.data.histories import Array
from birdstrike.inversion.observations.reader import OUTSIDE
from birdstrike.reports.blocks import Picture, Section, drawing
from birdstrike.reports.figures.quantities import quantity, reading, words
from birdstrike.reports.figures.record import DrawnChannel, record_figure
from birdstrike.reports.results.results import Results


def section(results: Results) -> Section:
    """One picture a channel."""
    pictures = tuple(_picture(results, channel) for channel in results.channels)
    return Section("record", "The record as it was read", pictures)


def _picture(results: Results, channel: str) -> Picture:
    drawn = _drawn(results, channel)
    return drawing(f"record-{channel}", record_figure([drawn]), _caption(results, drawn))


def _drawn(results: Results, channel: str) -> DrawnChannel:
    """The raw record: what the fit has subtracted is added again."""
    measured, time = results.inversion.measured, results.record.time
    rest = _rest(results, channel)
    values = results.record.channels[channel]
    cuts = {reason: np.array(times) for reason, times in measured.cuts.get(channel, {}).items()}
    used, cut = results.used.channels[channel], results.cut(channel, *cuts)
    # Of shots inverted together the clock has instants at which others alone were read.
    outside = np.isfinite(values) & ~np.isfinite(used) & ~np.isin(time, cut)
    cuts |= {OUTSIDE: time[outside]} if outside.any() else {}
    raw = values if rest is None else values + rest
    return DrawnChannel(
        name=channel,
        unit=results.record.units[channel],
        time=time,
        values=raw,
        cuts=cuts,
        rest=rest,
        noise=measured.noise[channel],
        source=measured.noise_source[channel],
    )


def _rest(results: Results, channel: str) -> Array | None:
    found = results.inversion.measured.at_rest.get(channel)
    return None if found is None else found.at(results.record.time)


def _caption(results: Results, drawn: DrawnChannel) -> str:
    measured = results.inversion.measured
    parts = [f"{words(drawn.name).capitalize()}: {measured.points[drawn.name]} points are used."]
    for reason, times in drawn.cuts.items():
        span = f"{quantity(float(times[0]), 's')} .. {quantity(float(times[-1]), 's')}"
        parts.append(f"{many(len(times), 'point')} left out, {reason.rstrip(',')} ({span}).")
    if (rest := measured.at_rest.get(drawn.name)) is not None:
        low, high = rest.interval_95
        parts.append(
            f"The reading at rest ({rest.kind}) was subtracted: {reading(rest.value, drawn.unit)} before contact "
            f"(95 %: {reading(low, drawn.unit, 4)} .. {reading(high, drawn.unit, 4)})."
        )
    parts.append(f"Band: two standard deviations of the noise, {reading(drawn.noise, drawn.unit, 2)} ({drawn.source}).")
    return " ".join(parts)
