"""What the machine ends (memory, disk, a signal) is no failure of the run: it is never stored, and stays due."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from birdstrike.cli.app import app
from birdstrike.data.errors import RunFailed
from birdstrike.data.histories import Histories
from birdstrike.data.store import RunStore
from birdstrike.solver.case.case import Case
from tests.doe.campaign.test_campaign import campaign
from tests.doe.external_case import PROGRAM, written

FALLS = """
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
    words = ["run-doe", str(case), "--out", str(out), "--design", "lhs", "--runs", "2", "--workers", "1", "--json"]
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
