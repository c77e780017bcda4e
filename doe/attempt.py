"""One attempt at a run, as a worker carries it out, and what of its end is the run's own fault.

A worker loads the case and the solver for it, and nothing of the designs.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import BrokenExecutor
from typing import Any, NamedTuple

import numpy as np

from birdstrike.data.errors import MachineFailure, RunFailed
from birdstrike.data.histories import Histories
from birdstrike.solver.case.case import Case

Simulate = Callable[..., Histories]
"""simulate(case, *, step_factor, threads) -> Histories; raises RunFailed. A module's function: it goes to workers."""

MACHINE_FAULTS = (MemoryError, OSError, BrokenExecutor, MachineFailure)
"""Memory, disk and signals: what they end is not the run's own failure, and is never stored as one."""

STEP_FACTORS = (1.0, 0.5)
"""A run that fails is tried once more with half the time step."""


class Solver(NamedTuple):
    """simulate; version: what makes its results another solver's; step_factors: of the attempts at a run."""

    simulate: Simulate
    version: str
    step_factors: tuple[float, ...] = STEP_FACTORS


def attempt(
    simulate: Simulate, case: Case, values: Mapping[str, float], step_factor: float, **options: Any
) -> Histories | str:
    """Histories of the case with SI `values`, or why there are none; the machine's fault is raised, never returned.

    options: further arguments of `simulate`, such as threads=1 in a campaign.
    """
    try:
        histories = simulate(case.with_values(values), step_factor=step_factor, **options)
    except Exception as error:  # one run must not end the others: its failure is recorded by name and reported
        reason = str(error) if isinstance(error, RunFailed) else f"{type(error).__name__}: {error}"
        if isinstance(error, MACHINE_FAULTS):
            raise
        if _caused_by_the_machine(error):
            raise MachineFailure(reason) from error
        return reason
    broken = [name for name, channel in histories.channels.items() if not np.all(np.isfinite(channel))]
    return f"the history of {', '.join(broken)} is not finite" if broken else histories


def _caused_by_the_machine(error: BaseException) -> bool:
    """Whether one of MACHINE_FAULTS is the stated cause of another error."""
    cause = error.__cause__
    return cause not in (None, error) and (isinstance(cause, MACHINE_FAULTS) or _caused_by_the_machine(cause))
