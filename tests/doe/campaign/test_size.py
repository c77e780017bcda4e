"""Large campaigns in small: none of a run's curves stays in memory (tests/benchmarks measures what a run costs)."""

from __future__ import annotations

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


def test_a_campaign_keeps_no_curves_in_memory(tmp_path: Path) -> None:
    made: list[weakref.ref[Histories]] = []
    alive: list[int] = []

    def counted(case: Case, **options: float) -> Histories:
        histories = strike(case, **options)  # type: ignore[arg-type]
        made.append(weakref.ref(histories))
        return histories

    def note(state: RunCounts) -> None:
        if state.finished == RUNS:
            alive.append(sum(reference() is not None for reference in made))

    with ThreadPoolExecutor(1) as executor:
        run_campaign(
            reference(), design(RUNS), tmp_path, workers=1, simulate=counted, solver_version=VERSION,
            say=lambda _: None, progress=note, executor=executor,
        )  # fmt: skip
    assert alive[0] <= 5  # the last few, in futures that are just being let go
    assert len(pd.read_csv(tmp_path / "curves.csv")) == RUNS * len(TIME)
