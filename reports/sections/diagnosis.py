"""Sections of a diagnosis: the first screen (what is missing, how sure, what to do), then what it rests on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import pandas as pd

from birdstrike.data.units import from_si
from birdstrike.inversion.diagnosis.answer import HEADS
from birdstrike.inversion.formatting import plain
from birdstrike.inversion.formatting import quantity as in_words
from birdstrike.reports.blocks import Block, Paragraph, Section, Table, Warnings, drawing
from birdstrike.reports.figures.diagnosis import probability_figure, required_figure, residual_figure
from birdstrike.solver.case.effects import SHOWN

MOST_ROWS = 12


@dataclass(frozen=True)
class DiagnosisResults:
    """Content of diagnosis.json, and the tables of the curves, by shot."""

    content: Mapping[str, Any]
    curves: Mapping[str, pd.DataFrame]

    @property
    def units(self) -> dict[str, str]:
        """SI unit of every channel."""
        return {name: entry["unit"] for name, entry in self.content["noise"]["sensors"].items()}


def verdict_section(results: DiagnosisResults) -> Section:
    """One sentence, probabilities, residuals before and after, required discrepancy, the next measurement, warnings."""
    content = results.content
    blocks: list[Block] = [Paragraph(f"{HEADS[content['verdict']]}. {content['sentence']}.")]
    if content["next_measurement"]:
        blocks.append(Paragraph(f"Next measurement: {content['next_measurement']['sentence']}."))
    bars = "Posterior probability of each model, by family. Prior: 0.5 that nothing is missing, the rest shared equally among families and their effects."
    blocks.append(drawing("probabilities", probability_figure(content), bars))
    first = next(iter(results.curves.values()))
    words = "Record and calibrated model before and after the effect is added; below, the residuals. Bands, two standard deviations: measurement noise (grey), noise with numerical error and model-form error (blue)."
    blocks.append(drawing("residuals", residual_figure(first, results.units), words))
    needed = "The smallest model-form error with which each model is consistent with the record. A model far to the right needs an implausibly wrong simulation."
    blocks.append(drawing("required", required_figure(content["effects"], content["confidence_set"]), needed))
    if content["warnings"]:
        blocks.append(Warnings(tuple(content["warnings"][:5])))
    return Section("diagnosis", "What is missing", tuple(blocks))


def errors_section(results: DiagnosisResults) -> Section:
    """Errors before and after by shot and sensor, fitted and by the solver; held out; parameters."""
    content, units = results.content, results.units
    blocks: list[Block] = []
    for shot in content["shots"]:
        rows = []
        before, after = shot["before"], shot["after"]
        for name, value in before["rmse"].items():
            solver = [
                in_words(s["solver"]["rmse"][name], units[name]) if s and s.get("solver") else "–"
                for s in (before, after)
            ]
            fitted = in_words(after["rmse"][name], units[name]) if after else "–"
            rows.append((name.replace("_", " "), in_words(value, units[name]), fitted, *solver))
        head = ("sensor", "before, fitted", "after, fitted", "before, solver", "after, solver")
        blocks.append(
            Table(
                head,
                tuple(rows),
                f"RMS error in shot {shot['name']}; solver: one run of the declared case at the fit.",
                frozenset({1, 2, 3, 4}),
            )
        )
    held = tuple(
        (name.replace("_", " "), two(one["before"]), two(one["after"])) for name, one in content["held_out"].items()
    )
    if held:
        blocks.append(
            Table(
                ("predicted without being fitted", "before", "after"),
                held,
                "Whitened RMS (1: noise, numerical error and model-form error together).",
                frozenset({1, 2}),
            )
        )
    before, after = content["before"]["parameters"], (content["after"] or {}).get("parameters", {})
    rows = tuple((plain(n), _interval(e), _interval(after[n]) if n in after else "–") for n, e in before.items())
    blocks.append(
        Table(
            ("parameter", "before", "after"),
            rows,
            "Calibrated parameters with 95 % intervals; the difference is the bias that the missing effect had caused.",
        )
    )
    return Section("errors", "Error and parameters before and after", tuple(blocks))


def effects_section(results: DiagnosisResults) -> Section:
    """Every effect: probability, magnitude, required discrepancy, what could have been detected."""
    content = results.content
    head = ("model", "probability", "magnitude (95 %)", "required model error", "least detectable", "most alike")
    rows = tuple(_row(one, content["minimum_detectable"].get(one["name"])) for one in content["effects"][:MOST_ROWS])
    words = (
        f"The {MOST_ROWS} likeliest models. Least detectable: found four times of five at a false-alarm rate of 5 %."
    )
    blocks: list[Block] = [Table(head, rows, words, frozenset({1, 3, 4}))]
    blocks += [
        Paragraph(f"The 95 % set holds the pair {' and '.join(p['effects'])} (probability {p['probability']:.2f}).")
        for p in content["pairs"][:5]
    ]
    return Section("effects", "Every effect considered", tuple(blocks))


def basis_section(results: DiagnosisResults) -> Section:
    """Noise, discrepancy and its source, baselines, simulations, effects that the case cannot carry."""
    content, units = results.content, results.units
    noise = tuple(
        (
            name.replace("_", " "),
            in_words(e["sigma"], units[name], 2),
            e["source"],
            str(e["points"]),
            f"{100 * e['numerical_share']:.0f} %",
            _late(content, name),
        )
        for name, e in content["noise"]["sensors"].items()
    )
    discrepancy = content["discrepancy"]
    shares = ", ".join(
        f"{100 * a:.2g} % of the peak ({kind.replace('_', ' ')})" for kind, a in discrepancy["amplitude"].items()
    )
    blocks: list[Block] = [
        Table(
            ("sensor", "noise", "source", "points", "numerical share", "uninformative from"),
            noise,
            "Noise and numerical error; from when on the curve tells nothing because the model error has grown threefold.",
        ),
        Paragraph(f"Model-form error: {discrepancy['source']}; {shares}."),
    ]
    if content["baseline"]:
        base = content["baseline"]
        rms = ", ".join(
            f"{name.replace('_', ' ')} {in_words(v, units[name])}"
            for name, v in base["residual_rms"].items()
            if name in units
        )
        gain = f" Minimum detectable effects are {base['gain']:.1f} times smaller with it." if base["gain"] else ""
        blocks.append(Paragraph(f"Baseline {', '.join(base['shots'])}: residual RMS {rms}.{gain}"))
    strikes = content["strikes"]
    blocks.append(Paragraph(f"Simulations: {strikes['paid']} run, {strikes['reused']} found stored."))
    if content["refused"]:
        blocks.append(
            Paragraph(
                "Not applicable to this case: " + "; ".join(f"{n}: {r}" for n, r in content["refused"].items()) + "."
            )
        )
    return Section("basis", "What the answer rests on", tuple(blocks))


def _late(content: Mapping[str, Any], name: str) -> str:
    time = content["discrepancy"]["growth"].get(name, {}).get("uninformative_from")
    return "–" if time is None else f"{1e3 * time:.2g} ms"


def two(value: float | None) -> str:
    """A whitened RMS."""
    return "–" if value is None else f"{value:.2f}"


def _interval(entry: Mapping[str, Any]) -> str:
    low, high = (in_words(x, entry["unit"]) for x in entry["interval_95"])
    note = "" if entry.get("identified", True) else "; not identifiable from this record"
    return f"{in_words(entry['value'], entry['unit'], 4)} ({low} to {high}){note}"


def _row(one: Mapping[str, Any], least: float | None) -> tuple[str, ...]:
    share = one["required_discrepancy"]
    alike = ", ".join(f"{name} {cosine:+.2f}" for name, cosine in list(one["twins"].items())[:2]) or "–"
    return (
        one["name"].replace("_", " "), f"{one['probability']:.3f}", magnitude(one),
        "–" if share is None else f"{100 * share:.2g} %", "–" if least is None else _sized(least, one["unit"]).lstrip("+"), alike,
    )  # fmt: skip


def magnitude(one: Mapping[str, Any]) -> str:
    """ "+0.2 mm (+0.1 to +0.3)"."""
    if one["magnitude"] is None:
        return "–"
    if one["at_limit"]:
        return f"at least {_sized(one['interval_95'][0], one['unit'])}"
    low, high = (_sized(x, one["unit"]) for x in one["interval_95"])
    return f"{_sized(one['magnitude'], one['unit'])} ({low} to {high})"


def _sized(value: float, unit: str) -> str:
    shown = SHOWN.get(unit, unit)
    return f"{from_si(value, shown) if shown else value:+.3g} {shown}".strip()
