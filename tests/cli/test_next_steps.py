"""The line "Next:" of a command: real names, quoted so that a shell takes them."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest
from typer.testing import CliRunner

from birdstrike.cli.app import app
from birdstrike.cli.next_steps import record_here


@pytest.fixture(autouse=True)
def _here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def following(*arguments: str) -> list[str]:
    """Words of the command that comes next, as a shell splits them."""
    found = CliRunner().invoke(app, list(arguments), env={"COLUMNS": "300"})
    assert found.exit_code == 0, found.output
    return shlex.split(found.stdout.rpartition("Next: ")[2])


def test_names_with_spaces_and_settings_come_through_a_shell() -> None:
    assert following("new", "my shot") == ["birdstrike", "check", "my shot.toml"]
    settings = ("--set", "impact.speed=80 m/s", "--set", "time.end=0.2 ms")
    assert following("check", "my shot.toml", *settings) == [
        *("birdstrike", "simulate", "my shot.toml"),
        *settings,
        *("--out", "strike"),
    ]


def test_an_import_names_the_case_of_the_folder_where_there_is_one_for_its_sensors() -> None:
    Path("scope.txt").write_text("0.0 0.0\n0.5 1.1\n1.0 4.0\n1.5 5.6\n")
    options = ("--sensor", "displacement_centre", "--unit", "mm", "--time-unit", "ms", "--out", "shot 1.csv")
    expected = ["--measured", "shot 1.csv", "--out", "loop"]
    assert following("import", "scope.txt", *options) == ["birdstrike", "close-the-loop", "CASE", *expected]
    following("new", "rig")
    Path("other.toml").write_text("[tool]\nname = 'no case'\n")
    assert following("import", "scope.txt", *options) == ["birdstrike", "close-the-loop", "rig.toml", *expected]


def test_the_only_record_that_fits_a_case_is_named() -> None:
    Path("plan.csv").write_text("run,viscosity\n1,2\n")
    Path("a b.csv").write_text("# Shot 1.\ntime [ms],w [mm]\n0,0\n1,2\n")
    assert record_here(["w", "force"]) == "a b.csv"
    assert record_here(["force"]) == "shot.csv"
    Path("c.csv").write_text("time [ms],w [mm]\n0,0\n1,2\n")
    assert record_here(["w"]) == "shot.csv", "two would do: neither is guessed"
