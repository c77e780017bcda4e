"""`birdstrike diagnose`: is the residual of the calibrated model significant, and which effect does it lack?"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.table import Table

from birdstrike.cli.campaign_bar import campaign_bar
from birdstrike.cli.frame import Json, RetryFailed, Settings, console, framed, overrides, progress_bar, say, warn

if TYPE_CHECKING:
    from birdstrike.inversion.diagnosis.diagnosis import Diagnosis, EffectFigures


@framed
def command(
    case: Annotated[str, typer.Argument(help="A case file, or the name of a shipped case: the model as declared.")],
    measured: Annotated[str, typer.Option(help="Measured-data CSV, or the name of a shipped curve.")],
    out: Annotated[Path, typer.Option(help="Folder of the diagnosis; run again to resume.")],
    doe: Annotated[
        Path | None, typer.Option(help="Folder of a finished campaign of the case; else one is run.")
    ] = None,
    heldout: Annotated[str | None, typer.Option(help="Another record of the same case, kept out of every fit.")] = None,
    alpha: Annotated[float, typer.Option(help="Rate of false alarms.")] = 0.05,
    seed: Annotated[int, typer.Option(min=0, help="Of the simulated p-values and of the starts.")] = 0,
    workers: Annotated[int | None, typer.Option(min=1, help="Runs at a time; all cores by default.")] = None,
    retry_failed: RetryFailed = False,
    settings: Settings = [],  # noqa: B006 (typer copies it)
    json: Json = False,  # noqa: ARG001 (read by the frame)
) -> dict[str, Any]:
    """Trace the residual of the calibrated model to an effect that it lacks, or say why it cannot be attributed.

    Example: birdstrike diagnose demo --measured table7_group5 --out diagnosis
    """
    from birdstrike.inversion.diagnosis.diagnose import Wishes, diagnose
    from birdstrike.reports.page.diagnosis import write_diagnosis_page
    from birdstrike.solver.case.case import load_case

    wishes = Wishes(alpha, seed, workers, display=shown, counter=campaign_bar, say=say)
    found = diagnose(load_case(case, overrides(settings)), measured, out, doe, heldout, wishes, retry_failed)
    page = write_diagnosis_page(out)
    warn(found.warnings, f"{out / 'diagnosis.json'}")
    for line in lines(found):
        say(line)
    console.print(table(found))
    for line in closing(found, out, page):
        say(line)
    return {"out": str(out), "diagnosis": str(out / "diagnosis.json"), "page": str(page), **summary(found)}


def shown(label: str) -> AbstractContextManager[Callable[[float], None]]:
    """A bar of its own for each part of the work."""
    return progress_bar(label)


def lines(found: Diagnosis) -> Iterator[str]:
    """What stands above the table: provenance, noise, the verdict in words."""
    from birdstrike.inversion.diagnosis.words import HEADS
    from birdstrike.inversion.formatting import quantity

    if found.record["simulated"]:
        yield f"record: {found.record['path']} is simulated, not measured"
    for name, entry in found.noise["sensors"].items():
        unit = found.curves[name]["unit"]
        share = f"numerical error is {100 * entry['numerical_share']:.0f} % of the whole"
        yield f"noise of {name}: {quantity(entry['sigma'], unit, 2)} ({entry['source']}); {share}"
    for entry in found.tolerances:
        models = ", ".join(entry["confidence_set"]) or "no model"
        tolerance = f"{100 * entry['tolerance']:g} % of the peak"
        after = f" -> {entry['after']['weighted']:.2f}" if entry["after"] else ""
        error = f"weighted RMS {entry['before']['weighted']:.2f}{after}"
        yield f"at a tolerance of {tolerance}: {HEADS[entry['verdict']].lower()} ({models}), {error}"
    yield f"{HEADS[found.verdict]}. {found.sentence}"


def table(found: Diagnosis) -> Table:
    """Every model: its p-value, its magnitude, the smallest magnitude that could have been detected."""
    title = f"effects; * consistent with the record (p of at least {found.alpha:g}), the likeliest first"
    shown_table = Table(title=title, title_justify="left")
    shown_table.add_column("effect", no_wrap=True)
    for head in ("p", "magnitude (95 %)", "detectable", "absorbed"):
        shown_table.add_column(head, overflow="fold", justify="left" if head == "magnitude (95 %)" else "right")
    for one in found.effects:
        shown_table.add_row(*_cells(found, one))
    return shown_table


def _cells(found: Diagnosis, one: EffectFigures) -> tuple[str, ...]:
    from birdstrike.inversion.diagnosis.words import magnitude_words
    from birdstrike.solver.case.effects import shown as with_unit
    from birdstrike.solver.effects.registry import effects

    mark = "* " if one.name in found.confidence_set else "  "
    least = found.minimum_detectable.get(one.name)
    known = effects().get(one.name)
    detectable = "-" if least is None or known is None else with_unit(known, least, 2).lstrip("+")
    share = "-" if one.absorbed is None else f"{100 * one.absorbed:.0f} %"
    size = "at its bound" if one.at_bound else magnitude_words(one) or "-"
    return f"{mark}{one.name}", f"{one.p_consistent:.3f}", size, detectable, share


def closing(found: Diagnosis, out: Path, page: Path) -> Iterator[str]:
    """Before and after, the next measurement, files."""
    yield before_after(found)
    yield from hidden(found)
    for pair in found.pairs:
        yield f"pair that the data allow: {' and '.join(pair['effects'])} (p = {pair['p_consistent']:.2f})"
    if found.remainder is not None:
        yield found.remainder.sentence
    if found.next_measurement is not None:
        yield f"next measurement: {found.next_measurement.sentence}"
    runs = found.strikes
    paid = f"{runs['paid']} more made, {runs['reused']} found in the store"
    yield f"simulations: {runs['campaign']} of the campaign, {paid}"
    files = ["diagnosis.json", "diagnosis.csv", page.name, "before_after.png", "effects.png"]
    yield f"Written to {out}: {', '.join(files + ([found.case_after] if found.case_after else []))}"
    if found.case_after:
        yield f"Next: birdstrike simulate {out / found.case_after} --out run (the case with the effect in it)"


def before_after(found: Diagnosis) -> str:
    """The error in the sensors' units and against the noise, of one simulation at each fit; and held out."""
    from birdstrike.inversion.formatting import quantity

    parts: list[str] = []
    first, last = found.before.error, found.after.error if found.after else None
    for name, value in first["rmse"].items():
        unit = found.curves[name]["unit"]
        after = f" -> {quantity(last['rmse'][name], unit)}" if last else ""
        parts.append(f"{name} {quantity(value, unit)}{after}")
    weighted = f"{first['weighted']:.2f}" + (f" -> {last['weighted']:.2f}" if last else "")
    held = [
        f"{name.replace('_', ' ')} {one.before:.2f}{f' -> {one.after:.2f}' if one.after is not None else ''}"
        for name, one in found.held_out.items()
    ]
    tail = f"; held out: {', '.join(held)}" if held else ""
    arrow = " before -> after" if found.after else ""
    return f"error{arrow}: {', '.join(parts)}; against noise and numerical error (1 = noise) {weighted}{tail}"


def hidden(found: Diagnosis) -> Iterator[str]:
    """Effects that the calibrated parameters could absorb."""
    lost = [one.name for one in found.effects if one.absorbed is not None and one.absorbed > 0.9]
    if lost:
        yield f"not identifiable, more than 90 % absorbed by the calibrated parameters: {', '.join(lost)}"


def summary(found: Diagnosis) -> dict[str, Any]:
    """What the --json line carries."""
    return {
        "verdict": found.verdict,
        "confidence_set": list(found.confidence_set),
        "unnamed": found.unnamed,
        "weighted_before": found.before.error["weighted"],
        "weighted_after": found.after.error["weighted"] if found.after else None,
        "case_after": found.case_after,
        "warnings": list(found.warnings),
    }
