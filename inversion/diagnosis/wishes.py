"""How to diagnose: rate of false alarms, size of the campaign, and what the user sees meanwhile."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass

from birdstrike.doe.campaign.runner import RunCounts
from birdstrike.inversion.diagnosis.verdict import ALPHA

RUNS = 25
Display = Callable[[str], AbstractContextManager[Callable[[float], None]]]
Counter = Callable[[], AbstractContextManager[Callable[[RunCounts], None]]]


def quiet(_: str) -> AbstractContextManager[Callable[[float], None]]:
    """No display."""
    return nullcontext(lambda _: None)


def uncounted() -> AbstractContextManager[Callable[[RunCounts], None]]:
    """No bar of strikes."""
    return nullcontext(lambda _: None)


@dataclass(frozen=True)
class Wishes:
    """How to diagnose. alpha: rate of false alarms; runs: of the campaign where none is given; retry: see Runner."""

    alpha: float = ALPHA
    seed: int = 0
    workers: int | None = None
    runs: int = RUNS
    display: Display = quiet
    counter: Counter = uncounted
    say: Callable[[str], None] = warnings.warn
    retry: float = 0.0
