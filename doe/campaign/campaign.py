"""The campaign: every run of a design, on all cores, resumable, into a folder and a Dataset."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path

from birdstrike.data.arguments import as_path
from birdstrike.data.dataset import Dataset
from birdstrike.data.errors import RunFailed
from birdstrike.data.storage.files import withdraw
from birdstrike.data.storage.out_folder import fills_out
from birdstrike.data.storage.store import RunStore
from birdstrike.doe.attempt import Simulate, Solver
from birdstrike.doe.campaign.folder import CampaignFolder
from birdstrike.doe.campaign.results import (
    inactivity_sentences,
    load_dataset,
    other_scale,
    running,
    settled,
    write_curves,
)
from birdstrike.doe.campaign.run import Failed, Finished, PlannedRun, plan
from birdstrike.doe.campaign.runner import RunCounts, Runner
from birdstrike.doe.campaign.worker import process_pool, worker_count
from birdstrike.doe.designs.design import Design
from birdstrike.doe.solvers import refuse_unbuildable, solver_for
from birdstrike.solver.case.case import Case
from birdstrike.solver.setup_warnings import setup_warnings

NAMED_FAILURES = 5
"""Failed runs that are named one by one; summary.json names all."""


@fills_out("run-doe")
def run_campaign(
    case: Case,
    design: Design,
    out: str | Path,
    *,
    workers: int | None = None,
    simulate: Simulate | None = None,
    solver_version: str | None = None,
    progress: Callable[[RunCounts], None] = lambda _: None,
    say: Callable[[str], None] = warnings.warn,
    executor: Executor | None = None,
    scheduler: str | None = None,
    retry: float = 0.0,
    claimed: Callable[[], None] = lambda: None,
) -> Dataset:
    """Run what `out` does not hold yet of the design's runs and return all that finished.

    workers: processes, one run on one thread each; all cores by default. simulate, solver_version: another solver and
    its version in the store's keys. executor: in place of the process pool; it takes `workers` runs at a time.
    scheduler: address of a Dask scheduler, in place of both; workers is then the most runs handed over at a time.
    retry: runs whose failure was stored before this time [s, Unix] are tried again (run.retry_before gives it).
    claimed: called once the folder is this campaign's, before `say`. progress: called at every change. say: takes what
    the user should know, one line at a time.

    A run that fails is tried again with half the time step where the solver takes one (an external solver's deck need
    not), then left out by number; its reason stands in summary.json. Raises UserError (the folder holds another
    campaign, the case refuses a run) and RunFailed (no run finished, a worker died); after either, and after Ctrl-C
    or a kill, the same call resumes. A longer design that begins with the held rows (one of doe.campaign.planned, a
    file with rows appended) extends the campaign.
    """
    count = worker_count(workers)
    solver = solver_for(case, simulate)
    if solver_version is not None:
        solver = solver._replace(version=solver_version)
    runs = plan(case, design, solver)
    if simulate is None:
        refuse_unbuildable(case)
    if scheduler is not None:
        from birdstrike.doe.campaign.cluster import refuse_address  # late: only a campaign on a cluster needs it

        refuse_address(scheduler)
    folder = CampaignFolder(as_path("out", out))
    other_sources = folder.other_sources(case)
    folder.claim(case, design)
    claimed()
    _announce(case, design, runs, folder, solver.version, other_sources, say)
    summary = running(folder, case, design, runs, solver.version)
    runner = Runner(RunStore(folder.runs), runs, progress, retry)
    if runner.due and scheduler is not None:
        _run_on_cluster(runner, scheduler, solver, case, workers, say)
    elif runner.due:
        with _pool(executor, min(count, len(runner.due))) as ready:
            runner.run(ready, solver.simulate, case, count)
    dataset = _finish(folder, summary, runner, say, len(solver.step_factors))
    if case.solver.name == "external":
        _doubt_units(dataset, runner, say)
    return dataset


def _pool(executor: Executor | None, workers: int) -> AbstractContextManager[Executor]:
    return process_pool(workers) if executor is None else nullcontext(executor)


def _run_on_cluster(
    runner: Runner, scheduler: str, solver: Solver, case: Case, workers: int | None, say: Callable[[str], None]
) -> None:
    # late: only a campaign on a cluster needs it
    from birdstrike.doe.campaign.cluster import AHEAD, SameSolver, cluster, version_here, worker_command

    embedded = solver.version == version_here()
    simulate = SameSolver(solver.simulate, solver.version) if embedded else solver.simulate
    with cluster(scheduler) as found:
        if not found.threads:
            say(
                f"--scheduler = {scheduler} has no workers yet: the runs wait for them; start some with: "
                f"{worker_command(scheduler)}"
            )
        runner.run(found.executor, simulate, case, max(found.threads, 1), ahead=workers or AHEAD, lost=found.lost)


def _announce(
    case: Case,
    design: Design,
    runs: Sequence[PlannedRun],
    folder: CampaignFolder,
    version: str,
    other_sources: str,
    say: Callable[[str], None],
) -> None:
    """What the user should know before the runs start, each once, the gravest first."""
    quality = design.quality()
    if quality.deficient:
        say(quality.sentence)
    setup = setup_warnings(case) if case.solver.name == "embedded" else []
    for line in (*setup, *design.warnings, *inactivity_sentences(design, runs)):
        say(line)
    held = folder.read_summary().get("solver_version", version)
    if held != version:
        say(
            f"{folder.path} was run with solver version {held}, this is {version}: the old runs stay in "
            f"{folder.runs} but are not used; all runs are made anew"
        )
    elif other_sources:
        say(
            f"{folder.path} was run with other sources of {other_sources}, from an installed package: the old runs "
            f"stay in {folder.runs} but are not used; all runs are made anew"
        )


def _finish(
    folder: CampaignFolder, summary: dict[str, object], runner: Runner, say: Callable[[str], None], attempts: int
) -> Dataset:
    """Curves, summary and Dataset; attempts: how often a run that failed was tried."""
    outcomes = dict(sorted(runner.outcomes.items()))
    finished = {number: outcome for number, outcome in outcomes.items() if isinstance(outcome, Finished)}
    failed = {number: outcome for number, outcome in outcomes.items() if isinstance(outcome, Failed)}
    if finished:
        write_curves(folder.curves, ((number, run.store.curves(run.key)) for number, run in finished.items()))
    else:
        withdraw(folder.path, folder.curves.name)  # those of another version of the solver
    settled(folder, summary, outcomes)
    if not finished:
        number, first = next(iter(failed.items()))
        remedy = "run the same command again" if first.due else "check the case"
        raise RunFailed(f"none of the {len(failed)} runs finished; run {number}: {first.reason}", remedy)
    for number, outcome in list(failed.items())[:NAMED_FAILURES]:
        what = "was ended by the machine" if outcome.due else "failed twice" if attempts > 1 else "failed"
        say(f"run {number} {what} and is left out: {outcome.reason}")
    if len(failed) > NAMED_FAILURES:
        say(f"{len(failed) - NAMED_FAILURES} more runs are left out; {folder.summary} holds their reasons")
    return load_dataset(folder.path)


def _doubt_units(dataset: Dataset, runner: Runner, say: Callable[[str], None]) -> None:
    """Name the runs of an external solver whose output may stand in other units than the case states."""
    for number, what in other_scale(dataset).items():
        outcome = runner.outcomes[number]
        assert isinstance(outcome, Finished)
        say(
            f"run {number}: {what}; did its output stand in other units? It is used as it is: correct the program, "
            f"remove {outcome.store.path(outcome.key)} and run the same command again"
        )
