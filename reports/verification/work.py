"""What a worker process does for the verification: fire one strike, or solve one problem whose strikes are there."""

from __future__ import annotations

import time
from pathlib import Path

from reports.verification.cache import Cache
from reports.verification.registry import problems
from reports.verification.shots import Shot, strike


def fire_one(folder: Path, shot: Shot) -> None:
    """Leave the shot's histories in the store. Raises RunFailed."""
    strike(shot, Cache(folder).strikes)


def solve_one(folder: Path, name: str) -> None:
    """Leave the problem's rows and pictures in the cache."""
    cache, problem = Cache(folder), problems()[name]
    started = time.perf_counter()
    outcome = problem.solve({shot: strike(shot, cache.strikes) for shot in problem.shots})
    cache.keep(problem, outcome, time.perf_counter() - started)
