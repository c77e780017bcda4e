"""`birdstrike report` as a user meets it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from birdstrike.cli.app import app
from tests.reports.synthetic import finished_folder, write_record


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished loop around the stand-in."""
    folder = tmp_path_factory.mktemp("loop")
    with pytest.MonkeyPatch.context() as patch:
        return finished_folder(folder, write_record(folder / "shot7.csv"), patch, runs=12)


def invoke(*arguments: str) -> Result:
    return CliRunner().invoke(app, ["report", *arguments])


def test_five_findings_and_the_path_are_the_last_lines(folder: Path) -> None:
    result = invoke(str(folder))
    assert result.exit_code == 0, result.output
    lines = result.stdout.splitlines()
    assert [line[:2] for line in lines[-6:-1]] == ["1.", "2.", "3.", "4.", "5."]
    assert lines[-1] == f"Written to {folder / 'report.html'}. Next: open it in a browser."
    assert (folder / "report.html").stat().st_size > 100_000


def test_out_and_json(folder: Path, tmp_path: Path) -> None:
    page = tmp_path / "shot_7.html"
    result = invoke(str(folder), "--out", str(page), "--json")
    assert result.exit_code == 0, result.output
    answer = json.loads(result.stdout.splitlines()[-1])
    assert answer["schema_version"] == 1
    assert answer["report"] == str(page)
    assert len(answer["findings"]) == 5
    assert page.exists()


def test_what_is_missing_is_named_with_its_command_and_no_traceback(tmp_path: Path) -> None:
    result = invoke(str(tmp_path))
    assert result.exit_code == 1
    assert f"birdstrike run-doe CASE --out {tmp_path / 'doe'}" in result.stderr
    assert "birdstrike train-and-invert" in result.stderr
    assert "Traceback" not in result.output


def test_help_has_an_example() -> None:
    assert "Example: birdstrike report" in " ".join(invoke("--help").output.split())
