"""`birdstrike audit`: the diagnosis on records of known truth, scored against what only the scorer opens."""

from __future__ import annotations

import platform
import warnings
from collections.abc import Callable, Sequence
from concurrent.futures import as_completed
from contextlib import nullcontext
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from birdstrike.data.arguments import as_options, as_path
from birdstrike.data.curves import read_measured
from birdstrike.data.errors import UserError, refuse_not_whole
from birdstrike.data.formatting import many
from birdstrike.data.progress import Progress, no_display, silent
from birdstrike.data.storage.files import write_json
from birdstrike.data.storage.out_folder import fills_out
from birdstrike.doe.campaign.run import retry_before
from birdstrike.doe.campaign.simulations import Simulations, uncounted
from birdstrike.doe.campaign.worker import process_pool, worker_count
from birdstrike.inversion.audit.answers import answered
from birdstrike.inversion.audit.records import (
    BASELINES,
    Experiment,
    find_experiments,
    read_truth,
    refuse_damaged_truths,
)
from birdstrike.inversion.audit.score import Score, score
from birdstrike.inversion.audit.tables import WANTED, tables
from birdstrike.inversion.audit.truth_runs import Layout, layouts, make_experiments, refuse_other_truths
from birdstrike.inversion.diagnosis.diagnose import refuse_choices
from birdstrike.inversion.diagnosis.pipeline import DiagnosisOptions
from birdstrike.solver.case.case import Case, as_case, case_hash, load_case
from birdstrike.solver.version import SOLVER_VERSION, code_of

CASE = "audit_strike"
"""A coarse case of four sensors: the criteria are stated for one and for four channels."""
Asked = tuple[int | None, int | None, str | None]
"""Number of channels, of shots, kind of baseline of the records that are wanted; None for any."""


@fills_out("audit")
def audit(
    folder: str | Path | None,
    out: str | Path,
    *,
    options: DiagnosisOptions | None = None,
    draws: int = 1,
    channels: int | None = None,
    shots: int | None = None,
    baselines: str | None = None,
    make: int = 0,
    forms: int = 0,
    case: str | Path | Case | None = None,
    most: int | None = None,
    progress: Progress = silent,
    say: Callable[[str], None] = warnings.warn,
    retry_failed: bool = False,
    command: str = "",
) -> dict[str, Any]:
    """Score the diagnosis on every experiment of `folder` and write `out/audit.json`; returns its content.

    Parameters
    ----------
    folder : experiments; None: those made in `out/experiments`.
    out : answers are stored in `out/answers`, simulations in one store for all records of a declared case.
    options : of every diagnosis; `check` is whether the solver is run at each record's fits.
    draws : draws of the noise on each record; 1: the record as it is.
    channels, shots : only records of so many.
    baselines : only records without a baseline (none), with one of another bird (another) or of the shot's (own).
    make, forms : truths to draw and simulate first, by the declared model and by another one.
    case : the declared case of the truths that are made; None: `audit_strike`.
    most : records answered at most in this call; the others are counted as not yet answered.
    retry_failed : stored failures, of simulations and of answers, are tried again.
    command : what was typed, for audit.json.

    Raises
    ------
    UserError, RunFailed
        No experiment fits; no record of the case can be as asked; a case without truths to be made; a file of one
        cannot be read; `out` holds truths of another case or seed; a truth cannot be simulated.
    """
    choice, place = as_options("options", options, DiagnosisOptions), Path(out)
    choice = replace(choice, retry=retry_before(True)) if retry_failed else choice
    refuse_choices(choice)
    _refuse_counts(make=make, make_forms=forms, draws=draws, channels=channels, shots=shots, most=most)
    if baselines not in (None, *BASELINES):
        raise UserError(f'--baselines "{baselines}" is unknown; available: {", ".join(BASELINES)}')
    if folder is not None and (make or forms):
        raise UserError(f"--experiments {folder} and --make exclude each other: truths are made in --out")
    if case is not None and not (make or forms):
        raise UserError(
            f"--case = {case if isinstance(case, str | Path) else case.name}: it is of truths that are made, and "
            "records that are scored bring their own; add --make N or --make-forms N, or leave --case out"
        )
    made, asked = place / "experiments", (channels, shots, baselines)
    if make or forms:
        declared = as_case(CASE if case is None else case)
        refuse_other_truths(declared, made, choice.seed)
        wanted = _wanted(declared, asked)
        with Simulations(place / "truths", (), choice.workers, retry=choice.retry) as simulations:
            for count, other in ((make, False), (forms, True)):
                if count:
                    make_experiments(declared, made, simulations.run, count, choice.seed, forms=other, wanted=wanted)
    source = made if folder is None else as_path("folder", folder)
    found = [one for one in find_experiments(source) if _fits(_kind(one, baselines is not None), asked)]
    if not found:
        raise UserError(f"no experiment in {source} has {_in_words(asked)}")
    refuse_damaged_truths(found)
    scores, failed, left = _scored(found, place, choice, draws, most, progress, say)
    return _written(place, scores, failed, left, choice, draws, command)


