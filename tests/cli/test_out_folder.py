"""A folder of results belongs to the command that made it: another's output does not go into it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import CliRunner

import birdstrike
from birdstrike.cli.app import app
from birdstrike.data.errors import UserError
from birdstrike.data.storage.out_folder import reserved
from tests.doe.campaign.test_campaign import campaign

RECORD = "time [ms],displacement_centre [mm]\n0.0,0.0\n0.5,1.0\n1.0,2.0\n"
SMALL = (
    "--set",
    "bird.particles=100",
    "--set",
    "plate.elements=[8, 8]",
    "--set",
    "time.end=0.2 ms",
    "--set",
    "time.snapshots=[]",
)
COMMANDS = {
    "simulate": ("demo", *SMALL),
    "diagnose": ("demo", "--measured", "record.csv"),
    "converge": ("demo", *SMALL),
    "train-and-invert": ("campaign", "--measured", "record.csv"),
    "close-the-loop": ("demo", "--measured", "record.csv"),
    "compare-methods": ("campaign",),
    "calibrate-models": ("demo", "--measured", "record.csv"),
}


def content(folder: Path) -> dict[str, bytes]:
    """Every file below a folder."""
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize("command", COMMANDS)
def test_no_command_writes_into_a_campaign(command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a campaign that no mark names, too: it was made by the function, or by an older version."""
    monkeypatch.chdir(tmp_path)
    Path("record.csv").write_text(RECORD)
    campaign(Path("campaign"))
    before = content(Path("campaign"))
    found = CliRunner().invoke(app, [command, *COMMANDS[command], "--out", "campaign"])
    assert found.exit_code == 1, found.output
    assert f"campaign was made by birdstrike run-doe; the output of {command} does not go into it" in found.stderr
    assert content(Path("campaign")) == before


@pytest.mark.parametrize(
    ("command", "call"),
    [
        ("train-and-invert", lambda: birdstrike.train_and_invert("campaign", "record.csv", "campaign")),
        ("close-the-loop", lambda: birdstrike.close_the_loop("demo", "record.csv", out="campaign")),
        ("converge", lambda: birdstrike.converge("demo", "campaign")),
    ],
)
def test_no_function_writes_into_a_campaign(
    command: str, call: Callable[[], object], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """From Python an inversion or a loop into a campaign's folder wrote over its summary.json and case."""
    monkeypatch.chdir(tmp_path)
    Path("record.csv").write_text(RECORD)
    campaign(Path("campaign"))
    before = content(Path("campaign"))
    with pytest.raises(UserError, match=f"campaign was made by birdstrike run-doe; the output of {command} does not"):
        call()
    assert content(Path("campaign")) == before


def test_no_campaign_is_written_by_python_into_another_command_s_folder(tmp_path: Path) -> None:
    (tmp_path / "diagnosis.json").write_text("{}")
    with pytest.raises(UserError, match="was made by birdstrike diagnose; the output of run-doe does not"):
        campaign(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["diagnosis.json"]


@pytest.mark.parametrize("command", COMMANDS)
def test_a_file_is_no_folder_for_results(command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """ "record.csv/null: Not a directory" was all that calibrate-models said."""
    monkeypatch.chdir(tmp_path)
    Path("record.csv").write_text(RECORD)
    found = CliRunner().invoke(app, [command, *COMMANDS[command], "--out", "record.csv"])
    assert found.exit_code == 1, found.output
    assert f"--out record.csv is a file; the output of {command} goes into a folder: choose another" in found.stderr
    assert Path("record.csv").read_text() == RECORD


def test_no_command_writes_into_the_folder_of_a_bird_model(tmp_path: Path) -> None:
    (tmp_path / "null" / "v80").mkdir(parents=True)
    (tmp_path / "models.json").write_text("{}")
    (tmp_path / "null" / "v80" / "case.toml").write_text("")
    for command in ("calibrate-models", "simulate"):
        with pytest.raises(UserError, match="null is of the bird model null in"), reserved(tmp_path / "null", command):
            pass
    with reserved(tmp_path / "prediction", "predict"):
        (tmp_path / "prediction").mkdir()


def test_a_campaign_does_not_go_where_a_simulation_is_but_another_simulation_does(tmp_path: Path) -> None:
    simulate = ["simulate", "demo", *SMALL, "--out", str(tmp_path)]
    assert CliRunner().invoke(app, simulate).exit_code == 0
    refused = CliRunner().invoke(app, ["run-doe", "demo", "--out", str(tmp_path)])
    assert refused.exit_code == 1
    assert "was made by birdstrike simulate" in refused.stderr
    assert not (tmp_path / "design.csv").exists()
    assert CliRunner().invoke(app, simulate).exit_code == 0


def test_a_command_that_fails_leaves_no_mark_in_a_folder_of_the_user_s(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    assert CliRunner().invoke(app, ["simulate", "no_such_case", "--out", str(tmp_path)]).exit_code == 1
    assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]


@pytest.mark.parametrize("out", ["shot.csv", "folder/../shot.csv", "link.csv"])
def test_import_does_not_overwrite_its_input(out: str, tmp_path: Path) -> None:
    (tmp_path / "folder").mkdir()
    record = tmp_path / "shot.csv"
    record.write_text("t [ms];w [mm]\n0,0;0,0\n0,1;1,0\n0,2;2,0\n")
    (tmp_path / "link.csv").hardlink_to(record)
    before = record.read_bytes()
    found = CliRunner().invoke(app, ["import", str(record), "--sensor", "w", "--out", str(tmp_path / out)])
    assert found.exit_code == 1, found.output
    assert "is the file that is imported" in found.stderr
    assert record.read_bytes() == before
