"""`birdstrike diagnose`: is the residual of the calibrated model real, and which effect does the model lack?"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.table import Table

from birdstrike.cli.campaign_bar import campaign_bar
from birdstrike.cli.frame import console, framed, progress_bar, say, warn
from birdstrike.cli.next_steps import following
from birdstrike.cli.options import (
    BaselineBird,
    BaselineCases,
    Baselines,
    Channels,
    Json,
    RetryFailed,
    Settings,
    ShotCases,
    ShotRecords,
    Workers,
    names_of,
    overrides,
    refinement_runs,
)
from birdstrike.data.progress import Progress, no_display
from birdstrike.stages import STILL_VALID, Ledger, Stage, inputs_of_diagnosis, run_stages

if TYPE_CHECKING:
    from birdstrike.inversion.results.diagnosis import Diagnosis

MOST_ROWS = 12


@framed
def command(
    case: Annotated[str, typer.Argument(help="A case file, or the name of a shipped case: the model as declared.")],
    measured: ShotRecords,
    out: Annotated[Path, typer.Option(help="Folder of the diagnosis; run again to resume.")],
    shot_case: ShotCases = [],  # noqa: B006 (typer copies it)
    baseline: Baselines = [],  # noqa: B006
    baseline_case: BaselineCases = [],  # noqa: B006
    baseline_bird: BaselineBird = None,
    doe: Annotated[Path | None, typer.Option(help="Folder of a campaign whose runs are used where they fit.")] = None,
    heldout: Annotated[str | None, typer.Option(help="Another record of the same case, kept out of every fit.")] = None,
    channels: Channels = "",
    alpha: Annotated[float, typer.Option(help="Rate of false alarms.")] = 0.05,
    refine: Annotated[
        str,
        typer.Option(
            help="Runs that may be added near the fits; auto: up to 10 a case, while the emulator widens intervals."
        ),
    ] = "auto",
    seed: Annotated[int, typer.Option(min=0, help="Of the design and of the simulated p-values.")] = 0,
    workers: Workers = None,
    retry_failed: RetryFailed = False,
    settings: Settings = [],  # noqa: B006
    json: Json = False,  # noqa: ARG001 (read by the frame)
) -> dict[str, Any]:
    """Trace the residual of the calibrated model to an effect that it lacks, or say why that is not possible.

    Case and records of the first example are shipped; it takes some 4 minutes on two idle cores.

    Example: birdstrike diagnose demo_rig --measured openradioss_speed96 --baseline openradioss_clean1 --out diagnosis

    With a campaign of your own: birdstrike diagnose shot.toml --measured shot.csv --doe campaign --out diagnosis
    """
    from birdstrike.data.paths import resolve_measured
    from birdstrike.inversion.diagnosis.diagnose import DiagnosisOptions, diagnose
    from birdstrike.inversion.results.diagnosis import Diagnosis
    from birdstrike.reports.page.diagnosis import write_diagnosis_page
    from birdstrike.solver.case.case import load_case

    options = DiagnosisOptions(
        alpha, seed, workers, display=shown, counter=campaign_bar, refine=refinement_runs(refine)
    )
    first = load_case(case, overrides(settings))
    cases = [first, *(load_case(one, overrides(settings)) for one in shot_case)]
    clean = [load_case(one, overrides(settings)) for one in baseline_case]
    named = names_of(channels)

    def inputs() -> dict[str, Any]:
        records = [*measured, *(baseline or first.diagnosis.baselines), *([heldout] if heldout else [])]
        return inputs_of_diagnosis(
            [*cases, *clean],
            [resolve_measured(one) for one in records],
            counts=(len(measured), len(baseline)),
            alpha=alpha,
            seed=seed,
            refine=refine,
            channels=named,
            baseline_bird=baseline_bird,
        )

    def run(_: Progress) -> None:
        diagnose(cases, measured, out, doe, heldout, options, retry_failed, baseline, clean, named, baseline_bird)

    outputs = tuple(out / name for name in ("diagnosis.json", "diagnosis.csv", "model.npz"))
    stage = Stage("diagnosis", "The diagnosis of this call", inputs, outputs, run, lambda: retry_failed)
    run_stages((stage,), Ledger(out / "stages.json"), _if_still_valid)
    found = Diagnosis.read(out / "diagnosis.json")
    page = write_diagnosis_page(out)
    warn(found.warnings, f"{out / 'diagnosis.json'}")
    for line in lines(found):
        say(line)
    console.print(table(found))
    for line in closing(found, out, page):
        say(line)
    return {"out": str(out), "diagnosis": str(out / "diagnosis.json"), "page": str(page), **summary(found)}


def _if_still_valid(heading: str) -> AbstractContextManager[Progress]:
    """Says that the same call was answered before; one that is computed has bars of its own."""
    if heading.endswith(STILL_VALID):
        say(heading)
    return no_display(heading)


def shown(label: str) -> AbstractContextManager[Progress]:
    """A bar of its own for each part of the work."""
    return progress_bar(label)


def lines(found: Diagnosis) -> Iterator[str]:
    """What stands above the table: provenance, model error, the verdict in words."""
    if len(found.shots) > 1:
        yield f"records: {', '.join(found.record['shots'])}. {found.provenance}"
    elif found.record["simulated"]:
        yield f"record: {found.record['path']} is simulated, not measured"
    yield f"model-form error: {found.discrepancy['source']}"
    yield found.conclusion


def table(found: Diagnosis) -> Table:
    """The likeliest effects, each with its probability alone and in pairs; the sentence's is that of one model."""
    from birdstrike.inversion.results.diagnosis_text import magnitude_words

    shown_table = Table(
        title="effects, alone and in pairs, the likeliest first; * alone in the 95 % set", title_justify="left"
    )
    shown_table.add_column("effect", no_wrap=True)
    for head in ("probability", "magnitude (95 %)", "required model error"):
        shown_table.add_column(head, overflow="fold", justify="left" if head.startswith("magnitude") else "right")
    for one in found.listed[:MOST_ROWS]:
        mark = "* " if one.name in found.confidence_set else "  "
        share = one.required_discrepancy
        need = "-" if share is None else f"{100 * share:.2g} %"
        shown_table.add_row(f"{mark}{one.name}", f"{one.probability:.3f}", magnitude_words(one) or "-", need)
    return shown_table


