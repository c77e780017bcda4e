"""Failed runs: stored and not paid again, tried again when the user asks, by every command that runs simulations."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from birdstrike.cli.app import app
from birdstrike.data.errors import RunFailed
from birdstrike.data.histories import Histories
from birdstrike.data.storage.store import RunStore
from birdstrike.solver.case.case import Case
from tests.inversion import small_campaign
from tests.inversion.diagnosis.rig import few_simulations

Arguments = Callable[[Path], list[str]]

RUN_DOE = ["run-doe", "demo", "--design", "lhs", "--runs", "4"]
SMALL = ["--set", "bird.particles=350", "--set", "plate.elements=[10, 8]"]


class FailingSolver:
    """A solver that fails at every case; calls: how often it was asked."""

    def __init__(self) -> None:
        self.calls = 0

    def __call__(self, case: Case, **_: object) -> Histories:  # noqa: ARG002 (a solver takes it)
        self.calls += 1
        raise RunFailed("the step collapsed", "lower solver.courant")


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished campaign of the reference strike, and a record."""
    folder = tmp_path_factory.mktemp("data")
    small_campaign.build(folder / "doe")
    small_campaign.write_record(folder / "record.csv")
    return folder


@pytest.fixture
def solver(data: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[FailingSolver]:  # noqa: ARG001 (made by a solver that works)
    """In place of the embedded solver, on threads of this process."""
    stand_in = FailingSolver()
    for module in ("solver.simulate", "inversion.forward", "doe.campaign.simulations"):
        monkeypatch.setattr(f"birdstrike.{module}.simulate", stand_in)
    for module in ("doe.campaign.campaign", "inversion.mesh_convergence.convergence"):
        monkeypatch.setattr(f"birdstrike.{module}.process_pool", ThreadPoolExecutor)
    with few_simulations():
        yield stand_in


COMMANDS: dict[str, Arguments] = {
    "run-doe": lambda _: [*RUN_DOE, "--workers", "1"],
    "converge": lambda _: ["converge", "reference_strike_156mm", "--workers", "1", *SMALL],
    "train-and-invert": lambda data: [
        *("train-and-invert", str(data / "doe"), "--measured", str(data / "record.csv")),
        *("--method", "emulator", "--no-posterior", "--refine", "0"),
    ],
    "compare-methods": lambda data: [
        *("compare-methods", str(data / "doe"), "--case", "reference_strike"),
        *("--no-table", "--truths", "2", "--solver-truths", "0"),
    ],
    "diagnose": lambda data: [
        *("diagnose", "reference_strike", "--measured", str(data / "record.csv"), "--workers", "1"),
    ],
    "audit": lambda _: ["audit", "--most", "1", "--channels", "1", "--workers", "1"],
    "close-the-loop": lambda data: [
        *("close-the-loop", "reference_strike", "--measured", str(data / "record.csv"), "--design", "lhs"),
        *("--runs", "8", "--no-diagnosis", "--workers", "1"),
    ],
}


def invoke(command: str, data: Path, out: Path, *options: str) -> Result:
    return CliRunner().invoke(app, [*COMMANDS[command](data), "--out", str(out), *options], env={"COLUMNS": "200"})


@pytest.mark.parametrize("command", COMMANDS)
def test_a_failed_run_is_paid_once_and_again_when_a_retry_is_asked_for(
    command: str, solver: FailingSolver, data: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    invoke(command, data, out)
    first, solver.calls = solver.calls, 0
    assert first > 0
    invoke(command, data, out)
    assert solver.calls == 0, "the failures are on record"
    result = invoke(command, data, out, "--retry-failed")
    assert solver.calls == first, result.output
    solver.calls = 0
    invoke(command, data, out)
    assert solver.calls == 0, "the retry's failures are on record too"


def test_a_retry_leaves_finished_runs_alone_and_completes_the_campaign(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    asked: list[float] = []
    limit = 750.0

    def fragile(case: Case, *, step_factor: float = 1.0, **_: object) -> Histories:
        viscosity = case.bird.material.viscosity  # type: ignore[union-attr]
        asked.append(viscosity)
        if viscosity > limit or (viscosity > 400.0 and step_factor == 1.0):
            raise RunFailed("the step collapsed", "lower solver.courant")
        return small_campaign.strike(case)

    monkeypatch.setattr("birdstrike.solver.simulate.simulate", fragile)
    monkeypatch.setattr("birdstrike.doe.campaign.campaign.process_pool", ThreadPoolExecutor)
    words = ["run-doe", "reference_strike", "--design", "lhs", "--runs", "8", "--workers", "1", "--out", str(tmp_path)]
    assert CliRunner().invoke(app, words).exit_code == 2
    assert len(RunStore(tmp_path / "runs").keys()) == 4
    asked.clear()
    limit = 1e9
    assert CliRunner().invoke(app, [*words, "--retry-failed"]).exit_code == 0
    assert len(RunStore(tmp_path / "runs").keys()) == 8
    assert min(asked) > 750.0, "what finished with half the step is not run again"
