"""`birdstrike compare-methods`: all inversions on a case with known truth, and the coverage of their intervals."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from birdstrike.cli.frame import framed, progress_bar, say
from birdstrike.cli.options import Json, RetryFailed
from birdstrike.data.arguments import as_path
from birdstrike.data.errors import UserError, refuse_not_whole
from birdstrike.data.formatting import key_labels
from birdstrike.data.storage.out_folder import fills_out

if TYPE_CHECKING:
    from birdstrike.data.dataset import Dataset
    from birdstrike.inversion.identifiability.coverage import Coverage
    from birdstrike.inversion.method_comparison import KnownCase, MethodScore
    from birdstrike.solver.case.case import Case

SEED = 0
"""Of the noise on the records, of the truths and of the posteriors' draws; it stands in comparison.json."""


@framed
def command(
    doe: Annotated[
        Path, typer.Argument(metavar="DOE", help="Campaign of the case (run-doe); all its sensors are used.")
    ],
    out: Annotated[Path, typer.Option(help="Folder for comparison.json, comparison.md and the runs that are made.")],
    case: Annotated[
        str | None, typer.Option(help="The case, whose own values are the truth; the campaign's own by default.")
    ] = None,
    truths: Annotated[int, typer.Option(min=0, help="Emulator-made truths for the coverage of the intervals.")] = 200,
    solver_truths: Annotated[int, typer.Option(min=0, help="Solver-made truths for the same.")] = 20,
    table: Annotated[bool, typer.Option(help="The table of all methods, 12 conditions.")] = True,
    retry_failed: RetryFailed = False,
    json: Json = False,  # noqa: ARG001 (read by the frame)
) -> dict[str, Any]:
    """Run every method on records of known truth: errors beside what noise and prior allow, runs and seconds.

    The report of a folder shows what lies in its folder `comparison`.

    Example: birdstrike compare-methods synthetic --out comparison

    The campaign synthetic: birdstrike run-doe synthetic_strike --out synthetic --design lhs --runs 40
    """
    rows = compare_methods(doe, out, case, truths, solver_truths, table, retry_failed)
    say(f"Written to {out}: comparison.json, comparison.md.")
    return {"out": str(out), "rows": len(rows)}


@fills_out("compare-methods")
def compare_methods(
    doe: str | Path,
    out: str | Path,
    case: str | Path | Case | None = None,
    truths: int = 200,
    solver_truths: int = 20,
    table: bool = True,
    retry_failed: bool = False,
) -> list[MethodScore]:
    """Run every method on records of known truth; write comparison.json and comparison.md into `out`.

    Parameters
    ----------
    doe : path
        Folder of a finished campaign, whose solver makes and verifies the records.
    out : path
        Folder; simulations stay in `out/runs`.
    case : path or Case, optional
        The case, whose own values are the truth; the campaign's own by default.
    truths, solver_truths : int
        Truths, 0 or more, on which the coverage of the intervals is counted, their records made by the emulator and by
        the solver (one simulation each); 0 leaves that part out.
    table : bool
        Whether all methods are run under 12 conditions (noise, points, channels).
    retry_failed : bool
        Whether runs with a failure on record are tried again.

    Returns
    -------
    list of MethodScore
        A row for each condition and method: errors of the parameters as shares of their ranges, of the curve over the
        noise; none without `table`.

    Raises
    ------
    UserError
        For a campaign of another case or without a displacement, and where nothing is left to compare.
    RunFailed
        Where the truth or an answer cannot be simulated.
    """
    from birdstrike.inversion.method_comparison import score_methods

    for option, count in (("--truths", truths), ("--solver-truths", solver_truths)):
        refuse_not_whole(option, count, "0 leaves its part out", least=0)
    if not (table or truths or solver_truths):
        raise UserError("--no-table, --truths 0 and --solver-truths 0 leave nothing to compare; leave one of them out")
    doe, out = as_path("doe", doe), Path(out)
    bench, channels = _bench(doe, out, case, retry_failed)
    rows: list[MethodScore] = []
    found: dict[str, list[Coverage]] = {}
    if table:
        with progress_bar("all methods") as progress:
            for row in score_methods(bench, channels, progress):
                rows.append(row)
                _write(out, bench, rows, found)
    for condition, entry in _coverages(bench, channels, truths, solver_truths):
        found.setdefault(condition, []).append(entry)
        _write(out, bench, rows, found)
    return rows


def _write(out: Path, bench: KnownCase, rows: Sequence[MethodScore], found: Mapping[str, list[Coverage]]) -> None:
    """What is known so far: an interrupted comparison keeps it."""
    from birdstrike.data.storage.files import write_atomically, write_json

    content = {
        "campaign_runs": len(bench.dataset.runs),
        "truth": dict(bench.truth),
        "seed": SEED,
        "table": [asdict(row) for row in rows],
        "coverage": {name: [asdict(entry) for entry in entries] for name, entries in found.items()},
    }
    write_json(out / "comparison.json", content)
    write_atomically(out / "comparison.md", markdown(rows, found))


