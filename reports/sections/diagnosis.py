"""Sections of a diagnosis: the first screen (what is missing, how sure, what to do), then what it rests on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd

from birdstrike.data.errors import UserError
from birdstrike.data.formatting import listing, plain
from birdstrike.data.formatting import quantity as with_unit
from birdstrike.data.units import rounded
from birdstrike.inversion.labels import in_words, runs_near_the_fits
from birdstrike.inversion.results.diagnosis import Diagnosis, EffectFigures, ShotStates
from birdstrike.inversion.results.diagnosis_files import curve_files, read_curves
from birdstrike.inversion.results.diagnosis_text import beyond, next_step
from birdstrike.reports.blocks import Block, Paragraph, Section, Table, Warnings, drawing
from birdstrike.reports.figures.diagnosis import curves_figure, probability_figure, residual_figure
from birdstrike.reports.figures.quantities import probability_text, reading, signed_quantity
from birdstrike.reports.results.measurement import program_in
from birdstrike.reports.sections.summary import signed
from birdstrike.solver.case.effects import SHOWN, shown

HELDOUT = "the record of --heldout"
MOST_ROWS, MOST_WARNINGS, MOST_PAIRS = 12, 5, 5


@dataclass(frozen=True)
class DiagnosisResults:
    """What a diagnosis found, the tables of the curves, by shot, and the program that simulated them."""

    found: Diagnosis
    curves: Mapping[str, pd.DataFrame]
    program: str


def read_diagnosis(folder: Path) -> DiagnosisResults:
    """diagnosis.json and the curves of a folder; raises UserError where they are missing or damaged."""
    path = folder / "diagnosis.json"
    if not path.is_file() or not (folder / "diagnosis.csv").is_file():
        raise UserError(
            f"no diagnosis in {folder}; make it with: birdstrike diagnose CASE --measured CSV --out {folder}"
        )
    found = Diagnosis.read(path)
    shots = [one.name for one in found.shots]
    files = dict(zip(shots, curve_files(shots), strict=True))
    curves = {name: read_curves(folder / file) for name, file in files.items()}
    return DiagnosisResults(found, curves, program_in(folder))


def verdict_section(results: DiagnosisResults) -> Section:
    """What is missing, what to do, probabilities with what each model requires, residuals, warnings."""
    found = results.found
    blocks: list[Block] = [Paragraph(found.conclusion), Paragraph(f"What to do: {next_step(found)}.")]
    likely = (
        "Left: how likely each model is, its family in brackets; full colour: the 95 % set. The sentence counts an "
        "effect alone and in pairs. Beforehand it is as likely as not that nothing is missing, and the other half is "
        "shared equally among families and their effects. Right: the smallest error of the simulation, as a share of "
        "the signal's peak, with which the model agrees with the record: enough for what the model leaves unexplained, "
        "and for no other model to be clearly likelier. A model that needs more than a sound simulation errs by (1 to "
        "3 %) is not believable."
    )
    blocks.append(drawing("probabilities", probability_figure(found), likely))
    left = (
        f"What the calibrated model{', before and after the likeliest effect is added,' if found.after else ''} "
        f"leaves of the record{', less what it leaves of the baseline' if found.baseline else ''}. A residual "
        "inside the pale band is what noise, mesh and the usual error of a simulation make. The alarm weighs all "
        "shots, sensors and instants together: it may be raised where every curve lies inside its band."
    )
    for shot in found.shots:
        own, told = ("", left) if len(found.shots) == 1 else (f"-{shot.name}", f"Shot {shot.name}. {left}")
        blocks.append(drawing(f"residuals{own}", residual_figure(results.curves[shot.name], found.units), told))
        left = "As above."
    if found.warnings:
        blocks.append(Warnings(tuple(found.warnings[:MOST_WARNINGS])))
        if (more := len(found.warnings) - MOST_WARNINGS) > 0:
            blocks.append(Paragraph(f"Further warnings: {more}, in diagnosis.json."))
    return Section("diagnosis", "Diagnosis: what the model lacks", tuple(blocks))


def errors_section(results: DiagnosisResults) -> Section:
    """Errors before and after by shot and sensor, held out, and the parameters with the bias that was caused."""
    found, units = results.found, results.found.units
    blocks: list[Block] = []
    for shot in found.shots:
        name = f"Shot {shot.name} of case {shot.case}"
        states = " before and after the effect is added" if shot.after else ""
        plain_error = "; what the model leaves of the baseline is not subtracted" if found.baseline else ""
        words = f"{name}: the record and the calibrated model{states}{plain_error}."
        blocks.append(drawing(f"curves-{shot.name}", curves_figure(results.curves[shot.name], units), words))
        blocks.append(_errors(shot, units))
    held = tuple(
        (
            HELDOUT if name == "shot" else name.replace("_", " "),
            two(one["before"]),
            two(one["after"]),
            gained(one.get("gain")),
        )
        for name, one in found.held_out.items()
    )
    if held:
        words = (
            "Predicted by models fitted to the rest of the data: RMS of the residual over noise, numerical and model "
            "error together, as each model states them; 1 is as good as can be expected, less overstates them. Gain: "
            "in log density a point, in which both count; above 0 the effect predicts better."
        )
        blocks.append(Table(("held out", "before", "after", "gain"), held, words, frozenset({1, 2, 3})))
    blocks += [_parameters(shot, len(found.shots) > 1) for shot in found.shots]
    return Section("errors", "Diagnosis: error and parameters before and after", tuple(blocks))


def _errors(shot: ShotStates, units: Mapping[str, str]) -> Table:
    """RMS errors of one shot, of the fits and of the solver."""
    rows = []
    named = ("before", "after") if shot.after else ("before",)
    found = [shot.before, *([shot.after] if shot.after else [])]
    states, runs = [vars(one) for one in found], [one.solver for one in found]
    for key, words in (("rmse", ""), ("rmse_less_baseline", ", less the baseline's")):
        for name in states[0][key] or {}:
            cells = (reading(one[key][name], units[name]) if one and one[key] else "–" for one in (*states, *runs))
            rows.append((f"{name.replace('_', ' ')}{words}", *cells))
    for key, words in (("raw", "all, over the noise"), ("weighted", "all, over all errors")):
        rows.append((words, *(two(one[key]) for one in states), *(two(one[key] if one else None) for one in runs)))
    head = ("sensor", *(f"{name}, emulator" for name in named), *(f"{name}, solver" for name in named))
    words = (
        f"RMS error in shot {shot.name}. Emulator: at the fit, on the fine mesh (of shells from a file: with the "
        "fine bird alone). Solver: one simulation of the declared case at the fit; the difference is the error of the "
        "declared mesh."
    )
    if shot.before.rmse_less_baseline:
        words += (
            " Less the baseline's: without the part that the baselines' residuals explain, which is the model's error "
            "on this rig and no missing effect; the baseline was calibrated on the emulator's mesh."
        )
    return Table(head, tuple(rows), words, frozenset(range(1, len(head))))


def _parameters(shot: ShotStates, several: bool) -> Table:
    """Calibrated parameters of a shot's bird before and after; their difference is the bias. several: shots."""
    before, after = shot.before.parameters, shot.after.parameters if shot.after else {}
    whose = f"The bird of shot {shot.name}: calibrated parameters" if several else "Calibrated parameters"
    if not after:
        rows = tuple((plain(name, before), _interval(entry)) for name, entry in before.items())
        return Table(("parameter", "calibrated"), rows, f"{whose} with 95 % intervals.")
    rows = tuple(
        (
            plain(name, before),
            _interval(entry),
            _interval(after[name]) if name in after else "–",
            _bias(entry, after.get(name)),
        )
        for name, entry in before.items()
    )
    words = (
        f"{whose} with 95 % intervals. Bias: by how much the parameter was wrong because the model had to imitate the "
        "missing effect; –: the record does not identify it."
    )
    return Table(("parameter", "before", "after", "bias before"), rows, words)


