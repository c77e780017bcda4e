"""The page of a comparison with another code: figures of merit by sensor, then the curves, then what was read."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from birdstrike.data.formatting import many, quantity, reading
from birdstrike.data.storage.files import file_digest, write_atomically
from birdstrike.data.units import rounded
from birdstrike.reports.blocks import Block, Lines, Paragraph, Section, Table, Warnings, drawing
from birdstrike.reports.comparison.other_code import CurvePair
from birdstrike.reports.figures.other_code import two_codes_figure
from birdstrike.reports.page.render import rendered

HEAD = (
    "sensor",
    "peak, ours",
    "peak, theirs",
    "RMS of the peak",
    "peak later by",
    "impulse, ours / theirs",
    "ISO/TS 18571",
)


def write_comparison_page(
    path: Path, case: str, theirs: str, pairs: Sequence[CurvePair], files: Sequence[str | Path], told: Sequence[str]
) -> None:
    """theirs: what the other curves are called; files: what they were read from; told: what a reader must know."""
    blocks: list[Block] = [Paragraph(_sentence(pairs, theirs)), _table(pairs)]
    if told:
        blocks.insert(0, Warnings(tuple(told)))
    curves = [_drawn(pair, theirs) for pair in pairs]
    sections = (
        Section("figures-of-merit", "How far apart the two codes are", tuple(blocks)),
        Section("curves", "The curves", tuple(curves)),
        Section("sources", "What was read", (Lines(tuple(_source(Path(file)) for file in files)), Paragraph(METHOD))),
    )
    subtitle = f"Case {case}: curves that birdstrike simulates, beside those of {theirs} as its files have them."
    write_atomically(path, rendered(title=f"birdstrike beside {theirs}", subtitle=subtitle, sections=sections))


METHOD = (
    "RMS: root mean square difference over the largest reading of the other code, at its instants, on a common clock. "
    "Impulse: integral of a force over the time that both cover. ISO/TS 18571 rates corridor, phase, magnitude and "
    "slope between 0 and 1: above 0.94 excellent, above 0.80 good, above 0.58 fair, else poor. "
    "No curve is filtered or shifted."
)


def _drawn(pair: CurvePair, theirs: str) -> Block:
    figure = two_codes_figure(pair.name, pair.unit, pair.time, pair.ours, pair.theirs, theirs)
    return drawing(f"codes-{pair.name}", figure, _caption(pair, theirs))


def _sentence(pairs: Sequence[CurvePair], theirs: str) -> str:
    scored = [pair for pair in pairs if pair.score is not None]
    if not scored:
        return f"No curve of {theirs} is above zero: there is nothing to rate."
    worst = max(scored, key=lambda pair: pair.score.share if pair.score else 0.0)
    assert worst.score is not None
    return (
        f"{many(len(pairs), 'sensor')} of the case in both codes. The largest difference "
        f"is that of {worst.name.replace('_', ' ')}: {rounded(100.0 * worst.score.share, 2)} % of its peak (RMS)."
    )


def _table(pairs: Sequence[CurvePair]) -> Table:
    rows = tuple(_row(pair) for pair in pairs)
    return Table(HEAD, rows, "Every sensor that both have.", frozenset(range(1, len(HEAD))))


def _row(pair: CurvePair) -> tuple[str, ...]:
    figures, found = pair.figures(), pair.score
    impulses = "-"
    if pair.impulses is not None:
        impulses = " / ".join(f"{value:.4g}" for value in pair.impulses) + " N s"
    rating = "-"
    if found is not None and found.rating is not None:
        rating = f"{found.rating.overall:.2f}, {found.rating.grade}"
    return (
        pair.name.replace("_", " "),
        reading(figures["peak_ours"], pair.unit, 4),
        reading(figures["peak_theirs"], pair.unit, 4),
        "-" if found is None else f"{rounded(100.0 * found.share, 2)} %",
        "-" if found is None else quantity(found.peak_time, "s", 3),
        impulses,
        rating,
    )


def _caption(pair: CurvePair, theirs: str) -> str:
    name = pair.name.replace("_", " ")
    if pair.score is None:
        return f"{name}: {theirs} reads nothing here."
    rms, share = reading(pair.score.rms, pair.unit, 3), 100.0 * pair.score.share
    return f"{name}: RMS difference {rms}, {rounded(share, 2)} % of the peak. Below: birdstrike less {theirs}."


def _source(path: Path) -> str:
    return f"{path.name}, SHA-256 {file_digest(path)[:16]}"
