"""What a diagnosis rests on: noise, numerical error, stated tolerances, strikes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

from birdstrike.inversion.diagnosis.words import HEADS
from birdstrike.inversion.formatting import quantity as in_words
from birdstrike.reports.blocks import Block, Paragraph, Section, Table
from birdstrike.reports.sections.diagnosis import DiagnosisResults, magnitude, two


def trust_section(results: DiagnosisResults) -> Section:
    """Noise, numerical error, nuisances, strikes, tolerances."""
    content, units = results.content, results.units
    noise = tuple(
        (
            name.replace("_", " "), in_words(entry["sigma"], units[name], 2), entry["source"], str(entry["points"]),
            f"{100 * entry['numerical_share']:.0f} %",
        )
        for name, entry in content["noise"]["sensors"].items()
    )  # fmt: skip
    directions = tuple((name, f"{size:.2f}") for name, size in content["noise"]["numerical"].items())
    blocks: list[Block] = [
        Table(
            ("sensor", "noise", "source", "points", "numerical share"),
            noise,
            "Noise of the record, and what numerical error has of the whole.",
        ),
        Table(
            ("numerical choice changed", "change of the curves"),
            directions,
            "Numerical bias: change of the curves, RMS in units of the noise. These directions count as no effect."
            + _enlarged(content["noise"].get("numerical_enlarged", 1.0)),
            frozenset({1}),
        ),
    ]
    if content["tolerances"]:
        blocks += _tolerances(content["tolerances"], units)
    strikes = content["strikes"]
    blocks.append(
        Paragraph(
            f"Strikes: {strikes['campaign']} of the campaign, {strikes['paid']} more, {strikes['reused']} found stored."
        )
    )
    if content["refused"]:
        lost = "; ".join(f"{name}: {reason}" for name, reason in content["refused"].items())
        blocks.append(Paragraph(f"Effects that the case cannot carry: {lost}."))
    return Section("trust", "What the verdict rests on", tuple(blocks))


def _enlarged(size: float) -> str:
    """What was done to the draws, if anything; not in files from before it was."""
    if size == 1.0:
        return ""
    return f" The finer meshes' part is multiplied by {size:.2g} in variance, for its draws to predict one another."


def _tolerances(entries: Sequence[Mapping[str, Any]], units: Mapping[str, str]) -> list[Block]:
    """Verdicts and errors at each tolerance, and the magnitudes that it allows."""
    verdicts = tuple(
        (
            _share(t), HEADS[t["verdict"]], ", ".join(t["confidence_set"]) or "no model",
            _pair(t, lambda e: two(e["weighted"])), *(_pair(t, partial(_rmse, name, units[name])) for name in units),
        )
        for t in entries
    )  # fmt: skip
    sensors = tuple(f"{name.replace('_', ' ')}, RMS" for name in units)
    head = ("tolerance", "verdict", "confidence set", "weighted RMS", *sensors)
    words = (
        "No noise is known: the verdict at stated tolerances, as shares of the peak; fitted errors before and after."
    )
    sizes = tuple(
        (_share(t), e["name"], magnitude(e), f"{e['p_consistent']:.3f}") for t in entries for e in t["effects"]
    )
    listed = Table(
        ("tolerance", "effect", "magnitude (95 %)", "p"), sizes, "The effects of each set, the likeliest first."
    )
    return [Table(head, verdicts, words), *([listed] if sizes else [])]


def _share(entry: Mapping[str, Any]) -> str:
    return f"{100 * entry['tolerance']:g} %"


def _rmse(name: str, unit: str, errors: Mapping[str, Any]) -> str:
    return in_words(errors["rmse"][name], unit)


def _pair(entry: Mapping[str, Any], told: Callable[[Mapping[str, Any]], str]) -> str:
    """Before and, where there is one, after."""
    return " -> ".join(told(entry[label]) for label in ("before", "after") if entry[label])
