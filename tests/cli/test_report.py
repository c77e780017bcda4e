"""`birdstrike report` as a user meets it."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from birdstrike.cli.app import app
from birdstrike.data.errors import RunFailed
from birdstrike.data.histories import Histories
from birdstrike.reports.sections import models, summary
from birdstrike.solver.case.case import Case
from tests.reports.synthetic import finished_folder, simulate, stand_in_for_models, write_record


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished loop around the stand-in."""
    folder = tmp_path_factory.mktemp("loop")
    with pytest.MonkeyPatch.context() as patch:
        return finished_folder(folder, write_record(folder / "shot7.csv"), patch, runs=12, posterior=False)


@pytest.fixture(autouse=True)
def _short_page_simulated_by_the_stand_in(monkeypatch: pytest.MonkeyPatch) -> None:
    stand_in_for_models(monkeypatch)
    monkeypatch.setattr("birdstrike.reports.page.page.SECTIONS", (summary.section, models.section))


def invoke(*arguments: str) -> Result:
    return CliRunner().invoke(app, ["report", *arguments])


def test_five_findings_and_the_path_are_the_last_lines(folder: Path) -> None:
    result = invoke(str(folder))
    assert result.exit_code == 0, result.output
    lines = result.stdout.splitlines()
    assert [line[:2] for line in lines[-6:-1]] == ["1.", "2.", "3.", "4.", "5."]
    cards = f"the cards: birdstrike export {folder}"
    assert lines[-1] == f"Written to {folder / 'report.html'}. Next: open it in a browser; {cards}."
    assert (folder / "report.html").stat().st_size > 100_000
    assert len(list((folder / "models" / "runs").glob("*.h5"))) == 4


