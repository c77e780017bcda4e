"""Sections of a diagnosis: verdict and sentence, before and after, every effect, what could hide."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import pandas as pd

from birdstrike.data.units import from_si
from birdstrike.inversion.diagnosis.words import HEADS
from birdstrike.inversion.formatting import quantity as in_words
from birdstrike.reports.blocks import Block, Paragraph, Section, Table, Warnings, drawing
from birdstrike.reports.figures.diagnosis import before_after_figure, consistency_figure
from birdstrike.solver.case.effects import SHOWN


@dataclass(frozen=True)
class DiagnosisResults:
    """Content of diagnosis.json, and the table of diagnosis.csv."""

    content: Mapping[str, Any]
    curves: pd.DataFrame

    @property
    def units(self) -> dict[str, str]:
        """SI unit of every channel."""
        return {name: entry["unit"] for name, entry in self.content["noise"]["sensors"].items()}


def verdict_section(results: DiagnosisResults) -> Section:
    """Verdict, sentence, the curves and residuals before and after, the error in figures."""
    content = results.content
    after = content["after"] is not None
    caption = (
        "The record, the calibrated model before and after the effect is added, and below what each misses; the band "
        "is two standard deviations of noise and numerical error together."
        if after
        else "The record, the calibrated model, and below what it misses; the band is two standard deviations of noise "
        "and numerical error together."
    )
    blocks: list[Block] = [Paragraph(f"{HEADS[content['verdict']]}. {content['sentence']}")]
    if content["warnings"]:
        blocks.append(Warnings(tuple(content["warnings"])))
    blocks += [drawing("before-after", before_after_figure(results.curves, results.units), caption), _errors(results)]
    if content["next_measurement"]:
        blocks.append(Paragraph(f"Next measurement: {content['next_measurement']['sentence']}."))
    blocks += [
        Paragraph(f"The data allow a pair of effects: {' and '.join(p['effects'])} (p = {p['p_consistent']:.2f}).")
        for p in content["pairs"]
    ]
    if content["remainder"]:
        blocks.append(
            Paragraph(f"{content['remainder']['sentence'][0].upper()}{content['remainder']['sentence'][1:]}.")
        )
    blocks += [_parameters(content)]
    return Section("diagnosis", "Diagnosis: before and after", tuple(blocks))


def _errors(results: DiagnosisResults) -> Table:
    """RMS errors, fitted and held out."""
    content, units = results.content, results.units
    before, after = error(content["before"]), error(content["after"]) if content["after"] else None
    rows = [
        (
            f"{name.replace('_', ' ')}, RMS",
            in_words(value, units[name]),
            in_words(after["rmse"][name], units[name]) if after else "–",
        )
        for name, value in before["rmse"].items()
    ]
    for name, value in before.get("declared", {}).items():
        here = in_words(after["declared"][name], units[name]) if after and "declared" in after else "–"
        rows.append((f"{name.replace('_', ' ')}, RMS, on the declared mesh alone", in_words(value, units[name]), here))
    rows.append(
        (
            "all, against noise and numerical error (1 = noise)",
            two(before["weighted"]),
            two(after["weighted"]) if after else "–",
        )
    )
    rows.append(("all, against measurement noise alone", two(before["raw"]), two(after["raw"]) if after else "–"))
    for name, one in content["held_out"].items():
        chosen = f" (trained without it: {one['chosen'] or 'no effect'})" if one["verdict"] != "not repeated" else ""
        rows.append((f"held-out {name.replace('_', ' ')}{chosen}", two(one["before"]), two(one["after"])))
    return Table(("error", "before", "after"), tuple(rows), _caption(content), frozenset({1, 2}))


def error(state: Mapping[str, Any]) -> Mapping[str, Any]:
    """rmse, weighted, raw of a state: the solver's own where there is a strike, else the fitted ones."""
    return state.get("solver") or state


def _caption(content: Mapping[str, Any]) -> str:
    """Whose curves the errors are of."""
    made = [state for label in ("before", "after") if (state := content[label])]
    struck = all(state.get("solver") for state in made)
    mesh = ", with what finer meshes add" if any("declared" in error(state) for state in made) else ""
    whose = (
        f"of one strike of the solver at each fit{mesh}" if struck else "of the fitted curves where no strike was made"
    )
    fitted = " -> ".join(two(state["weighted"]) for state in made)
    return (
        f"The error before and after, {whose} (the fitted curves foretold {fitted} against noise and numerical error). "
        "Held out: selection and refit were repeated without that part of the data; nothing is fitted to another shot."
    )


def two(value: float | None) -> str:
    """A whitened RMS."""
    return "–" if value is None else f"{value:.2f}"


def _parameters(content: Mapping[str, Any]) -> Table:
    """Calibrated parameters before and after, with intervals."""
    before, after = content["before"]["parameters"], (content["after"] or {}).get("parameters", {})
    rows = [
        (name, _interval(entry), _interval(after[name]) if name in after else "–") for name, entry in before.items()
    ]
    return Table(("parameter", "before", "after"), tuple(rows), "The calibrated parameters, with 95 % intervals.")


def _interval(entry: Mapping[str, Any]) -> str:
    low, high = (in_words(x, entry["unit"]) for x in entry["interval_95"])
    return f"{in_words(entry['value'], entry['unit'], 4)} ({low} to {high})"


def effects_section(results: DiagnosisResults) -> Section:
    """Every effect: p, evidence, magnitude, twins, what could have been detected, what the parameters absorb."""
    content = results.content
    caption = "What the data say of every model; blue: in the confidence set."
    picture = drawing("effects", consistency_figure(content["effects"], content["alpha"]), caption)
    head = ("effect", "p", "log evidence", "magnitude (95 %)", "twins (cosine)", "least detectable", "absorbed")
    rows = tuple(_row(one, content["minimum_detectable"].get(one["name"])) for one in content["effects"])
    words = "Every model, refitted. Absorbed: share of the effect's signature that the calibrated parameters imitate."
    return Section("effects", "Every effect of the library", (picture, Table(head, rows, words, frozenset({1, 2, 6}))))


def _row(one: Mapping[str, Any], least: float | None) -> tuple[str, ...]:
    unit = one["unit"]
    twins = ", ".join(f"{name} {cosine:+.2f}" for name, cosine in one["twins"].items()) or "–"
    share = "–" if one["absorbed"] is None else f"{100 * one['absorbed']:.0f} %"
    return (
        one["name"], f"{one['p_consistent']:.3f}", f"{one['log_evidence']:+.1f}", magnitude(one), twins,
        "–" if least is None else _sized(least, unit).lstrip("+"), share,
    )  # fmt: skip


def magnitude(one: Mapping[str, Any]) -> str:
    """ "+0.2 mm (+0.1 to +0.3)"."""
    unit = one["unit"]
    if one["magnitude"] is None:
        return "–"
    if one["interval_95"] is None:
        return f"{_sized(one['magnitude'], unit)} (limit of the search reached)"
    low, high = (
        _sized(x, unit).rsplit(" ", 1)[0] if SHOWN.get(unit, unit) else _sized(x, unit) for x in one["interval_95"]
    )
    return f"{_sized(one['magnitude'], unit)} ({low} to {high})"


def _sized(value: float, unit: str) -> str:
    shown = SHOWN.get(unit, unit)
    return f"{from_si(value, shown) if shown else value:+.3g} {shown}".strip()