def _bias(before: Mapping[str, Any], after: Mapping[str, Any] | None) -> str:
    """How far the value moves when the effect is added; of a parameter that is not identified it is no error."""
    if after is None or not (before.get("identified", True) and after.get("identified", True)):
        return "–"
    return signed_quantity(before["value"] - after["value"], before["unit"])


WITHOUT_BASELINE = (
    "; without a baseline the alarm is mostly quiet at it, because a model error that is not known explains it too"
)


def effects_section(results: DiagnosisResults) -> Section:
    """Every effect: probability, magnitude, required model error, what could have been detected."""
    found = results.found
    head = ("effect", "probability", "magnitude (95 %)", "model error needed", "least detectable", "most alike")
    listed = found.listed[:MOST_ROWS]
    rows = tuple(_row(one, found.minimum_detectable.get(one.name)) for one in listed)
    words = (
        f"The {len(rows)} likeliest of {len(found.listed)}; a probability is that of an effect alone and in "
        "pairs. Least detectable: the magnitude that a test of this effect alone finds four times of five, at a "
        f"false-alarm rate of {100 * found.alpha:g} %{'' if found.baseline else WITHOUT_BASELINE}. Most alike: cosine "
        "between the changes of the record, once the parameters have taken their part; at 1 no record of these sensors "
        "separates the two."
    )
    blocks: list[Block] = [Table(head, rows, words, frozenset({1, 3, 4}))]
    if found.pairs:
        blocks.append(Paragraph(_pairs(found.pairs)))
    title = "Diagnosis: every effect considered"
    if (proposal := found.next_measurement) and len(proposal["candidates"]) > 1 and len(proposal["separates"]) > 1:
        blocks.append(_candidates(proposal))
        title += ", and what to measure next"
    return Section("effects", title, tuple(blocks))


