"""`birdstrike verify`: a cheap row, the list, and a pattern that fits nothing."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from birdstrike.cli.app import app

ROOT = Path(__file__).resolve().parents[2]


def test_one_problem_writes_its_page_and_a_json_line(tmp_path: Path) -> None:
    """From the outside, in worker processes; the page and its rows agree."""
    program = [sys.executable, "-m", "birdstrike", "verify", "--only", "kernel_moments", "--json", "--out"]
    environment = {"PYTHONPATH": str(ROOT)}
    ended = subprocess.run(
        [*program, "page.md"], cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=120, check=False
    )
    assert ended.returncode == 0, ended.stderr
    outcome = json.loads(ended.stdout.splitlines()[-1])
    assert outcome["stands"] is True
    assert {row["verdict"] for row in outcome["rows"]} == {"within"}
    text = (tmp_path / "page.md").read_text()
    assert outcome["solver_version"] in text
    assert all(row["name"] in text for row in outcome["rows"])


def test_the_list_names_the_problems() -> None:
    result = CliRunner().invoke(app, ["verify", "--list"])
    assert result.exit_code == 0
    assert "openradioss_viscous: The OpenRadioss strike" in result.stdout


def test_a_pattern_that_fits_nothing_is_the_users_error() -> None:
    result = CliRunner().invoke(app, ["verify", "--only", "no_such", "--json"])
    assert result.exit_code == 1
    assert "fits no problem" in json.loads(result.stdout.splitlines()[-1])["errors"][0]


def test_a_row_that_does_not_stand_exits_with_2(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from birdstrike.reports.verification import problem as rows
    from birdstrike.reports.verification.cache import Result
    from birdstrike.reports.verification.problem import Problem, Solution
    from birdstrike.reports.verification.verify import Verification

    problem = Problem("p", "F", "", lambda _: Solution(()))
    bad = Result(problem, (rows.below("misfit", 4.0, 3.0, "%", "s"),), (), {}, 1.0)
    monkeypatch.setattr("birdstrike.reports.verification.verify.verify", lambda *_, **__: Verification((bad,), 1.0))
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(app, ["verify", "--json"])
    assert result.exit_code == 2
    assert "misfit" in json.loads(result.stdout.splitlines()[-1])["errors"][0]
