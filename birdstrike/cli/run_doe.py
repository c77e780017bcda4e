"""`birdstrike run-doe`: a campaign of simulations over the parameters of a case."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.table import Table

from birdstrike.cli.campaign_bar import campaign_bar
from birdstrike.cli.frame import console, framed, progress_bar, say, warn
from birdstrike.cli.next_steps import command_line, following, record_here, set_again
from birdstrike.cli.options import CaseName, Json, RetryFailed, Settings, Workers, overrides
from birdstrike.data.errors import RunFailed
from birdstrike.data.formatting import many

if TYPE_CHECKING:
    from birdstrike.data.dataset import Dataset
    from birdstrike.doe.campaign.runner import RunCounts
    from birdstrike.doe.designs.design import Design
    from birdstrike.doe.designs.quality import Quality
    from birdstrike.solver.case.case import Case, CaseSource

RUNS = 25


def run_doe(
    case: CaseSource,
    out: str | Path,
    design: str | Path = "uniform",
    runs: int = RUNS,
    seed: int = 0,
    workers: int | None = None,
    *,
    scheduler: str | None = None,
    retry_failed: bool = False,
    progress: Callable[[RunCounts], None] = lambda _: None,
    say: Callable[[str], None] = warnings.warn,
) -> Dataset:
    """Run the campaign, or what is left of it, and return the runs that finished.

    The workers are started afresh: a script that calls this needs `if __name__ == "__main__":`.

    Parameters
    ----------
    case : path, table or Case
        What is varied and how far is its `inversion.parameters`.
    out : path
        Folder of the campaign; the same call resumes.
    design : str or path
        "uniform", "orthogonal", "lhs", "sobol", or a CSV file, of which all rows are run.
    runs : int
        At least 2; more than the campaign in `out` has are added to it.
    seed : int
        Of the design, 0 or more.
    workers : int, optional
        Runs at a time, one core each; all cores by default.
    scheduler : str, optional
        Address of a Dask scheduler, such as "tcp://host:8786".
    retry_failed : bool
        Whether runs with a failure on record are tried again.
    progress : callable
        Takes the RunCounts after each run.
    say : callable
        Takes what the user should know, one line at a time.

    Returns
    -------
    Dataset
        Of the r runs that finished: `parameters` (r, k) and `curves` {sensor: (r, n)}, SI, `time` (n,) [s].

    Raises
    ------
    UserError
        For a case, a design or a count that cannot be, and for a folder of another case or design.
    RunFailed
        Where no run finishes; else failed runs are left out by number.
    """
    from birdstrike.doe.campaign.campaign import run_campaign
    from birdstrike.doe.campaign.planned import planned_design
    from birdstrike.doe.campaign.run import retry_before
    from birdstrike.doe.designs.space import ParameterSpace
    from birdstrike.solver.case.case import as_case

    loaded = as_case(case)
    planned = planned_design(design, ParameterSpace.of_case(loaded), runs, seed, out)
    return run_campaign(
        loaded,
        planned,
        out,
        workers=workers,
        scheduler=scheduler,
        retry=retry_before(retry_failed),
        progress=progress,
        say=say,
    )


@framed
def command(
    case: CaseName,
    out: Annotated[Path, typer.Option(help="Folder of the campaign; run again to resume or extend.")],
    design: Annotated[
        str,
        typer.Option(
            help="uniform: even spread, any number of runs. orthogonal: 9, 16, 25, 27, 49, ... runs, every pair of "
            "levels equally often. lhs: random Latin hypercube. sobol: a sequence. Or a CSV file: the columns are the "
            "case's parameters with their units, one row a run.",
            metavar="NAME|FILE",
        ),
    ] = "uniform",
    runs: Annotated[
        int,
        typer.Option(help="Number of runs; more than the folder holds are added to them. A FILE is run whole."),
    ] = RUNS,
    seed: Annotated[int, typer.Option(help="The same seed gives the same design.")] = 0,
    workers: Workers = None,
    scheduler: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="A Dask cluster in place of this machine: tcp://host:8786.")
    ] = None,
    retry_failed: RetryFailed = False,
    settings: Settings = [],  # noqa: B006 (typer copies it)
    json: Json = False,  # noqa: ARG001 (read by the frame)
) -> dict[str, Any]:
    """Run the simulations of a design: the data from which the bird's parameters are calibrated.

    The case says what is varied and how far (inversion.parameters). Whatever
    stops the campaign, the same command resumes it and loses at most the
    runs in progress. A run that fails is tried once more with half the
    step (by an external solver only where its deck holds step_factor), then
    left out by number. The folder gets design.csv, curves.csv,
    projections.svg, summary.json and runs/, one file a run. It can be
    moved, and the runs/ of two campaigns merged, by copying; what it holds:
    birdstrike check FOLDER.

    Example: birdstrike run-doe reference_strike --out campaign --design uniform --runs 25 --seed 0

    Then, 15 more: birdstrike run-doe reference_strike --out campaign --runs 40
    """
    from birdstrike.doe.campaign.campaign import run_campaign
    from birdstrike.doe.campaign.run import retry_before
    from birdstrike.solver.case.case import load_case

    loaded = load_case(case, overrides(settings))
    planned = _plan(loaded, design, runs, seed, out)
    with campaign_bar() as progress:
        run_campaign(
            loaded,
            planned,
            out,
            workers=workers,
            scheduler=scheduler,
            retry=retry_before(retry_failed),
            claimed=lambda: show_design(planned, out / "projections.svg"),
            progress=progress,
            say=say,
        )
    again = ["run-doe", case, *set_again(settings), "--out", out, "--design", design, "--seed", str(seed)]
    return _conclude(out, loaded, planned, again)


def _plan(case: Case, design: str, runs: int, seed: int, out: Path) -> Design:
    from birdstrike.doe.campaign.planned import planned_design
    from birdstrike.doe.designs.space import ParameterSpace

    with progress_bar("design") as progress:
        return planned_design(design, ParameterSpace.of_case(case), runs, seed, out, progress)


def show_design(design: Design, picture: Path) -> None:
    """Print the design's quality and draw its projections, before any simulation is paid for."""
    console.print(quality_table(design, design.quality()))
    draw_projections(design, picture)