def test_a_strike_that_is_stored_is_not_paid_again(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert invoke(str(folder)).exit_code == 0

    def refused(*_: object, **__: object) -> None:
        raise AssertionError("a stored strike was run again")

    monkeypatch.setattr("birdstrike.inversion.forward.simulate", refused)
    assert invoke(str(folder)).exit_code == 0


def test_ctrl_c_keeps_the_simulations_that_are_finished(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for part in ("doe", "inversion"):
        shutil.copytree(folder / part, tmp_path / part)
    left = iter((simulate, simulate))

    def interrupted(case: Case, **_: object) -> Histories:
        strike = next(left, None)
        if strike is None:
            raise KeyboardInterrupt
        return strike(case)

    monkeypatch.setattr("birdstrike.inversion.forward.simulate", interrupted)
    assert invoke(str(tmp_path)).exit_code == 130
    assert len(list((tmp_path / "models" / "runs").glob("*.h5"))) == 2
    assert not (tmp_path / "report.html").exists()


def test_a_bird_that_fails_is_named_and_the_others_are_shown(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for part in ("doe", "inversion"):
        shutil.copytree(folder / part, tmp_path / part)

    def failing(case: Case, **_: object) -> Histories:
        if case.bird.material.model == "elastic":
            raise RunFailed("the step collapsed", "lower solver.courant")
        return simulate(case)

    monkeypatch.setattr("birdstrike.inversion.forward.simulate", failing)
    assert invoke(str(tmp_path)).exit_code == 0
    text = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "The elastic bird has no curve, its simulation failed: the step collapsed" in text
    assert "hydrodynamic 4.80 mm at" in text


def test_without_the_models_nothing_is_simulated(folder: Path, tmp_path: Path) -> None:
    for part in ("doe", "inversion"):
        shutil.copytree(folder / part, tmp_path / part)
    assert invoke(str(tmp_path), "--no-models").exit_code == 0
    assert not (tmp_path / "models").exists()
    assert "Only the inverted bird was simulated" in (tmp_path / "report.html").read_text(encoding="utf-8")


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


def test_a_file_in_the_folders_place_is_called_a_file(tmp_path: Path) -> None:
    (tmp_path / "afile").touch()
    result = invoke(str(tmp_path / "afile"))
    assert result.exit_code == 1
    assert f"{tmp_path / 'afile'} is a file; give the folder" in result.stderr


def test_a_damaged_run_is_passed_over_in_one_plain_line_and_not_touched(folder: Path, tmp_path: Path) -> None:
    copy = tmp_path / "loop"
    shutil.copytree(folder, copy)
    damaged = sorted((copy / "doe" / "runs").glob("*.h5"))[0]
    damaged.write_bytes(b"scrambled")
    result = invoke(str(copy))
    assert result.exit_code == 0, result.output
    (line,) = (line for line in result.stderr.splitlines() if not line.endswith("%"))  # progress where it is slow
    assert line.startswith(f"warning: {damaged} is damaged (")
    assert line.endswith("it is left as it is and not used")
    assert damaged.read_bytes() == b"scrambled"


def test_without_a_copy_of_the_case_the_inversion_is_shown_and_the_copy_named(folder: Path, tmp_path: Path) -> None:
    copy = tmp_path / "loop"
    shutil.copytree(folder, copy)
    (copy / "doe" / "case.toml").unlink()
    result = invoke(str(copy))
    assert result.exit_code == 0, result.output
    assert f"no case.toml in {copy / 'doe'}; make it with: birdstrike run-doe CASE" in result.stdout
    assert "Verified: the simulation at the" in result.stdout


def test_each_folder_by_itself_gets_a_page_that_names_what_is_missing(folder: Path, tmp_path: Path) -> None:
    shutil.copytree(folder / "doe", tmp_path / "my campaign")
    campaign = invoke(str(tmp_path / "my campaign"))
    assert campaign.exit_code == 0, campaign.output
    assert "1. Campaign: 12 simulations of case demo, uniform design." in campaign.stdout
    assert f"birdstrike train-and-invert '{tmp_path / 'my campaign'}' --measured" in campaign.stdout
    page = (tmp_path / "my campaign" / "report.html").read_text(encoding="utf-8")
    for words in ("What is missing", "Test set-up", "All 12 simulations: displacement centre", "no inversion.json"):
        assert words in page, words
    shutil.copytree(folder / "inversion", tmp_path / "elsewhere" / "inversion")
    alone = invoke(str(tmp_path / "elsewhere" / "inversion"))
    assert alone.exit_code == 0, alone.output
    assert "no campaign of the same case beside" in alone.stdout
    page = (tmp_path / "elsewhere" / "inversion" / "report.html").read_text(encoding="utf-8")
    for words in ("Inverted parameters", "The record (measured) and the verification", "Identified by the"):
        assert words in page, words


def test_an_inversion_finds_its_campaign_beside_it_or_takes_the_one_that_is_named(folder: Path, tmp_path: Path) -> None:
    shutil.copytree(folder / "doe", tmp_path / "campaign")
    shutil.copytree(folder / "inversion", tmp_path / "inversion")
    found = invoke(str(tmp_path / "inversion"), "--no-models")
    assert found.exit_code == 0, found.output
    assert "4. Prior predictive" in found.stdout
    shutil.move(tmp_path / "campaign", tmp_path / "far" / "campaign")
    named = invoke(str(tmp_path / "inversion"), "--no-models", "--doe", str(tmp_path / "far" / "campaign"))
    assert "4. Prior predictive" in named.stdout
    wrong = invoke(str(tmp_path / "inversion"), "--diagnosis", str(tmp_path / "far"))
    assert wrong.exit_code == 1
    assert f"no diagnosis in {tmp_path / 'far'}: it lacks diagnosis.json, diagnosis.csv" in wrong.stderr


def test_a_diagnosis_of_another_case_is_refused(folder: Path, tmp_path: Path) -> None:
    other = tmp_path / "diagnosis"
    other.mkdir()
    for name in ("diagnosis.json", "diagnosis.csv"):
        (other / name).write_text("")
    (other / "case.toml").write_text('extends = "demo"\n[plate]\nthickness = "8 mm"\n')
    wrong = invoke(str(folder / "inversion"), "--no-models", "--diagnosis", str(other))
    assert wrong.exit_code == 1
    assert f"the diagnosis in {other} is of another case" in wrong.stderr


def test_help_has_an_example() -> None:
    assert "Example: birdstrike report" in " ".join(invoke("--help").output.split())
