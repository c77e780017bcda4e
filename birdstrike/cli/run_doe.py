"""`birdstrike run-doe`: a campaign of strikes over the parameters of a case."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.table import Table

from birdstrike.cli.campaign_bar import campaign_bar
from birdstrike.cli.frame import Json, Settings, console, framed, overrides, progress_bar, say
from data.errors import RunFailed

if TYPE_CHECKING:
    from data.dataset import Dataset
    from doe.campaign import Progress
    from doe.designs import Design
    from doe.quality import Quality
    from solver.case import Case

RUNS = 25


def run_doe(
    case: str | Path | Case,
    out: str | Path,
    design: str | Path = "uniform",
    runs: int = RUNS,
    seed: int = 0,
    workers: int | None = None,
    *,
    progress: Callable[[Progress], None] = lambda _: None,
    say: Callable[[str], None] = warnings.warn,
) -> Dataset:
    """Run the campaign, or what is left of it, and return the strikes that finished (see doe.campaign).

    design: uniform, orthogonal, lhs, sobol, or a CSV file, of which all rows are run. The workers are started afresh: a
    script that calls this needs `if __name__ == "__main__":`.
    """
    from doe.campaign import run_campaign
    from doe.designs import make_design
    from doe.space import ParameterSpace
    from solver.case import load_case

    loaded = load_case(case) if isinstance(case, str | Path) else case
    planned = make_design(design, ParameterSpace.of_case(loaded), runs, seed)
    return run_campaign(loaded, planned, out, workers=workers, progress=progress, say=say)


@framed
def command(
    case: Annotated[str, typer.Argument(help="A case file, or the name of a shipped case.")],
    out: Annotated[Path, typer.Option(help="Folder of the campaign; run again to resume.")],
    design: Annotated[
        str, typer.Option(help="uniform, orthogonal, lhs, sobol, or a CSV file of runs.", metavar="NAME|FILE")
    ] = "uniform",
    runs: Annotated[int, typer.Option(help="Number of strikes; a FILE is run whole.")] = RUNS,
    seed: Annotated[int, typer.Option(help="The same seed gives the same design.")] = 0,
    workers: Annotated[int | None, typer.Option(help="Strikes at a time; all cores by default.")] = None,
    settings: Settings = [],  # noqa: B006 (typer copies it)
    json: Json = False,  # noqa: ARG001 (read by the frame)
) -> dict[str, Any]:
    """Run the strikes of a design: the data from which the bird's parameters are learnt.

    Example: birdstrike run-doe reference_strike --out campaign --design uniform --runs 25 --seed 0
    """
    from doe.campaign import run_campaign
    from solver.case import load_case

    loaded = load_case(case, overrides(settings))
    planned = _plan(loaded, design, runs, seed)
    quality = planned.quality()
    console.print(quality_table(planned, quality))
    with campaign_bar() as progress:
        run_campaign(loaded, planned, out, workers=workers, progress=progress, say=say)
    return _conclude(out, len(planned.numbers), quality)


def _plan(case: Case, design: str, runs: int, seed: int) -> Design:
    from doe.designs import make_design
    from doe.space import ParameterSpace

    with progress_bar("design") as progress:
        return make_design(design, ParameterSpace.of_case(case), runs, seed, progress)


def quality_table(design: Design, quality: Quality) -> Table:
    """What the design can tell apart, before any strike is paid for."""
    seed = "" if design.seed is None else f", seed {design.seed}"
    table = Table(title=f"{design.source or design.kind} design, {quality.runs} runs{seed}", title_justify="left")
    table.add_column("quality")
    table.add_column("value", justify="right")
    table.add_column("ideal", justify="right")
    discrepancy = "runs outside the ranges" if quality.discrepancy is None else f"{quality.discrepancy:.5f}"
    table.add_row("rank", str(quality.rank), str(quality.parameters))
    table.add_row("condition", f"{quality.condition:.3g}", "1")
    table.add_row("largest correlation", f"{quality.max_correlation:.3f}", "0")
    table.add_row("centred discrepancy (squared)", discrepancy, "small")
    return table


def _conclude(out: Path, planned: int, quality: Quality) -> dict[str, Any]:
    """The last lines; RunFailed when strikes had to be left out, after everything has been written."""
    from doe.folder import read_json

    summary = read_json(out / "summary.json")
    finished = planned - len(summary["failed"])
    say(f"Written to {out}: {finished} of {planned} strikes (design.csv, curves.csv, summary.json, runs/).")
    allowed = " --allow-rank-deficient" if quality.deficient else ""
    say(f"Next: birdstrike train-and-invert {out} --measured shot.csv --out inversion{allowed}")
    if summary["failed"]:
        numbers = ", ".join(str(entry["run"]) for entry in summary["failed"])
        raise RunFailed(
            f"{len(summary['failed'])} of {planned} strikes failed and are left out: run {numbers}",
            f"their reasons stand in {out / 'summary.json'}; the other strikes can be used",
        )
    return {"out": str(out), "runs": planned, "finished": finished, "failed": [], "design": quality.as_json()}
