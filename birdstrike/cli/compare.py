"""`birdstrike compare`: another code's curves of a case beside ours."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from birdstrike.cli.frame import framed, progress_bar, say, warn
from birdstrike.cli.options import CaseName, Json, Settings, overrides
from birdstrike.data.errors import MeasuredError, UserError
from birdstrike.data.progress import Progress, silent

if TYPE_CHECKING:
    from birdstrike.data.histories import Array, Histories
    from birdstrike.doe.attempt import Solver
    from birdstrike.doe.campaign.run import Finished
    from birdstrike.solver.case.case import Case, CaseSource

OURS, THEIRS, ANSWER, PAGE = "ours.csv", "theirs.csv", "compare.json", "compare.html"


def compare(
    case: CaseSource,
    histories: str | Path | Sequence[str | Path],
    out: str | Path,
    *,
    deck: str | Path | None = None,
    theirs: str = "the other code",
    settings: Mapping[str, Any] | None = None,
    progress: Progress = silent,
) -> dict[str, Any]:
    """Simulate a case, set another code's curves of its sensors beside ours, and write figures of merit and a page.

    histories: measured-data CSV or histories.csv by the sensors' names; with `deck`, the file of sensors that export
    wrote beside the deck, also nodout, rcforc, binout, a T01 of Radioss or the CSV of th_to_csv; theirs: what the
    curves are called. Our run is made once for a folder. Raises UserError, RunFailed.
    """
    from birdstrike.data.curves import write_histories
    from birdstrike.data.storage.files import withdraw, write_json
    from birdstrike.data.storage.out_folder import reserved
    from birdstrike.doe.solvers import solver_for
    from birdstrike.reports.comparison.other_code import curve_pairs, remarks
    from birdstrike.reports.page.other_code import write_comparison_page
    from birdstrike.solver.case.case import as_case, case_hash

    loaded, folder = as_case(case, settings), Path(out)
    files = [histories] if isinstance(histories, str | Path) else list(histories)
    told = [] if deck is None else _other_case(deck, case_hash(loaded))
    other, missing = _theirs(files, deck)
    with reserved(folder, "compare"):
        solver = solver_for(loaded)
        run = _ours(loaded, solver, folder, progress)
        ours = run.histories
        pairs = curve_pairs(ours, other)
        absent = [f"{name} has no curve of {theirs}" for name in ours.channels if name not in other.channels]
        named = {line.split()[0].removesuffix(":") for line in missing}
        missing = [*missing, *(line for line in absent if line.split()[0] not in named)]
        withdraw(folder, ANSWER, PAGE)
        write_histories(folder / OURS, ours)
        write_histories(folder / THEIRS, other)
        told += remarks(pairs, ours)
        if run.step_factor != 1.0:
            told.append(f"our run needed {run.step_factor:g} of the usual time step")
        made = {"case_hash": case_hash(loaded), "solver_version": solver.version}
        answer = {
            **made,
            "theirs": theirs,
            "sensors": {pair.name: pair.figures() for pair in pairs},
            "missing": missing,
        }
        answer["warnings"] = told
        not_compared = [f"{line}: not compared" for line in missing]
        write_comparison_page(folder / PAGE, loaded.name, theirs, pairs, files, [*told, *not_compared])
        write_json(folder / ANSWER, answer)
    return answer


def _other_case(deck: str | Path, own: str) -> list[str]:
    """A warning where the deck was written of another case than that of our run, by its hash."""
    from birdstrike.data.decks.sensors import read_deck_sensors

    written = read_deck_sensors(deck).case_hash
    if written in ("", own):
        return []
    return [
        f"{deck} is of another case (hash {written}) than our run (hash {own}): not the codes alone differ; give the "
        "deck's --set again, or export the deck again"
    ]


def _theirs(files: Sequence[str | Path], deck: str | Path | None) -> tuple[Histories, list[str]]:
    from birdstrike.data.decks.results import read_deck_results
    from birdstrike.data.decks.sensors import read_deck_sensors

    gone = [str(file) for file in files if not Path(file).is_file()]
    if gone:
        raise UserError(f"--histories {name}: there is no such file" for name in gone)
    if deck is not None:
        found, missing = read_deck_results(files, read_deck_sensors(deck))
        return found, list(missing)
    if len(files) != 1:
        raise UserError("several --histories go together with --deck, which says what each of them holds")
    return _by_name(Path(files[0])), []


def _by_name(path: Path) -> Histories:
    """Curves by the sensors' names: `histories.csv`, or measured-data CSV."""
    from birdstrike.data.curves import read_histories, read_measured
    from birdstrike.data.histories import Histories

    with path.open("rb") as file:
        first = file.readline()
    if first.startswith(b"time_s,"):
        try:
            found = read_histories(path)
        except ValueError as error:
            raise UserError(f"{path} cannot be read: {error}; write it again, a row an instant") from error
        _refuse_clock(path, found.time)
        return found
    try:
        record = read_measured(path)
    except MeasuredError as error:
        hint = "a file of another code as it is needs --deck SENSORS.json, which export wrote beside the deck"
        raise UserError([*error.errors, hint]) from error
    return Histories(record.time, dict(record.channels), dict(record.units))


