"""`birdstrike audit`: the diagnosis on planted experiments, scored against their sealed truths."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Iterator
from concurrent.futures import as_completed
from dataclasses import dataclass, replace
from multiprocessing.util import Finalize
from pathlib import Path
from typing import Any

from birdstrike.data.curves import read_measured
from birdstrike.data.errors import UserError
from birdstrike.doe.campaign.run import retry_before
from birdstrike.doe.campaign.worker import process_pool
from birdstrike.inversion.audit.bench import Bench, digest
from birdstrike.inversion.audit.circular import emulator_made
from birdstrike.inversion.audit.experiment import Experiment, experiments
from birdstrike.inversion.audit.score import Asked, Score, score
from birdstrike.inversion.audit.stored import load_score, save_score, score_key
from birdstrike.inversion.audit.table import write_audit
from birdstrike.inversion.diagnosis.diagnose import Wishes, quiet, uncounted
from birdstrike.solver.case.case import load_case

DRAWS, READ, MADE = 200, 2, 20
BEFORE_QUEUES = 20  # exit priority; queues close at 10, and a pool can tell its processes nothing after that
FEWEST_DRAWS = 20


@dataclass(frozen=True)
class Task:
    """A score to be made: of an experiment, or of the `made`-th truth of the emulator itself; where it is kept."""

    experiment: Experiment
    made: int | None
    path: Path
    key: str


def audit(
    folder: str | Path,
    out: str | Path,
    *,
    wishes: Wishes | None = None,
    draws: int = DRAWS,
    confirm: bool = True,
    channels: int | None = None,
    read: int = READ,
    made: int = MADE,
    progress: Callable[[float], None] = lambda _: None,
    say: Callable[[str], None] = warnings.warn,
    retry_failed: bool = False,
) -> dict[str, Any]:
    """Score every experiment of `folder` and write `out/audit.json`; returns its content.

    draws: of the noise on each curve; confirm: the solver is asked as `diagnose` asks it (some thirty strikes an
    experiment); channels: only records of so many; read: whole records drawn of each kind of noise; made: truths of the
    emulator itself. Every score is kept in `out/scores` and used again, so that a killed audit loses those in flight
    only.
    retry_failed: runs with a failure on record are tried again. A script that calls this
    needs `if __name__ == "__main__":`. Raises UserError and RunFailed.
    """
    choice, place = wishes or Wishes(), Path(out)
    choice = replace(choice, retry=retry_before(True)) if retry_failed else choice
    if draws < FEWEST_DRAWS:
        raise UserError(f"--draws = {draws} is below {FEWEST_DRAWS}: rates would be coarse; 200 is the gate's")
    found = [one for one in experiments(Path(folder)) if channels in (None, len(read_measured(one.record).channels))]
    if not found:
        raise UserError(f"no experiment in {folder} has {channels} channels")
    asked = Asked(draws, read, confirm)
    tasks = _tasks(place, found, choice, asked, made)
    scores: dict[Path, Score] = {}
    for task, one in _scores(place, choice, tasks, asked):
        scores[task.path] = one
        progress(len(scores) / len(tasks))
        if task.made is None:
            say(f"{one.name}: {one.blind.verdict} ({', '.join(one.blind.allowed[:4])})")
    planted = [scores[task.path] for task in tasks if task.made is None]
    emulated = [scores[task.path] for task in tasks if task.made is not None]
    return write_audit(place, planted, emulated, choice.alpha, asked)


def _tasks(place: Path, found: list[Experiment], choice: Wishes, asked: Asked, made: int) -> list[Task]:
    """Every experiment, and truths of the emulator on the points of the first record of each case and channels."""
    common = (repr(asked), repr((choice.alpha, choice.seed, choice.runs)))
    tasks, templates = [], {}
    for one in found:
        case, record = load_case(one.case), one.record.read_text(encoding="utf-8")
        templates.setdefault((digest(case), tuple(read_measured(one.record).channels)), (one, record))
        key = score_key(*common, digest(case), record, one.truth.read_text(encoding="utf-8"))
        tasks.append(Task(one, None, place / "scores" / f"{one.name}.json", key))
    for (case, channels), (one, record) in templates.items():
        name = f"emulator_{case[:6]}_{len(channels)}"
        tasks += [
            Task(one, i, place / "scores" / f"{name}_{i:03d}.json", score_key(*common, case, record, str(i)))
            for i in range(made)
        ]
    return tasks


def _scores(place: Path, choice: Wishes, tasks: list[Task], asked: Asked) -> Iterator[tuple[Task, Score]]:
    """Scores as they are done: those on the disk first, the others several at a time, each striking on one core."""
    due = []
    for task in tasks:
        known = load_score(task.path, task.key)
        if known is None:
            due.append(task)
        else:
            yield task, known
    if not due:
        return
    _ready(place, choice, due)
    plain = replace(choice, display=quiet, counter=uncounted, say=warnings.warn, workers=1)
    workers = min(choice.workers or os.cpu_count() or 1, len(due))
    with process_pool(workers) as pool:
        running = {pool.submit(_score, place, plain, asked, task): task for task in due}
        for done in as_completed(running):
            yield running.pop(done), done.result()


def _ready(place: Path, choice: Wishes, due: list[Task]) -> None:
    """Run campaigns and shared strikes before experiments are scored side by side."""
    bench = Bench(place, choice)
    with bench.stack:
        for task in due:
            bench.study(load_case(task.experiment.case), tuple(read_measured(task.experiment.record).channels))


_bench: Bench | None = None


def _score(place: Path, wishes: Wishes, asked: Asked, task: Task) -> Score:
    """One score in a worker, which keeps its bench for the next, on the disk when it is returned."""
    global _bench
    if _bench is None:
        _bench = Bench(place, wishes)
        Finalize(None, _bench.stack.close, exitpriority=BEFORE_QUEUES)  # a worker ends its own strikes' workers
    if task.made is None:
        found = score(_bench, task.experiment, asked)
    else:
        measured = read_measured(task.experiment.record)
        study = _bench.study(load_case(task.experiment.case), tuple(measured.channels))
        found = emulator_made(study, study.read(measured), task.made)
    save_score(task.path, task.key, found)
    return found
