"""Large campaigns in small: what a run costs beside the strike, and that none of its curves stays in memory."""

from __future__ import annotations

import time
import weakref
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pandas as pd

from birdstrike.data.histories import Histories
from birdstrike.doe.campaign.campaign import run_campaign
from birdstrike.doe.campaign.runner import RunCounts
from birdstrike.solver.case.case import Case
from tests.doe.stand_in import TIME, VERSION, design, reference, strike

RUNS = 100


def test_a_run_costs_little_beside_the_strike_and_leaves_nothing_in_memory(tmp_path: Path) -> None:
    made: list[weakref.ref[Histories]] = []
    alive: list[int] = []

    def counted(case: Case, **options: float) -> Histories:
        histories = strike(case, **options)  # type: ignore[arg-type]
        made.append(weakref.ref(histories))
        return histories

    def note(state: RunCounts) -> None:
        if state.finished == RUNS:
            alive.append(sum(reference() is not None for reference in made))

    planned, begun = design(RUNS), time.process_time()
    with ThreadPoolExecutor(1) as executor:
        run_campaign(
            reference(), planned, tmp_path, workers=1, simulate=counted, solver_version=VERSION, say=lambda _: None,
            progress=note, executor=executor,
        )  # fmt: skip
    assert (time.process_time() - begun) / RUNS < 10e-3  # `make bench` holds 10 000 runs to 5 ms
    assert alive[0] <= 5  # the last few, in futures that are just being let go
    assert len(pd.read_csv(tmp_path / "curves.csv")) == RUNS * len(TIME)