def _pairs(found: Sequence[Mapping[str, Any]]) -> str:
    """The likeliest pairs with their probabilities, and how many more there are."""
    told = [f"{' and '.join(in_words(name) for name in one['effects'])} {one['probability']:.3f}" for one in found]
    more = f"; {len(told) - MOST_PAIRS} more are less likely" if len(told) > MOST_PAIRS else ""
    return f"Pairs of effects in the 95 % set, with their probabilities: {'; '.join(told[:MOST_PAIRS])}{more}."


def _candidates(proposal: Mapping[str, Any]) -> Table:
    """What else could be measured, the best first; of those that help as much, the one that is proposed."""
    order = sorted(proposal["candidates"], key=lambda one: -one["expected_probability"])
    rows = tuple((one["what"], f"{one['expected_probability']:.2f}") for one in order[:MOST_PAIRS])
    words = (
        f"Next measurements, the best first: expected probability of the right model among "
        f"{', '.join(in_words(name) for name in proposal['separates'])}; with the record alone {proposal['now']:.2f}."
    )
    if needed := proposal.get("needed"):
        words += f" Needed before all others is {proposal['what']}: {needed}."
    return Table(("measurement", "expected probability"), rows, words, frozenset({1}))


def basis_section(results: DiagnosisResults) -> Section:
    """Noise, discrepancy and its source, baselines, simulations, effects that the case cannot carry."""
    found, units = results.found, results.found.units
    noise = tuple(
        (
            name.replace("_", " "),
            reading(entry["sigma"], units[name], 2),
            entry["source"],
            str(entry["points"]),
            f"{100 * entry['numerical_share']:.0f} %",
            _late(found, name),
        )
        for name, entry in found.noise["sensors"].items()
    )
    of = "each sensor in the first shot that has it" if len(found.shots) > 1 else "the record"
    words = (
        f"Noise of {of}; share of emulator and mesh in the whole error; and the time from which on the curve "
        "carries no information, because the model error has grown threefold."
    )
    head = ("sensor", "noise", "source", "points", "numerical share", "uninformative from")
    blocks: list[Block] = [Table(head, noise, words), Paragraph(_model_error(found))]
    if found.baseline:
        blocks.append(Paragraph(_baseline(found.baseline, units)))
    runs = found.strikes
    near = f" {runs_near_the_fits(runs['refinement']).capitalize()}." if runs.get("refinement") else ""
    blocks.append(Paragraph(f"Simulations: {runs['paid']} run, {runs['reused']} found stored.{near}"))
    if found.left_out:
        moved = ", ".join(f"{in_words(name)} ({100 * share:.0f} %)" for name, share in found.left_out.items())
        blocks.append(
            Paragraph(
                f"Measured, but not used: {moved}. By so much of its peak a simulation changes where only the lattice "
                "of the bird's particles is another; whether these sensors are at fault, the record does not say."
            )
        )
    if found.refused:
        reasons = "; ".join(f"{in_words(name)}: {reason}" for name, reason in found.refused.items())
        blocks.append(Paragraph(f"Effects that this case cannot carry: {reasons}."))
    return Section("basis", "Diagnosis: what the answer rests on", tuple(blocks))


