"""`birdstrike audit`: the blind test of the diagnosis on records of known truth."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.table import Table

from birdstrike.cli.campaign_bar import campaign_bar
from birdstrike.cli.frame import console, framed, progress_bar, say
from birdstrike.cli.options import Json, RetryFailed, Workers

CASE = "audit_strike"
USUAL = {"make": 0, "make-forms": 0, "case": CASE, "draws": 1, "no-confirm": False, "alpha": 0.05, "seed": 0}
"""Values of options that go without saying; None does for every one."""


@framed
def command(
    out: Annotated[Path, typer.Option(help="Folder for audit.json, the page, answers and runs.")],
    experiments: Annotated[
        Path | None,
        typer.Option(help="Folder of <name>.toml, .csv and .truth.toml; by default the shipped ones, or those made."),
    ] = None,
    make: Annotated[
        int, typer.Option(min=0, help="Truths to draw from the seed and to simulate first; kept in OUT/experiments.")
    ] = 0,
    make_forms: Annotated[
        int, typer.Option(min=0, help="The same, by a deliberately different model of bird and plate.")
    ] = 0,
    case: Annotated[
        str | None, typer.Option(help="Declared case of the truths that are made.", show_default=CASE)
    ] = None,
    draws: Annotated[int, typer.Option(min=1, help="Draws of the noise on each record; 1: as it is.")] = 1,
    channels: Annotated[int | None, typer.Option(min=1, help="Only records of so many channels.")] = None,
    shots: Annotated[int | None, typer.Option(min=1, help="Only records of so many shots.")] = None,
    baselines: Annotated[
        str | None,
        typer.Option(
            metavar="KIND",
            help="Only records without a baseline (none), with one of another bird (another) or its own (own).",
        ),
    ] = None,
    most: Annotated[int | None, typer.Option(min=1, help="Records answered at most; run again for the others.")] = None,
    confirm: Annotated[
        bool, typer.Option(help="Run the solver at each record's fits, as diagnose does; without it: quick.")
    ] = True,
    alpha: Annotated[float, typer.Option(help="Rate of false alarms.")] = 0.05,
    seed: Annotated[int, typer.Option(min=0, help="Of the truths and of every diagnosis.")] = 0,
    workers: Workers = None,
    retry_failed: RetryFailed = False,
    json: Json = False,  # noqa: ARG001 (read by the frame)
) -> dict[str, Any]:
    """Score the diagnosis against the sealed truths of virtual experiments.

    Run again to resume: answers stay in OUT/answers as long as nothing that made them has changed.

    Example: birdstrike audit --out audit --make 100 --make-forms 100
    """
    from birdstrike.data.errors import RunFailed
    from birdstrike.data.formatting import many
    from birdstrike.data.paths import MEASURED
    from birdstrike.data.storage.files import write_atomically
    from birdstrike.inversion.audit.audit import audit
    from birdstrike.inversion.diagnosis.diagnose import DiagnosisOptions
    from birdstrike.reports.page.audit import audit_markdown, write_audit_page

    options = DiagnosisOptions(alpha=alpha, seed=seed, workers=workers, counter=campaign_bar, check=confirm)
    made = make > 0 or make_forms > 0
    with progress_bar("records") as progress:
        content = audit(
            MEASURED / "virtual" if experiments is None and not made else experiments,
            out,
            options=options,
            draws=draws,
            channels=channels,
            shots=shots,
            baselines=baselines,
            make=make,
            forms=make_forms,
            case=case,
            most=most,
            progress=progress,
            say=say,
            retry_failed=retry_failed,
            command=typed(
                {
                    "make": make,
                    "make-forms": make_forms,
                    "case": Path(case or CASE).name,
                    "draws": draws,
                    "channels": channels,
                    "shots": shots,
                    "baselines": baselines,
                    "most": most,
                    "no-confirm": not confirm,
                    "alpha": alpha,
                    "seed": seed,
                }
            ),
        )
    for name, entry in content["tables"].items():
        console.print(table(name, entry))
    page = write_audit_page(out)
    write_atomically(out / "audit.md", audit_markdown(content))
    say(f"Written to {out}: audit.json, audit.md, {page.name}")
    missed = list(missing(content))
    say(f"acceptance criteria missed: {'; '.join(missed) if missed else 'none'}")
    if not content["complete"]:
        say(f"{many(content['records'], 'record')} answered; a table needs {content['wanted']} truths")
    if not content["records"]:
        reason = next(iter(content["failed"].values()))
        raise RunFailed(
            f"no record has an answer; the first says: {reason}", f"all reasons: failed in {out}/audit.json"
        )
    return {"out": str(out), "audit": str(out / "audit.json"), "page": str(page), "missed": missed}


def typed(given: Mapping[str, Any]) -> str:
    """The command by what changes its figures, without paths of the machine; given: option -> value."""
    told = {name: value for name, value in given.items() if value is not None and value != USUAL.get(name)}
    options = [f"--{name}" if value is True else f"--{name} {value}" for name, value in told.items()]
    return " ".join(["birdstrike audit --out audit", *options])


def table(name: str, entry: Mapping[str, Any]) -> Table:
    """Acceptance criteria with their figures."""
    from birdstrike.data.formatting import many

    heading = f"{name}: {many(entry['curves'], 'truth')}, {many(entry['records'], 'record')}"
    shown = Table(title=heading, title_justify="left")
    for head in ("figure", "value", "bootstrap", "Clopper-Pearson", "criterion", "met"):
        shown.add_column(head, overflow="fold")
    for criterion in entry["gates"]:
        ends = (_interval(criterion["interval_95"]), _interval(criterion["exact_95"]))
        shown.add_row(criterion["figure"], _number(criterion["value"]), *ends, criterion["gate"], word(criterion))
    return shown


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.3f}"


def _interval(ends: list[float] | None) -> str:
    return "-" if ends is None else f"{ends[0]:.3f} .. {ends[1]:.3f}"


def word(criterion: Mapping[str, Any]) -> str:
    """Yes, no, or nothing to say."""
    return {None: "-", True: "yes", False: "no"}[criterion["met"]]


def missing(content: Mapping[str, Any]) -> Iterator[str]:
    """Acceptance criteria that are missed."""
    for name, entry in content["tables"].items():
        yield from (f"{name}: {criterion['figure']}" for criterion in entry["gates"] if criterion["met"] is False)
