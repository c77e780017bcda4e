"""How to diagnose: false-alarm rate, size of the campaign, workers, and what the user sees meanwhile."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass

from birdstrike.doe.campaign.runner import RunCounts
from birdstrike.inversion.diagnosis.alarm import ALPHA
from birdstrike.inversion.diagnosis.plan import RUNS

Display = Callable[[str], AbstractContextManager[Callable[[float], None]]]
Counter = Callable[[], AbstractContextManager[Callable[[RunCounts], None]]]


def quiet(_: str) -> AbstractContextManager[Callable[[float], None]]:
    """No display."""
    return nullcontext(lambda _: None)


def uncounted() -> AbstractContextManager[Callable[[RunCounts], None]]:
    """No bar of simulations."""
    return nullcontext(lambda _: None)


@dataclass(frozen=True)
class Options:
    """How to diagnose. alpha: rate of false alarms; runs: of the coarse campaign; check: whether the solver is run at
    the fits before and after; magnitude_scale, remainder_scale, parameter_length: the priors, for a sensitivity study.
    """

    alpha: float = ALPHA
    seed: int = 0
    workers: int | None = None
    runs: int = RUNS
    display: Display = quiet
    counter: Counter = uncounted
    say: Callable[[str], None] = warnings.warn
    check: bool = True
    magnitude_scale: float = 1.0
    remainder_scale: float = 1.0
    parameter_length: float = 1.0