def _bench(
    doe: Path, out: Path, case: str | Path | Case | None, retry_failed: bool
) -> tuple[KnownCase, tuple[str, ...]]:
    """The campaign, its solver and the truth: the case's own values."""
    from birdstrike.data.storage.store import RunStore
    from birdstrike.doe.campaign.results import load_dataset
    from birdstrike.doe.campaign.run import retry_before
    from birdstrike.inversion.campaign_shots import campaign_case
    from birdstrike.inversion.forward import StoredSolver
    from birdstrike.inversion.method_comparison import KnownCase
    from birdstrike.solver.case.sections import at

    dataset = load_dataset(doe)
    loaded = campaign_case(doe, dataset, case)
    truth = {name: float(at(loaded.model_dump(), name)) for name in dataset.names}
    stores = RunStore(out / "runs"), (RunStore(doe / "runs"),)
    solver = StoredSolver(loaded, *stores, retry=retry_before(retry_failed))
    channels = displacement_first(loaded.name, dataset)
    return KnownCase.of(dataset, solver, truth, channels), channels


def displacement_first(case: str, dataset: Dataset) -> tuple[str, ...]:
    """The channels in their order, but a displacement first: the noise of all is in proportion to its, in mm.

    Raises UserError where no channel is a displacement.
    """
    first = next((name for name, unit in dataset.channel_units.items() if unit == "m"), None)
    if first is None:
        raise UserError(
            f"sensors of {case}: {', '.join(dataset.curves)}: none is a displacement, in whose mm the records' noise "
            'is stated; add one of kind = "displacement" and repeat run-doe'
        )
    return (first, *(name for name in dataset.curves if name != first))


def _coverages(
    bench: KnownCase, channels: tuple[str, ...], many: int, by_solver: int
) -> Iterator[tuple[str, Coverage]]:
    """Coverage under two conditions: the paper's 12 points with much noise, and a good record of three channels."""
    from birdstrike.inversion.estimation.calibration import Calibrator
    from birdstrike.inversion.estimation.coordinates import parameter_coordinates
    from birdstrike.inversion.estimation.curve_model import CurveModel
    from birdstrike.inversion.identifiability.coverage import coverage
    from birdstrike.inversion.method_comparison import Condition

    for condition in (Condition(0.05e-3, 12, channels[:1]), Condition(0.02e-3, 200, channels)):
        emulator = bench.emulators[condition.channels]
        coordinates = parameter_coordinates(bench.dataset, emulator.regions)
        calibrator = Calibrator(CurveModel(emulator, bench.record(condition, SEED)), coordinates, 0.0)
        for count, forward in ((many, None), (by_solver, bench.forward)):
            if count:
                with progress_bar(f"{count} truths, {condition}") as progress:
                    yield str(condition), coverage(calibrator, count, SEED, forward, progress)


def markdown(rows: Sequence[MethodScore], found: Mapping[str, list[Coverage]]) -> str:
    """Both tables for people."""
    from birdstrike.inversion.method_comparison import ABOVE, ALLOWED

    units = "0.02 mm (of another channel, the same share of its peak)"
    lines = [f"Errors of the parameters in % of their ranges; curve errors in units of {units}.", "", ABOVE, ""]
    if rows:
        names = list(rows[0].errors)
        heads = [*key_labels(names).values(), "emulated curve", "verified", "runs", "seconds"]
        lines += ["| " + " | ".join(["condition", "method", *heads]) + " |", "|" + "---|" * (len(heads) + 2)]
        for i, row in enumerate(rows):
            if row.bounds and (i == 0 or rows[i - 1].condition != row.condition):
                shares = [f"{100 * row.bounds[name]:.2g}" for name in names]
                lines.append("| " + " | ".join([row.condition, f"*{ALLOWED}*", *shares, "", "", "", ""]) + " |")
            shares = [f"{100 * row.errors[name]:.2g}" for name in names]
            predicted = "–" if row.predicted is None else f"{row.predicted:.2f}"
            figures = [predicted, f"{row.verified:.2f}", str(row.runs), f"{row.seconds:.1f}"]
            lines.append("| " + " | ".join([row.condition, row.method, *shares, *figures]) + " |")
    for condition, entries in found.items():
        for entry in entries:
            lines += ["", f"{condition}: {entry.truths} truths made by the {entry.made_by}.", ""]
            heads = ["identified", "95 % hold", "hold, all", "RMS error", "bound", "with emulator's error", "ratio"]
            lines += ["| parameter | " + " | ".join(heads) + " |", "|---|" + "---|" * len(heads)]
            for name, label in key_labels(entry.error).items():
                hits = entry.hits[name]
                cells = [
                    f"{100 * entry.identified[name]:.0f} %",
                    "–" if hits is None else f"{100 * hits:.1f} %",
                    f"{100 * entry.hits_all[name]:.1f} %",
                    *(f"{100 * part[name]:.2f} %" for part in (entry.error, entry.bound, entry.bound_with_emulator)),
                    f"{entry.error[name] / entry.bound[name]:.2f}",
                ]
                lines.append(f"| {label} | " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"