def closing(found: Diagnosis, out: Path, page: Path) -> Iterator[str]:
    """Before and after, pairs, what to do, files."""
    from birdstrike.inversion.labels import changes, runs_near_the_fits
    from birdstrike.inversion.results.diagnosis import errors
    from birdstrike.inversion.results.diagnosis_text import next_step

    for shot in found.shots:
        first, last = errors(shot.before, shot.after)
        where = f" in shot {shot.name}" if len(found.shots) > 1 else ""
        for key, words in (("rmse_less_baseline", " less what the baseline shows"), ("rmse", "")):
            if before := getattr(first, key):
                told = changes(before, getattr(last, key) if last else None, found.units)
                yield f"RMS error{where}{words}{', before -> after' if last else ''}: {told}"
    for pair in found.pairs[:3]:
        yield f"pair in the 95 % set: {' and '.join(pair['effects'])} (probability {pair['probability']:.2f})"
    yield f"what to do: {next_step(found)}"
    yield f"simulations: {found.strikes['paid']} run, {found.strikes['reused']} found stored"
    if found.strikes.get("refinement"):
        yield runs_near_the_fits(found.strikes["refinement"])
    files = ["diagnosis.json", "diagnosis.csv", page.name] + ([found.case_after] if found.case_after else [])
    yield f"Written to {out}: {', '.join(files)}. {_after(found, out)}"


def _after(found: Diagnosis, out: Path) -> str:
    """The case with the named effect, else the report with all that has been found."""
    if found.case_after:
        return following("check", out / found.case_after)
    return following("report", out.parent if out.name == "diagnosis" else out)


def summary(found: Diagnosis) -> dict[str, Any]:
    """What the --json line carries."""
    from birdstrike.inversion.results.diagnosis import errors

    before, after = errors(found.before, found.after)
    return {
        "verdict": found.verdict,
        "confidence_set": list(found.confidence_set),
        "unnamed": found.unnamed,
        "probabilities": {
            name: found.probabilities[name] for name in found.confidence_set if name in found.probabilities
        },
        "alarm": found.alarm,
        "weighted_before": before.weighted,
        "weighted_after": after.weighted if after else None,
        "case_after": found.case_after,
        "warnings": list(found.warnings),
    }