def _wanted(declared: Case, asked: Asked) -> tuple[Layout, ...]:
    """The layouts of a case's records that are asked for; raises UserError where there are none."""
    known = layouts(declared)
    found = tuple(one for one in known if _fits(_kind_of(one), asked))
    if not found:
        channels, shots, baselines = (dict.fromkeys(values) for values in zip(*map(_kind_of, known), strict=True))
        raise UserError(
            f"no record of {declared.name} has {_in_words(asked)}: its records have "
            f"{' or '.join(map(str, channels))} channels, {' or '.join(map(str, shots))} shots and --baselines "
            f"{', '.join(map(str, baselines))}; ask for these, or leave the option out"
        )
    return found


def _kind_of(one: Layout) -> tuple[int, int, str]:
    return len(one.channels), one.shots, one.baseline


def _in_words(asked: Asked) -> str:
    """What records are asked for: "9 channels and 1 shot"."""
    channels, shots, baselines = asked
    counts = [many(n, name) for n, name in ((channels, "channel"), (shots, "shot")) if n is not None]
    return " and ".join([*counts, *([f"--baselines {baselines}"] if baselines else [])])


def _refuse_counts(**counts: int | None) -> None:
    """Raise UserError for a count that is none, by the name of its option."""
    for name, count in counts.items():
        least = 0 if name.startswith("make") else 1
        if count is None:
            continue
        remedy = "1 takes each record as it is" if name == "draws" else f"give {least} or more, or leave it out"
        refuse_not_whole(f"--{name.replace('_', '-')}", count, remedy)
        if count < least:
            raise UserError(f"--{name.replace('_', '-')} = {count} is below {least}; {remedy}")


def _kind(one: Experiment, by_baseline: bool) -> tuple[int, int, str]:
    """Number of channels, of shots, kind of baseline; its case is read only where one goes by that."""
    return len(read_measured(one.shots[0]).channels), len(one.shots), one.baseline_kind if by_baseline else ""


def _fits(kind: tuple[int, int, str], asked: Asked) -> bool:
    return all(wanted in (None, has) for has, wanted in zip(kind, asked, strict=True))


def _scored(
    found: Sequence[Experiment],
    place: Path,
    options: DiagnosisOptions,
    draws: int,
    most: int | None,
    progress: Progress,
    say: Callable[[str], None],
) -> tuple[list[Score], dict[str, str], int]:
    """Scores, why records have none, and how many records are not yet answered.

    The first record of a declared case makes the simulations that all of its records share, on all cores; the others
    are answered side by side, one core each.
    """
    scores, failed = dict[str, Score](), dict[str, str]()
    tasks = [(one, noise) for noise in range(draws) for one in found]
    asked = tasks if most is None else tasks[:most]
    names = [f"{one.name} (noise {noise})" if noise else one.name for one, noise in asked]

    def take(i: int, result: Score | str) -> None:
        if isinstance(result, str):
            failed[names[i]] = result
            say(f"{names[i]} has no answer and is not counted: {result}; --retry-failed tries it again")
        else:
            scores[names[i]] = result
            say(f"{names[i]}: {result.verdict} ({', '.join(result.confidence_set[:4])})")
        progress((len(scores) + len(failed)) / len(asked))

    first = {one.case.read_text(encoding="utf-8"): i for i, (one, _) in reversed([*enumerate(asked)])}
    for i in sorted(first.values()):
        take(i, _answered_and_scored(names[i], *asked[i], place, options))
    alone = replace(options, workers=1, display=no_display, counter=uncounted)
    with process_pool(worker_count(options.workers)) as pool:
        rest = {
            pool.submit(_answered_and_scored, names[i], *task, place, alone): i
            for i, task in enumerate(asked)
            if i not in first.values()
        }
        for future in as_completed(rest):
            take(rest[future], future.result())
    return [scores[name] for name in names if name in scores], failed, len(tasks) - len(asked)


def _answered_and_scored(name: str, one: Experiment, noise: int, place: Path, options: DiagnosisOptions) -> Score | str:
    """The score of a record, or why it has no answer."""
    answer = answered(one, place, options, noise)
    return answer["failed"] if "failed" in answer else _score(name, one, answer, place, options)


def _score(name: str, one: Experiment, answer: dict[str, Any], place: Path, options: DiagnosisOptions) -> Score:
    """The truth is opened after the record has been answered."""
    case, held = load_case(one.case), None if one.heldout is None else read_measured(one.heldout)
    store = place / "diagnoses" / case_hash(case) / "runs"
    check = Simulations(store, (), options.workers, retry=options.retry) if options.check else None
    with check or nullcontext():
        simulate = check.run if check else None
        return score(name, answer, read_truth(one.truth), case, simulate, one.baseline_kind, held)


def _written(
    place: Path,
    scores: Sequence[Score],
    failed: dict[str, str],
    left: int,
    options: DiagnosisOptions,
    draws: int,
    command: str,
) -> dict[str, Any]:
    """`audit.json`."""
    found = tables(scores, options.alpha)
    content = {
        "design": 2,
        "complete": bool(found) and not left and all(one["curves"] >= WANTED for one in found.values()),
        "wanted": WANTED,
        "records": len(scores),
        "not_answered": left,
        "failed": failed,
        "alpha": options.alpha,
        "draws": draws,
        "confirmed": options.check,
        "command": command,
        "date": f"{datetime.now(UTC):%Y-%m-%d}",
        "code": code_of("inversion"),
        "solver_version": SOLVER_VERSION,
        "machine": platform.platform(),
        "tables": found,
    }
    write_json(place / "audit.json", content)
    return content