def _model_error(found: Diagnosis) -> str:
    """Source and size of the model error."""
    discrepancy = found.discrepancy
    shares = ", ".join(
        f"{100 * share:.2g} % of the peak ({kind.replace('_', ' ')})"
        for kind, share in discrepancy["amplitude"].items()
    )
    return f"Model error, that of a sound simulation beside noise and mesh: {discrepancy['source']}; found: {shares}."


def _baseline(base: Mapping[str, Any], units: Mapping[str, str]) -> str:
    """The model error that the baselines show."""
    rms = ", ".join(
        f"{name.replace('_', ' ')} {reading(value, units[name])}"
        for name, value in base["residual_rms"].items()
        if name in units
    )
    one = len(base["shots"]) == 1
    it = "it" if one else "them"
    gain = f" With {it}, minimum detectable effects are {base['gain']:.1f} times smaller." if base["gain"] else ""
    named = f"{'Baseline' if one else 'Baselines'} {listing(base['shots'])}"
    return f"{named}: the calibrated model leaves an RMS of {rms}.{gain}{_bird(base)}"


BIRDS = {
    "same": "of the shot's batch, cast and shot alike",
    "recipe": "cast by the shot's recipe, another batch",
    "other": "unlike the shot's",
}


def _bird(base: Mapping[str, Any]) -> str:
    """What was assumed of the baselines' birds, and what the records themselves say of it."""
    same, bird = base.get("same_bird"), base.get("bird")
    its = "its bird" if len(base["shots"]) == 1 else "their birds"
    if bird is None:  # a file of an earlier version
        return "" if same is None else f" Its bird is the shot's with probability {same:.2f}."
    stated = BIRDS.get(bird["stated"])
    assumed = (
        f"Stated of {its}: {stated}"
        if stated
        else f"Nothing was stated of {its}, so that three possibilities are weighed, equally likely beforehand"
    )
    shares = "; ".join(f"{BIRDS[name]}: {probability_text(share)}" for name, share in bird["records"].items())
    verdict = "; they contradict what was stated" if bird["contradicted"] else ""
    return f" {assumed}. By the records alone, with the models averaged: {shares}{verdict}."


def _late(found: Diagnosis, name: str) -> str:
    """From when on a channel carries no information."""
    time = found.discrepancy["growth"].get(name, {}).get("uninformative_from")
    return "–" if time is None else f"{rounded(1e3 * time, 2)} ms"


def two(value: float | None) -> str:
    """A whitened RMS."""
    return "–" if value is None else f"{value:.2f}"


def gained(value: float | None) -> str:
    """A gain in log density, with its sign."""
    return "–" if value is None else signed(value, "").strip()


def _interval(entry: Mapping[str, Any]) -> str:
    low, high = (with_unit(x, entry["unit"]) for x in entry["interval_95"])
    note = "" if entry.get("identified", True) else "; not identifiable from this record"
    return f"{with_unit(entry['value'], entry['unit'])} ({low} to {high}){note}"


def _row(one: EffectFigures, least: float | None) -> tuple[str, ...]:
    """One model's figures."""
    share = one.required_discrepancy
    alike = "; ".join(f"{in_words(name)} {cosine:+.2f}" for name, cosine in list(one.twins.items())[:2])
    probability = f"{one.probability:.3f}" if one.probability >= 0.001 else "< 0.001"
    return (
        in_words(one.name),
        probability,
        magnitude(one),
        "–" if share is None else f"{100 * share:.2g} %",
        "–" if least is None else shown(least, one.unit).lstrip("+"),
        alike or "–",
    )


def magnitude(one: EffectFigures) -> str:
    """ "+0.2 mm (+0.1 to +0.3)"."""
    if one.magnitude is None or one.interval_95 is None:
        return "–"
    if one.at_bound:
        return beyond(one.magnitude, one.interval_95, partial(shown, unit=one.unit))
    low, high = (shown(x, one.unit) for x in one.interval_95)
    unit = SHOWN.get(one.unit) or one.unit
    return f"{shown(one.magnitude, one.unit)} ({low.removesuffix(unit).strip()} to {high})"
