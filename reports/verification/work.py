"""What a worker process does for the verification: fire one strike, or solve one problem whose strikes are there."""

from __future__ import annotations

import time
from pathlib import Path

from reports.verification.cache import Cache
from reports.verification.registry import problems
from reports.verification.shots import Shot, strike


def fire_one(folder: Path, shot: Shot) -> float:
    """Leave the shot's histories in the store; CPU time [s]. Raises RunFailed."""
    started = time.process_time()
    strike(shot, Cache(folder).strikes)
    return time.process_time() - started


def solve_one(folder: Path, name: str) -> float:
    """Leave the problem's rows and pictures in the cache; CPU time [s]."""
    cache, problem = Cache(folder), problems()[name]
    started = time.process_time()
    outcome = problem.solve({shot: strike(shot, cache.strikes) for shot in problem.shots})
    spent = time.process_time() - started
    cache.keep(problem, outcome, spent)
    return spent
