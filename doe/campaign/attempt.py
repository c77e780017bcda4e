"""One attempt at a strike, as a worker carries it out: it loads the case and the solver, and nothing of the designs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from birdstrike.data.errors import RunFailed
from birdstrike.data.histories import Histories
from birdstrike.solver.case.case import Case

Simulate = Callable[..., Histories]
"""simulate(case, *, step_factor, threads) -> Histories; raises RunFailed. A module's function: it goes to workers."""


def attempt(
    simulate: Simulate, case: Case, values: Mapping[str, float], step_factor: float, **options: Any
) -> Histories | str:
    """Histories of the case with SI `values`, or why there are none; the machine's fault (memory, disk) is raised.

    options: further arguments of `simulate`, such as threads=1 in a campaign.
    """
    try:
        histories = simulate(case.with_values(values), step_factor=step_factor, **options)
    except (MemoryError, OSError):
        raise
    except RunFailed as failure:
        return str(failure)
    except Exception as error:  # one strike must not end the others: it is recorded by name and reported
        return f"{type(error).__name__}: {error}"
    broken = [name for name, channel in histories.channels.items() if not np.all(np.isfinite(channel))]
    return f"the history of {', '.join(broken)} is not finite" if broken else histories
