"""`birdstrike audit`: the blind test of the diagnosis on experiments of known truth."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.table import Table

from birdstrike.cli.campaign_bar import campaign_bar
from birdstrike.cli.frame import Json, RetryFailed, console, framed, progress_bar, say


@framed
def command(
    out: Annotated[Path, typer.Option(help="Folder for audit.json, the page, campaigns and runs.")],
    experiments: Annotated[
        Path | None, typer.Option(help="Folder of <name>.toml, .csv and .truth.toml; by default the shipped ones.")
    ] = None,
    draws: Annotated[int, typer.Option(help="Draws of the noise on each curve.")] = 200,
    channels: Annotated[int | None, typer.Option(min=1, help="Only records of so many channels.")] = None,
    confirm: Annotated[
        bool, typer.Option(help="Ask the solver about each record's models, as diagnose does; without it: quick.")
    ] = True,
    alpha: Annotated[float, typer.Option(help="Rate of false alarms.")] = 0.05,
    seed: Annotated[int, typer.Option(min=0, help="Of the draws.")] = 0,
    workers: Annotated[int | None, typer.Option(min=1, help="Experiments at a time; all cores by default.")] = None,
    retry_failed: RetryFailed = False,
    json: Json = False,  # noqa: ARG001 (read by the frame)
) -> dict[str, Any]:
    """Score the diagnosis against the sealed truths of virtual experiments.

    Run again to resume: scores stay in OUT/scores as long as nothing that made them has changed.

    Example: birdstrike audit --out audit --channels 1
    """
    from birdstrike.data.files import write_atomically
    from birdstrike.data.paths import MEASURED
    from birdstrike.inversion.audit.audit import audit
    from birdstrike.inversion.diagnosis.diagnose import Wishes
    from birdstrike.reports.page.audit import audit_markdown, write_audit_page

    wishes = Wishes(alpha, seed, workers, counter=campaign_bar, say=say)
    folder = MEASURED / "virtual" if experiments is None else experiments
    with progress_bar("experiments") as progress:
        content = audit(
            folder,
            out,
            wishes=wishes,
            draws=draws,
            confirm=confirm,
            channels=channels,
            progress=progress,
            say=say,
            retry_failed=retry_failed,
        )
    for name, entry in content["tables"].items():
        console.print(table(name, entry))
    page = write_audit_page(out)
    write_atomically(out / "audit.md", audit_markdown(content))
    say(f"Written to {out}: audit.json, audit.md, {page.name}")
    missed = list(missing(content))
    say(f"acceptance criteria missed: {'; '.join(missed) if missed else 'none'}")
    return {"out": str(out), "audit": str(out / "audit.json"), "page": str(page), "missed": missed}


def table(name: str, entry: Mapping[str, Any]) -> Table:
    """Acceptance criteria with their figures."""
    shown = Table(title=f"{name}, {entry['curves']} curves", title_justify="left")
    for head in ("figure", "value", "bootstrap", "Clopper-Pearson", "criterion", "met"):
        shown.add_column(head, overflow="fold")
    for gate in entry["gates"]:
        ends = (_interval(gate["interval_95"]), _interval(gate["exact_95"]))
        shown.add_row(gate["figure"], _number(gate["value"]), *ends, gate["gate"], word(gate))
    return shown


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.3f}"


def _interval(ends: list[float] | None) -> str:
    return "-" if ends is None else f"{ends[0]:.3f} .. {ends[1]:.3f}"


def word(gate: Mapping[str, Any]) -> str:
    """Yes, no, or nothing to say."""
    return {None: "-", True: "yes", False: "no"}[gate["met"]]


def missing(content: Mapping[str, Any]) -> Iterator[str]:
    """Acceptance criteria that are missed."""
    for name, entry in content["tables"].items():
        yield from (f"{name}: {gate['figure']}" for gate in entry["gates"] if gate["met"] is False)
