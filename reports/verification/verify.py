"""Verify: run the problems that are due in worker processes, collect their rows, write the page."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import Future, as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from birdstrike.data.errors import RunFailed
from birdstrike.data.progress import Progress, silent
from birdstrike.doe.campaign.worker import process_pool, worker_count
from birdstrike.reports.verification.cache import Cache, Result
from birdstrike.reports.verification.ledger import renewed
from birdstrike.reports.verification.page import most_reasons, write_page
from birdstrike.reports.verification.problem import Problem, Reason, Row
from birdstrike.reports.verification.registry import chosen, problems
from birdstrike.reports.verification.runs import RunSpec, histories_of
from birdstrike.solver.version import SOLVER_VERSION


def run_one(folder: Path, spec: RunSpec) -> float:
    """Leave the simulation's histories in the store; CPU time [s]. Raises RunFailed."""
    started = time.process_time()
    histories_of(spec, Cache(folder).runs)
    return time.process_time() - started


def solve_one(folder: Path, name: str) -> float:
    """Leave the problem's rows and pictures in the cache; CPU time [s]."""
    cache, problem = Cache(folder), problems()[name]
    started = time.process_time()
    outcome = problem.solve({spec: histories_of(spec, cache.runs) for spec in problem.runs})
    spent = time.process_time() - started
    cache.keep(problem, outcome, spent)
    return spent


CACHE = ".verification"


@dataclass(frozen=True)
class Verification:
    """Solved problems in the order of the page; of this call, what was kept from before not counted: wall_s, and
    spent, CPU time [s] by problem (a simulation that several ask for is the first one's).
    """

    results: tuple[Result, ...]
    wall_s: float
    spent: dict[str, float] = field(default_factory=dict)

    @property
    def rows(self) -> list[Row]:
        """All rows."""
        return [row for result in self.results for row in result.rows]

    @property
    def reasons(self) -> dict[str, Reason]:
        """Recorded reasons by the row that they let stand."""
        return {name: reason for result in self.results for name, reason in result.reasons.items()}

    @property
    def beyond(self) -> list[Row]:
        """Rows beyond their tolerance."""
        return [row for row in self.rows if row.verdict == "beyond"]

    @property
    def unexplained(self) -> list[Row]:
        """Rows beyond their tolerance without a recorded reason."""
        return [row for row in self.beyond if row.name not in self.reasons]

    @property
    def stands(self) -> bool:
        """Every row within its tolerance, but for at most three whose reason an experiment shows."""
        return not self.unexplained and len(self.beyond) <= most_reasons

    def as_json(self) -> dict[str, Any]:
        """Rows by problem, and whether the whole stands."""
        rows = [
            {"problem": r.problem.name, "family": r.problem.family, **row.as_json()}
            for r in self.results
            for row in r.rows
        ]
        times = {"wall_s": self.wall_s, "cpu_s": self.spent}
        return {"solver_version": SOLVER_VERSION, "stands": self.stands, **times, "rows": rows}


def verify(
    out: str | Path | None = "VERIFICATION.md",
    *,
    only: str | Iterable[str] = (),
    workers: int = 2,
    cache: str | Path = CACHE,
    progress: Progress = silent,
    told: Callable[[str], None] = lambda _: None,
) -> Verification:
    """Solve the problems whose name or family fits `only` (all without), write the page `out` unless it is None.

    What the cache holds under the present code is not run again, so that an interrupted verification resumes. A page
    that exists keeps the other problems that it holds, so that `only` adds one to it or renews it. progress: called
    with the share of simulations and problems done; told: with a line for each that is done. Raises RunFailed when
    one of them fails, UserError for a pattern that fits nothing.
    """
    started = time.perf_counter()
    kept, wanted = Cache(Path(cache).resolve()), chosen([only] if isinstance(only, str) else only)
    due = [problem for problem in wanted if kept.recall(problem) is None]
    spent = run_due(kept, due, worker_count(workers), progress, told)
    results = [result for problem in wanted if (result := kept.recall(problem)) is not None]
    verification = Verification(tuple(results), time.perf_counter() - started, spent)
    if out is not None:
        write_page(Path(out), renewed(Path(out), results), verification.wall_s)
    return verification


def run_due(
    cache: Cache, due: Sequence[Problem], workers: int, progress: Progress, told: Callable[[str], None]
) -> dict[str, float]:
    """Simulations that are not in the store and problems that need none first, then the problems that compare some.

    CPU time [s] by problem, with the simulations that it was the first to ask for.
    """
    asked: dict[str, tuple[RunSpec, str]] = {}
    for problem in due:
        for spec in problem.runs:
            asked.setdefault(spec.key(), (spec, problem.name))
    missing = [pair for key, pair in asked.items() if not cache.runs.path(key).exists()]
    apart = [problem for problem in due if not problem.runs]
    after = [problem for problem in due if problem.runs]
    total, done = len(missing) + len(due), 0
    spent = dict.fromkeys((problem.name for problem in due), 0.0)

    def finish(waiting: dict[Future[float], tuple[str, str]]) -> None:
        nonlocal done
        for future in as_completed(waiting):
            what, name = waiting[future]
            seconds = result_named(future, what)
            spent[name] += seconds
            done += 1
            progress(done / total)
            told(f"{done} of {total}: {name}{'' if what == name else ', a simulation'}, {seconds:.1f} s of CPU time")

    if not due:
        return spent
    with process_pool(workers) as pool:
        first = {pool.submit(solve_one, cache.folder, p.name): (p.name, p.name) for p in apart}
        first |= {pool.submit(run_one, cache.folder, spec): (f"simulation {spec}", name) for spec, name in missing}
        finish(first)
        finish({pool.submit(solve_one, cache.folder, p.name): (p.name, p.name) for p in after})
    return spent


def result_named(future: Future[float], what: str) -> float:
    """The result; raises RunFailed, which says which problem or simulation failed."""
    try:
        return future.result()
    except RunFailed as error:
        raise RunFailed(f"{what}: {error.reason}", error.remedy) from error
    except BrokenProcessPool as error:
        raise RunFailed(
            f"a worker process ended abruptly at {what} (killed, or out of memory)",
            "run the same command again to resume, with fewer --workers if memory is short",
        ) from error