def _refuse_clock(path: Path, time: Array) -> None:
    """Raise UserError, with the line, where the instants of a `histories.csv` do not rise."""
    import numpy as np

    falls = np.flatnonzero(~(np.diff(time) > 0.0))
    if not len(falls):
        return
    lines = path.read_text(encoding="utf-8").splitlines()
    rows = [i for i, line in enumerate(lines, 1) if line.partition("#")[0].strip()]
    before, after = time[falls[0] : falls[0] + 2]
    raise UserError(
        f"{path}, line {rows[falls[0] + 2]}: time_s = {after:g} does not rise above {before:g} before it; put the rows "
        "in the order of time, each instant once"
    )


def _ours(case: Case, solver: Solver, folder: Path, progress: Progress) -> Finished:
    """Our run, once for a folder; one that failed is tried again. Raises CaseError, RunFailed."""
    from birdstrike.data.errors import RunFailed
    from birdstrike.data.storage.store import RunStore
    from birdstrike.doe.campaign.run import Failed, PlannedRun, carried_out, retry_before
    from birdstrike.doe.solvers import refuse_unbuildable

    refuse_unbuildable(case)
    run, options = PlannedRun.alone(0, case, solver), {"threads": case.solver.threads, "progress": progress}
    state = carried_out([RunStore(folder / "runs")], run, solver, case, retry_before(True), **options)
    if isinstance(state, Failed):
        raise RunFailed(state.reason, "birdstrike check says what may be wrong with the case")
    return state


@framed
def command(
    case: CaseName,
    histories: Annotated[
        list[Path], typer.Option(metavar="FILE", help="The other code's curves; repeatable with --deck.")
    ],
    out: Annotated[Path, typer.Option(help="Folder for compare.html, compare.json and both sets of curves.")] = Path(
        "compare"
    ),
    deck: Annotated[
        Path | None, typer.Option(metavar="SENSORS.json", help="Of the deck that was run, written by export --deck.")
    ] = None,
    theirs: Annotated[str, typer.Option(metavar="NAME", help="What the other curves are called.")] = "the other code",
    settings: Settings = [],  # noqa: B006 (typer copies it)
    json: Json = False,  # noqa: ARG001 (read by the frame)
) -> dict[str, Any]:
    """Set another code's curves of a case beside ours: RMS of the peak, impulses, ISO/TS 18571, one page.

    The files of the examples are yours: strikeT01 is what OpenRadioss writes when it has run the deck; theirs.csv has
    a column for each sensor, by its name.

    Example: birdstrike compare reference_strike --histories strikeT01 --deck strike.radioss.sensors.json

    The deck: birdstrike export reference_strike --deck --to radioss --out strike_0000.rad

    Curves in CSV: birdstrike compare reference_strike --histories theirs.csv --out compare
    """
    from birdstrike.data.formatting import reading
    from birdstrike.data.units import rounded

    with progress_bar("simulation") as progress:
        answer = compare(
            case, histories, out, deck=deck, theirs=theirs, settings=overrides(settings), progress=progress
        )
    for name, one in answer["sensors"].items():
        rating = "" if one["iso18571"] is None else f", ISO/TS 18571 {one['iso18571']:.2f} ({one['iso18571_grade']})"
        share = one["rms_of_peak"]
        error = "" if share is None else f"; RMS {rounded(100.0 * share, 2)} % of the peak{rating}"
        peaks = " and ".join(reading(one[key], one["unit"], 4) for key in ("peak_ours", "peak_theirs"))
        say(f"{name}: peaks {peaks} (ours, theirs){error}")
    for line in answer["missing"]:
        say(f"not compared: {line}")
    warn(answer["warnings"], str(out / ANSWER))
    say(f"Written to {out}. Next: open {out / PAGE} in a browser.")
    return {"out": str(out), **answer}