def draw_projections(design: Design, path: Path) -> None:
    """The runs seen two parameters at a time; nothing for a single parameter."""
    if len(design.names) < 2:
        return
    from birdstrike.data.storage.files import whole_file
    from birdstrike.reports.figures.design import design_figure
    from birdstrike.reports.figures.quantities import symbol

    names, nobody = [symbol(name) for name in design.names], design.numbers < 0
    figure = design_figure(names, design.space, design.values, nobody, {})
    with whole_file(path) as temporary:
        figure.savefig(temporary, format="svg")


def quality_table(design: Design, quality: Quality) -> Table:
    """Quality of the design."""
    seed = "" if design.seed is None else f", seed {design.seed}"
    table = Table(title=f"{design.source or design.kind} design, {quality.runs} runs{seed}", title_justify="left")
    table.add_column("quality")
    table.add_column("value", justify="right")
    table.add_column("ideal", justify="right")
    table.add_row("rank", str(quality.rank), str(quality.parameters))
    table.add_row("condition", f"{quality.condition:.3g}", "1")
    table.add_row("largest correlation", f"{quality.max_correlation:.3f}", "0")
    centred = _among_random(quality.discrepancy, quality.percentile, quality.runs)
    table.add_row("centred discrepancy (squared)", centred, "small")
    wrapped = _among_random(quality.wraparound, quality.wraparound_percentile, quality.runs)
    table.add_row("wrap-around discrepancy (squared)", wrapped, "small")
    table.add_row("smallest distance of two runs", f"{quality.min_distance:.3f}", "large")
    return table


def _among_random(value: float | None, percentile: float | None, runs: int) -> str:
    """A discrepancy, and how many random designs of the same size are better; or why there is none."""
    from birdstrike.doe.designs.quality import MEASURED_RUNS

    if value is None:
        return "runs outside the ranges" if runs <= MEASURED_RUNS else f"not taken of over {MEASURED_RUNS:,} runs"
    return f"{value:.5f}" if percentile is None else f"{value:.5f} ({percentile:.0f} % of random designs are lower)"


def _conclude(out: Path, loaded: Case, planned: Design, again: Sequence[str | Path]) -> dict[str, Any]:
    """The last lines; RunFailed when runs had to be left out, after everything has been written.

    again: the words of this command but for --runs.
    """
    from birdstrike.data.storage.files import read_json
    from birdstrike.surrogate.features import runs_needed

    summary, runs, quality = read_json(out / "summary.json"), len(planned.numbers), planned.quality()
    finished = runs - len(summary["failed"])
    drawn = ["projections.svg"] if (out / "projections.svg").exists() else []
    files = ", ".join(["design.csv", *drawn, "curves.csv", "summary.json", "runs/"])
    say(f"Written to {out}: {finished} of {runs} runs ({files}).")
    warn(summary.get("warnings", ()), str(out / "summary.json"))
    needed = runs_needed(quality.parameters)
    allowed = ["--allow-rank-deficient"] if quality.deficient else []
    inverted = out.parent / "inversion" if out.name == "doe" else Path("inversion")
    if finished < needed:
        say(f"An emulator of these parameters needs {needed} finished runs.")
        say(_extended(planned, again, needed - finished))
    else:
        record = record_here(loaded.sensors)
        say(following("train-and-invert", out, "--measured", record, "--out", inverted, *allowed))
    if summary["failed"]:
        numbers = ", ".join(str(entry["run"]) for entry in summary["failed"])
        remedy = "--retry-failed tries these again"
        if any(entry["status"] == "pending" for entry in summary["runs"]):
            remedy = "the same command repeats those that the machine ended, --retry-failed the others too"
        raise RunFailed(
            f"{len(summary['failed'])} of {runs} runs failed and are left out: run {numbers}",
            f"their reasons stand in {out / 'summary.json'}; the others can be used; {remedy}",
        )
    return {
        "out": str(out),
        "runs": runs,
        "finished": finished,
        "failed": [],
        "design": quality.as_json(),
        "warnings": summary.get("warnings", []),
    }


def _extended(planned: Design, again: Sequence[str | Path], lacking: int) -> str:
    """The line that names the command which adds so many runs."""
    if planned.kind == "file":
        return f"Next: append {many(lacking, 'row')} to {planned.source}, then: {command_line(*again)}"
    return following(*again, "--runs", str(len(planned.numbers) + lacking))
