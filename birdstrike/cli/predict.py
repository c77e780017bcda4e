"""`birdstrike predict`: another shot, with bands and where they come from."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.table import Table

from birdstrike.cli.campaign_bar import campaign_bar
from birdstrike.cli.frame import console, framed, progress_bar, say, warn
from birdstrike.cli.options import Json, RetryFailed, Settings, Workers, names_of, overrides
from birdstrike.data.errors import UserError

if TYPE_CHECKING:
    from birdstrike.inversion.prediction.answer import Prediction

REPORTED = 0.01  # share of the variance from which on a source is printed


@framed
def command(
    case: Annotated[str, typer.Argument(help="The new shot: a case file, or the name of a shipped case.")],
    learnt: Annotated[
        Path,
        typer.Option(
            "--from", help="Results folder of train-and-invert, diagnose, calibrate-models or close-the-loop."
        ),
    ],
    out: Annotated[Path, typer.Option(help="Folder of the prediction; run again to resume.")],
    limit: Annotated[
        list[str], typer.Option(metavar="SENSOR=VALUE", help='--limit displacement_centre="8 mm"; may be repeated.')
    ] = [],  # noqa: B006 (typer copies it)
    tolerance: Annotated[
        list[str],
        typer.Option(metavar="KEY=VALUE", help='One standard deviation: --tolerance impact.speed="1 m/s"; repeatable.'),
    ] = [],  # noqa: B006
    budget: Annotated[int, typer.Option(help="Simulations of the new case, 8 to 2000.")] = 40,
    leave_behind: Annotated[
        str, typer.Option(metavar="NAME,...", help="Effects that do not go with the new case.")
    ] = "",
    only: Annotated[
        str, typer.Option(metavar="NAME,...", help="Explanations that are used; all of the 95 % set by default.")
    ] = "",
    seed: Annotated[int, typer.Option(min=0, help="Of the draws and of the emulator.")] = 0,
    workers: Workers = None,
    retry_failed: RetryFailed = False,
    settings: Settings = [],  # noqa: B006
    json: Json = False,  # noqa: ARG001 (read by the frame)
) -> dict[str, Any]:
    """Predict what the sensors of another shot will read, from what a results folder has learnt.

    Example: birdstrike predict demo --from loop --set impact.speed="95 m/s" --out prediction

    The folder loop: birdstrike close-the-loop demo --measured table7_group5 --out loop

    With a limit: birdstrike predict demo --from loop --limit displacement_centre="8 mm" --out limit

    With a tolerance: birdstrike predict demo --from loop --tolerance impact.speed="1 m/s" --out tolerance
    """
    from birdstrike.inversion.prediction.predict import PredictOptions, predict
    from birdstrike.reports.page.prediction import write_prediction_page
    from birdstrike.solver.case.case import load_case

    new = load_case(case, overrides(settings))
    with progress_bar("emulator of the new case") as advance:
        options = PredictOptions(
            limits=_pairs("--limit", "displacement_centre", "8 mm", limit),
            tolerances=_pairs("--tolerance", "impact.speed", "1 m/s", tolerance),
            budget=budget,
            seed=seed,
            workers=workers,
            leave_behind=names_of(leave_behind, "--leave-behind", "clamp_rotation"),
            only=names_of(only, "--only", "none"),
            retry_failed=retry_failed,
            counter=campaign_bar,
            progress=advance,
        )
        found = predict(new, learnt, out, options)
    page = write_prediction_page(out)
    for line in reach(found):
        say(line)
    warn(found.warnings, str(out / "prediction.json"))
    for line in rests_on(found):
        say(line)
    console.print(table(found))
    for line in closing(found, out, page):
        say(line)
    return {
        "out": str(out),
        "prediction": str(out / "prediction.json"),
        "page": str(page),
        **{key: found.figures()[key] for key in ("extrapolation", "limits", "peaks", "sources", "perforation")},
        "warnings": list(found.warnings),
    }


def _pairs(option: str, key: str, value: str, given: list[str]) -> dict[str, str]:
    """Names and texts of `NAME=VALUE` options; raises UserError for what is no such pair, or stands twice."""
    found, errors = dict[str, str](), list[str]()
    for text in given:
        name, sign, content = (part.strip() for part in text.partition("="))
        if not (sign and name and content):
            errors.append(f'{option} {text}: write {option} {key}="{value}"')
        elif name in found:
            errors.append(f"{option} {name} is given twice: {found[name]} and {content}; name it once")
        found[name] = content
    if errors:
        raise UserError(errors)
    return found


def reach(found: Prediction) -> Iterator[str]:
    """What lies outside the learnt range, before all else."""
    if found.extrapolation:
        yield f"Outside what was learnt: {'; '.join(found.extrapolation)}."
        yield f"The model error's standard deviation is {found.growth:.3g} times as large as at the learnt shots."
    else:
        yield "Inside what was learnt: speed, energy, pressure and thickness lie within the range of the learnt shots."


def rests_on(found: Prediction) -> Iterator[str]:
    """What was used of the folder, and the explanations."""
    from birdstrike.inversion.labels import in_words

    for text in found.posterior:
        yield f"used: {text}"
    for one in found.explanations:
        acts = "; ".join(f"{in_words(label)} {how}" for label, how in one.effects.items())
        yield f"explanation: {in_words(one.name)}, probability {one.probability:.2f}{f' ({acts})' if acts else ''}"


def table(found: Prediction) -> Table:
    """Largest reading of every sensor."""
    from birdstrike.data.formatting import plain, reading, span
    from birdstrike.data.units import of_reading

    shown = Table(title="largest reading", title_justify="left")
    for head in ("sensor", "median", "50 %", "95 %"):
        shown.add_column(head, overflow="fold", justify="left" if head == "sensor" else "right")
    for name, one in found.peaks.items():
        ends = (span(one[low], one[high], of_reading(one["unit"])) for low, high in (("q25", "q75"), ("q025", "q975")))
        shown.add_row(plain(name), reading(one["q50"], one["unit"]), *ends)
    return shown


def closing(found: Prediction, out: Path, page: Path) -> Iterator[str]:
    """Where the width comes from, limits, residual deflection, tearing, what to measure, files."""
    from birdstrike.data.formatting import plain, reading, span
    from birdstrike.data.units import of_reading
    from birdstrike.inversion.prediction.answer import limit_words, tearing_words

    for name, shares in found.sources.items():
        parts = sorted(((share, source) for source, share in shares.items() if share >= REPORTED), reverse=True)
        if parts:
            told = ", ".join(f"{source} {100.0 * share:.0f} %" for share, source in parts)
            yield f"variance of the largest {plain(name)}: {told}"
    for name, one in found.limits.items():
        yield limit_words(name, one)
    for name, own in found.residual.items():
        interval = span(own["q025"], own["q975"], of_reading(own["unit"]))
        yield f"{plain(name)} at the end of the simulation: {reading(own['q50'], own['unit'])} (95 %: {interval})"
    yield tearing_words(found.perforation)
    for one in found.narrowing[:1]:
        yield f"what would narrow it most: {one['sentence']}"
    counts = found.campaign
    yield f"simulations: {counts['paid']} run, {counts['reused']} found stored"
    yield f"Written to {out}: prediction.json, prediction.csv, {page.name}. Next: open {page} in a browser."
