"""Summary: the five findings, the warnings, and the methods side by side."""

from __future__ import annotations

import numpy as np

from birdstrike.data.units import rounded
from birdstrike.reports.blocks import Block, Lines, Paragraph, Section, Table, Warnings
from birdstrike.reports.comparison.scores import same_side
from birdstrike.reports.figures.quantities import reading, signed_quantity, words
from birdstrike.reports.results.findings import findings, percent
from birdstrike.reports.results.measurement import hidden_peaks, origin, record_peak
from birdstrike.reports.results.results import InversionResults, Results
from birdstrike.reports.sections.models import nearest


def section(results: Results) -> Section:
    """What a colleague reads when there is no time for more."""
    blocks: list[Block] = [Lines(findings(results))]
    if ranked := nearest(results):
        blocks.append(Paragraph(ranked))
    if results.warnings:
        blocks.append(Warnings(results.warnings))
    return Section("summary", "Summary", (*blocks, methods_table(results)))


def methods_table(results: InversionResults) -> Table:
    """Errors of each method's verification run, one row a method and channel."""
    unshifted = ("RMS, clocks not shifted",) if _shifted(results) else ()
    head = ("verification run", "RMS error", "of the peak", *unshifted, "predicted RMS", "peak", "peak time")
    rows = [_row(results, method, channel) for method in results.finished for channel in results.channels]
    better = f"; {_better(results)}" if len(results.finished) > 1 else ""
    caption = (
        f"Simulated verification runs against the record ({origin(results.record)}){better}. Predicted: the RMS error "
        "that the emulator expected at that answer, before the solver was re-run. Peak and its time: simulated against "
        f"record, both at the record's instants{hidden_peaks(results)}."
    )
    return Table(head, tuple(rows), caption, frozenset(range(1, len(head))))


def _better(results: InversionResults) -> str:
    """`the emulator is the better verified: its error is 2.3 over noise, the network's 3.4`."""
    methods, told = results.inversion.methods, f"the {results.best} is the better verified"
    sizes = [size for name in results.finished if (size := methods[name].verified_misfit) is not None]
    if len(sizes) < len(results.finished):  # a folder of an earlier version
        return told
    first, *others = (rounded(size, 2) for size in sizes)
    compared = " and ".join(f"the {m}'s {size}" for m, size in zip(results.finished[1:], others, strict=True))
    return (
        f"{told}: over noise (of a channel that the emulator predicts poorly, over that and the emulator's error) its "
        f"error in all channels is {first}, {compared}"
    )


def _shifted(results: InversionResults) -> bool:
    """Whether the record's clock was fitted, so that the errors without that are others."""
    return results.inversion.time_offset.sigma is not None


def _row(results: InversionResults, method: str, channel: str) -> tuple[str, ...]:
    score = results.inversion.methods[method].channels[channel]
    unit = results.record.units[channel]
    best = " (best)" if method == results.best and len(results.finished) > 1 else ""
    return (
        method + best + (f", {words(channel)}" if len(results.channels) > 1 else ""),
        _known(score.verified_rmse, unit),
        "–" if score.verified_relative is None else percent(score.verified_relative),
        *((_known(score.verified_rmse_at_zero_offset, unit),) if _shifted(results) else ()),
        _known(score.predicted_rmse, unit),
        *_peak(results, method, channel),
    )


def _peak(results: InversionResults, method: str, channel: str) -> tuple[str, str]:
    """By how much the simulated peak is larger than the record's, and later; not known of a clipped one."""
    if record_peak(results, channel).clipped:
        return "–", "–"
    record = results.used.channels[channel]
    both = np.isfinite(record) & np.isfinite(results.simulated[method][channel])
    time, record, simulated = results.record.time[both], record[both], results.simulated[method][channel][both]
    top, found = same_side(record, simulated)
    return signed((simulated[found] / record[top] - 1) * 100, "%"), signed_quantity(time[found] - time[top], "s")


def signed(number: float, unit: str) -> str:
    """A difference with its sign: `+5.4 %`."""
    text = f"{number:+.0f}" if abs(number) >= 99.5 else f"{number:+#.2g}".rstrip(".")
    return f"{text} {unit}".replace("-", "−", 1)


def _known(value: float | None, unit: str) -> str:
    return "–" if value is None else reading(value, unit)
