"""`birdstrike close-the-loop`: from a case and a record to the report, stage by stage, resumable."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

from birdstrike.cli.frame import framed, progress_bar, say, warn
from birdstrike.cli.next_steps import command_line
from birdstrike.cli.options import (
    BaselineBird,
    BaselineCases,
    Baselines,
    CaseName,
    Channels,
    Json,
    RetryFailed,
    Settings,
    Workers,
    names_of,
    overrides,
)
from birdstrike.data.errors import RunFailed, UserError
from birdstrike.data.progress import Progress

DESIGN, RUNS = "uniform", 25


class LoopTrainer(StrEnum):
    """How the network is trained."""

    lm = "lm"
    adam = "adam"


@framed
def command(
    case: CaseName,
    measured: Annotated[
        str, typer.Option(help="Measured-data CSV of one shot, or the name of a shipped curve; of several: diagnose.")
    ],
    out: Annotated[Path, typer.Option(help="Folder of the loop; run again to resume.")],
    design: Annotated[
        str, typer.Option(help="uniform, orthogonal, lhs, sobol, or a CSV file of runs.", metavar="NAME|FILE")
    ] = DESIGN,
    runs: Annotated[int, typer.Option(help="Number of runs; a FILE is run whole.")] = RUNS,
    seed: Annotated[int, typer.Option(min=0, help="Of the design, the network and the emulator's fit.")] = 0,
    workers: Workers = None,
    trainer: Annotated[LoopTrainer, typer.Option(help="Levenberg-Marquardt or Adam.")] = LoopTrainer.lm,
    diagnosis: Annotated[bool, typer.Option(help="Trace the residual to an effect that the model lacks.")] = True,
    channels: Channels = "",
    baseline: Baselines = [],  # noqa: B006 (typer copies it)
    baseline_case: BaselineCases = [],  # noqa: B006
    baseline_bird: BaselineBird = None,
    doe: Annotated[
        Path | None,
        typer.Option(help="Finished campaign of run-doe of the same case, taken in place of the loop's own."),
    ] = None,
    heldout: Annotated[
        str | None, typer.Option(help="Another record of the same case, kept out of every fit of the diagnosis.")
    ] = None,
    retry_failed: RetryFailed = False,
    settings: Settings = [],  # noqa: B006 (typer copies it)
    json: Json = False,  # noqa: ARG001 (read by the frame)
) -> dict[str, Any]:
    """Campaign, inversion, verification, diagnosis and report in one go; what is still valid is not done again.

    Example: birdstrike close-the-loop demo --measured table7_group5 --out loop

    With a campaign at hand: birdstrike close-the-loop shot.toml --measured shot.csv --doe campaign --out loop
    """
    from birdstrike.loop import close_the_loop
    from birdstrike.solver.case.case import load_case

    if doe is not None and (design, runs) != (DESIGN, RUNS):
        raise UserError(f"--design and --runs are those of the campaign in {doe}; leave them out beside --doe")
    closed = close_the_loop(
        load_case(case, overrides(settings)),
        measured,
        out,
        design=design,
        runs=runs,
        seed=seed,
        workers=workers,
        trainer=trainer.value,
        diagnosis=diagnosis,
        retry_failed=retry_failed,
        channels=names_of(channels),
        baseline=baseline,
        baseline_case=[load_case(one, overrides(settings)) for one in baseline_case],
        baseline_bird=baseline_bird,
        doe=doe,
        heldout=heldout,
        display=stage_display,
        say=lambda line: say(f"  {line}"),
    )
    _last_lines(closed, out)
    return closed


@contextmanager
def stage_display(heading: str) -> Iterator[Progress]:
    """A line with the stage's heading, and its bar below."""
    say(heading)
    with progress_bar(f"  {heading.split(':')[0].lower()}") as progress:
        yield progress


def _last_lines(closed: Mapping[str, Any], out: Path) -> None:
    """Warnings, the report's path, the five findings, the diagnosis; RunFailed when runs had to be left out."""
    warn(closed["warnings"], "the report")
    seconds = {name: stage["seconds"] for name, stage in closed["stages"].items() if not stage["reused"]}
    parts = ", ".join(f"{name} {spent:.0f} s" for name, spent in seconds.items())
    say(f"Time: {parts}." if parts else "Nothing was due.")
    say(f"Report: {closed['paths']['report']}")
    for number, line in enumerate(closed["findings"], 1):
        say(f"{number}. {line}")
    if closed.get("diagnosis"):
        for line in diagnosis_lines(closed["diagnosis"]):
            say(line)
    for line in closed["stated"]:
        say(f"The record's file states: {line}")
    say(f"Next: open {closed['paths']['report']} in a browser; the cards: {command_line('export', out)}")
    if failed := closed["failed_strikes"]:
        raise RunFailed(
            f"runs of the campaign failed and are left out: {', '.join(failed)}",
            "the report stands on the others and gives the reasons; --retry-failed tries them again",
        )


def diagnosis_lines(answer: Mapping[str, Any]) -> Iterator[str]:
    """The diagnosis in one sentence; the likeliest model, its probability and magnitude; the error before and after."""
    from birdstrike.inversion.labels import changes

    yield f"Diagnosis: {answer['sentence'].rstrip('.')}."
    if one := answer.get("likeliest"):
        size = f", magnitude {one['magnitude_words']}" if one["magnitude_words"] else ""
        yield f"Likeliest: {one['name']} ({one['meaning']}), probability {one['probability']:.2f}{size}."
    for which, words in (("_less_baseline", " less what the baseline shows of this rig"), ("", "")):
        first, last = answer.get(f"before{which}"), answer.get(f"after{which}")
        if first and last:
            told = changes(first, last, answer["units"])
            yield f"RMS error{words}, calibrated without it -> with it: {told}."
