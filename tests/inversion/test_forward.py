"""The solver behind the run store: each run is paid once, a failing one gets a second chance."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import birdstrike.inversion.forward
from birdstrike.data.errors import RunFailed
from birdstrike.data.histories import Histories
from birdstrike.data.progress import Progress, silent
from birdstrike.data.storage.store import RunStore
from birdstrike.inversion.forward import StoredSolver, watched
from birdstrike.solver.case.case import Case, load_case

THETA = {"bird.material.viscosity": 400.0}


class Solver:
    """Counts its strikes; fails at the given step factors."""

    def __init__(self, failing: tuple[float, ...] = ()) -> None:
        self.failing, self.struck = failing, []

    def __call__(self, case: Case, *, step_factor: float = 1.0, progress: Progress = silent) -> Histories:
        self.struck.append((case.bird.material.viscosity, step_factor))
        if step_factor in self.failing:
            raise RunFailed(f"unstable at {step_factor:g}")
        progress(1.0)
        time = np.linspace(0.0, 1e-3, 5)
        return Histories(
            time, {"displacement_centre": time * step_factor}, {"displacement_centre": "m"}, {"wall_s": 1.0}
        )


@pytest.fixture
def case() -> Case:
    return load_case("reference_strike")


def solver_with(monkeypatch: pytest.MonkeyPatch, failing: tuple[float, ...] = ()) -> Solver:
    fake = Solver(failing)
    monkeypatch.setattr(birdstrike.inversion.forward, "simulate", fake)
    return fake


def test_a_run_is_paid_once(case: Case, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fake = solver_with(monkeypatch)
    first = StoredSolver(case, RunStore(tmp_path))(THETA)
    second = StoredSolver(case, RunStore(tmp_path))(THETA)
    assert fake.struck == [(400.0, 1.0)]
    np.testing.assert_array_equal(first.channels["displacement_centre"], second.channels["displacement_centre"])
    assert first.summary["run_key"] == second.summary["run_key"] in RunStore(tmp_path).keys()


def test_a_run_of_the_campaign_is_not_paid_again(case: Case, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fake = solver_with(monkeypatch)
    StoredSolver(case, RunStore(tmp_path / "doe"))(THETA)
    StoredSolver(case, RunStore(tmp_path / "own"), (RunStore(tmp_path / "doe"),))(THETA)
    assert len(fake.struck) == 1
    StoredSolver(case, RunStore(tmp_path / "own"))({"bird.material.viscosity": 401.0})
    assert len(fake.struck) == 2


def test_unstable_run_is_repeated_at_half_the_step(case: Case, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fake = solver_with(monkeypatch, failing=(1.0,))
    found = StoredSolver(case, RunStore(tmp_path))(THETA)
    assert [factor for _, factor in fake.struck] == [1.0, 0.5]
    assert found.channels["displacement_centre"][-1] == pytest.approx(0.5e-3)
    StoredSolver(case, RunStore(tmp_path))(THETA)
    assert len(fake.struck) == 2, "the failure is on record and is not paid again"


def test_run_that_fails_twice_says_why(case: Case, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fake = solver_with(monkeypatch, failing=(1.0, 0.5))
    for _ in range(2):
        with pytest.raises(RunFailed, match=r"unstable at 0\.5"):
            StoredSolver(case, RunStore(tmp_path))(THETA)
    assert len(fake.struck) == 2


def test_progress_of_the_solver_is_passed_on(case: Case, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    solver_with(monkeypatch)
    seen: list[float] = []
    watched(StoredSolver(case, RunStore(tmp_path)), seen.append)(THETA)
    assert seen == [1.0]

    def other(_: Mapping[str, float]) -> Any:
        return None

    assert watched(other, seen.append) is other
