"""What the machine ends (memory, disk, a signal) is no failure of the run: it is never stored, and stays due."""

from __future__ import annotations

import errno
import json
import os
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner, Result

from birdstrike.cli.app import app
from birdstrike.data.errors import RunFailed
from birdstrike.data.histories import Histories
from birdstrike.data.storage.store import RunStore
from birdstrike.doe.attempt import Solver
from birdstrike.doe.campaign.run import Finished, PlannedRun, carried_out, failed_runs, state_of
from birdstrike.solver.case.case import Case
from tests.doe import stand_in
from tests.doe.campaign.test_campaign import campaign
from tests.doe.external_case import PROGRAM, written

FALLS = """
from functools import partial
from pathlib import Path
if not Path(MARK).exists():
    Path(MARK).touch()
    ENDS
"""
"""Put before the external program: at its first call it ends as the machine would end it."""

ENDINGS = {
    "killed": "os.kill(os.getpid(), 9)",
    "killed, as a shell reports it": "sys.exit(137)",
    "disk full": "sys.exit('write error: No space left on device')",
    "memory full": "sys.exit('fork: Cannot allocate memory')",
}


def run_doe(case: Path, out: Path) -> Result:
    """The command, with a thread for its worker: the external program is a process of its own anyway."""
    words = ["run-doe", str(case), "--out", str(out), "--design", "lhs", "--runs", "2", "--workers", "1", "--json"]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("birdstrike.doe.campaign.campaign.process_pool", ThreadPoolExecutor)
        return CliRunner().invoke(app, words)


@pytest.mark.parametrize("how", ENDINGS)
def test_an_external_run_that_the_machine_ended_is_made_by_the_next_call(how: str, tmp_path: Path) -> None:
    case = written(tmp_path / "case")
    program = PROGRAM
    text = program.read_text(encoding="utf-8")
    falls = FALLS.replace("MARK", repr(str(tmp_path / "fallen"))).replace("ENDS", ENDINGS[how])
    fallible = tmp_path / "fallible.py"
    fallible.write_text(text.replace("def main(deck):", f"{falls}\ndef main(deck):"), encoding="utf-8")
    case.write_text(case.read_text().replace(str(program), str(fallible)))
    out = tmp_path / "out"
    first = run_doe(case, out)
    assert first.exit_code == 2, first.output
    assert "the same command repeats those that the machine ended, --retry-failed the others too" in first.output
    assert RunStore(out / "runs").failed_keys() == []
    summary = json.loads((out / "summary.json").read_text())
    assert [run["status"] for run in summary["runs"]].count("pending") == 1
    assert "the next call tries it again" in summary["failed"][0]["reason"]
    again = run_doe(case, out)
    assert again.exit_code == 0, again.output
    assert len(RunStore(out / "runs").keys()) == 2


def out_of_memory(case: Case, **_: object) -> Histories:  # noqa: ARG001 (a solver takes it)
    raise ValueError("the neighbour list does not fit") from MemoryError()


def test_an_error_that_memory_caused_is_not_stored(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tests.doe.campaign.test_campaign.strike", out_of_memory)
    with pytest.raises(RunFailed, match="none of the 6"):
        campaign(tmp_path)
    assert RunStore(tmp_path / "runs").failed_keys() == []


@pytest.mark.parametrize("number", [errno.EMFILE, errno.EIO])
def test_a_run_that_the_system_refused_stays_due_and_the_others_are_made(
    number: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls: list[Case] = []

    def refused_once(case: Case, **options: Any) -> Histories:
        calls.append(case)
        if len(calls) == 1:
            raise OSError(number, os.strerror(number))
        return stand_in.strike(case, **options)

    monkeypatch.setattr("tests.doe.campaign.test_campaign.strike", refused_once)
    assert len(campaign(tmp_path).runs) == 5
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert [run["status"] for run in summary["runs"]].count("pending") == 1
    assert os.strerror(number) in summary["failed"][0]["reason"]
    assert RunStore(tmp_path / "runs").failed_keys() == []
    assert len(campaign(tmp_path).runs) == 6
    assert len(calls) == 7


def test_a_file_that_is_not_there_ends_the_campaign(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def without_program(case: Case, **_: object) -> Histories:  # noqa: ARG001
        raise FileNotFoundError(errno.ENOENT, "No such file", "solver.exe")

    monkeypatch.setattr("tests.doe.campaign.test_campaign.strike", without_program)
    with pytest.raises(FileNotFoundError):
        campaign(tmp_path)


def test_a_damaged_file_of_a_store_that_is_only_read_stays_and_the_run_is_made_anew(tmp_path: Path) -> None:
    case = stand_in.reference()
    solver = Solver(stand_in.strike, stand_in.VERSION)
    own, read = RunStore(tmp_path / "own"), RunStore(tmp_path / "read")
    run = PlannedRun.of(0, {}, case, solver)
    damaged = read.path(run.keys[1.0])
    damaged.parent.mkdir()
    damaged.write_bytes(b"cut short")
    with pytest.warns(UserWarning, match="left as it is"):
        outcome = carried_out([own, read], run, solver, case)
    assert isinstance(outcome, Finished)
    assert outcome.store is own
    assert [path.name for path in read.folder.iterdir()] == [damaged.name]
    damaged.unlink()
    own.path(outcome.key).write_bytes(b"cut short")
    with pytest.warns(UserWarning, match="set aside"):
        assert state_of([own, read], run) == 1.0


@pytest.mark.parametrize("cured", [True, False])
def test_a_run_cured_by_half_the_step_is_not_among_the_failed_ones(cured: bool, tmp_path: Path) -> None:
    case, store = stand_in.reference(), RunStore(tmp_path)
    solver = Solver(partial(stand_in.strike, breaks_above=0.0, cured_by_step=cured), stand_in.VERSION)
    run = PlannedRun.of(0, {}, case.with_values({"bird.material.viscosity": 10.0}), solver)
    carried_out([store], run, solver, case.with_values({"bird.material.viscosity": 10.0}))
    assert len(store.failed_keys()) == (1 if cured else 2)
    assert failed_runs(store, (), stand_in.VERSION) == ([] if cured else store.failed_keys())
    assert failed_runs(store, (), "another version") == []
