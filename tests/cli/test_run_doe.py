"""`birdstrike run-doe` as a user meets it, with a stand-in for the solver."""

from __future__ import annotations

import json
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from birdstrike.cli.app import app
from birdstrike.cli.run_doe import quality_table, run_doe
from birdstrike.data.paths import REFERENCE
from birdstrike.doe.campaign.results import load_dataset
from birdstrike.solver.case.case import case_from_table, load_case
from birdstrike.solver.case.write import case_toml
from tests.doe.stand_in import design, strike

FILES = "design.csv, projections.svg, curves.csv, summary.json, runs/"


@pytest.fixture
def stand_in(monkeypatch: pytest.MonkeyPatch) -> pytest.MonkeyPatch:
    """The embedded solver replaced by a formula, its processes by threads (tests/doe has the processes)."""
    monkeypatch.setattr("birdstrike.solver.simulate.simulate", strike)
    monkeypatch.setattr("birdstrike.doe.campaign.campaign.process_pool", ThreadPoolExecutor)
    return monkeypatch


def invoke(out: Path, *options: str) -> Result:
    """The command on the reference strike with one worker."""
    return CliRunner().invoke(app, ["run-doe", "reference_strike", "--out", str(out), "--workers", "1", *options])


def last_json(result: Result) -> dict[str, object]:
    return json.loads(result.stdout.strip().splitlines()[-1])


@pytest.mark.usefixtures("stand_in")
def test_quality_is_printed_first_and_the_last_line_says_what_next(tmp_path: Path) -> None:
    result = invoke(tmp_path, "--design", "orthogonal", "--runs", "9")
    assert result.exit_code == 0, result.output
    lines = result.stdout.splitlines()
    quality = "\n".join(lines[: next(i for i, line in enumerate(lines) if "inactive" in line)])
    for label in ("rank", "condition", "largest correlation", "centred discrepancy (squared)"):
        assert label in quality
    assert lines[-2] == f"Written to {tmp_path}: 9 of 9 runs ({FILES})."
    assert lines[-1] == f"Next: birdstrike train-and-invert {tmp_path} --measured shot.csv --out inversion"
    assert len(load_dataset(tmp_path).runs) == 9


@pytest.mark.usefixtures("stand_in")
def test_a_campaign_of_too_few_runs_names_the_command_that_adds_them(tmp_path: Path) -> None:
    result = invoke(tmp_path, "--design", "lhs", "--runs", "3")
    assert result.exit_code == 0, result.output
    last = result.stdout.splitlines()[-1]
    assert last == f"Next: birdstrike run-doe reference_strike --out {tmp_path} --design lhs --seed 0 --runs 5"
    further = CliRunner().invoke(app, [*last.removeprefix("Next: birdstrike ").split(), "--workers", "1"])
    assert "Next: birdstrike train-and-invert" in further.stdout


@pytest.mark.usefixtures("stand_in")
def test_a_single_parameter_has_no_projections(tmp_path: Path) -> None:
    parameters = {"bird.material.viscosity": {"range": ["1 Pa s", "10 Pa s"]}}
    table = load_case("reference_strike").table | {"inversion": {"parameters": parameters}}
    case = tmp_path / "case.toml"
    case.write_text(case_toml(case_from_table(table)), encoding="utf-8")
    out = tmp_path / "out"
    options = ["--out", str(out), "--runs", "4", "--design", "lhs", "--workers", "1"]
    result = CliRunner().invoke(app, ["run-doe", str(case), *options])
    assert result.exit_code == 0, result.output
    assert ("projections.svg" in result.stdout) == (out / "projections.svg").exists()


@pytest.mark.usefixtures("stand_in")
def test_table_6_is_named_as_rank_1_and_run_all_the_same(tmp_path: Path) -> None:
    result = invoke(tmp_path, "--design", str(REFERENCE / "table6_design.csv"), "--json")
    assert result.exit_code == 0, result.output
    assert "rank 1 of 4: the 5 runs vary along 1 direction only" in result.stdout
    (following,) = (line for line in result.stdout.splitlines() if line.startswith("Next: "))
    assert following.endswith(" --allow-rank-deficient")
    answer = last_json(result)
    assert answer["schema_version"] == 1
    assert answer["runs"] == answer["finished"] == 5
    design = answer["design"]
    assert isinstance(design, dict)
    assert design["rank"] == 1
    assert design["deficient"] is True
    assert design["condition"] is None
    np.testing.assert_array_equal(load_dataset(tmp_path).runs, [1, 2, 3, 4, 5])


def test_failed_strikes_are_named_and_the_exit_code_is_2(tmp_path: Path, stand_in: pytest.MonkeyPatch) -> None:
    stand_in.setattr("birdstrike.solver.simulate.simulate", partial(strike, breaks_above=1000.0))
    result = invoke(tmp_path, "--design", "lhs", "--runs", "6", "--json")
    assert result.exit_code == 2
    summary = json.loads((tmp_path / "summary.json").read_text(encoding="utf-8"))
    failed = [entry["run"] for entry in summary["failed"]]
    assert failed
    named = f"{len(failed)} of 6 runs failed and are left out: run {', '.join(map(str, failed))}"
    assert last_json(result)["errors"] == [named]
    assert named in result.stderr
    assert len(load_dataset(tmp_path).runs) == 6 - len(failed)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--design", "unifrom"], "--design = unifrom is neither a file nor one of"),
        (["--design", "orthogonal", "--runs", "24"], "allowed: 9, 16, 25, 27, 49"),
        (["--runs", "1"], "--runs = 1 is below 2"),
        (["--seed", "-1"], "--seed = -1 is below 0"),
        (["--set", 'plate.thickness="-1 mm"'], "plate.thickness"),
        (["--design", "lhs", "--workers", "0"], "--workers = 0 is below 1"),
    ],
)
def test_the_user_s_mistakes_exit_1_without_a_traceback(tmp_path: Path, options: list[str], message: str) -> None:
    result = invoke(tmp_path / "out", *options)
    assert result.exit_code == 1
    assert message in result.stderr
    assert "Traceback" not in result.output
    assert not (tmp_path / "out").exists()


@pytest.mark.usefixtures("stand_in")
def test_a_folder_of_another_campaign_is_refused(tmp_path: Path) -> None:
    assert invoke(tmp_path, "--design", "lhs", "--runs", "4").exit_code == 0
    result = invoke(tmp_path, "--design", "lhs", "--runs", "4", "--seed", "7")
    assert result.exit_code == 1
    assert "the lhs design of 4 runs and seed 0" in result.stderr
    assert "seed 7" in result.stderr


@pytest.mark.usefixtures("stand_in")
@pytest.mark.parametrize(
    "options",
    [("--workers", "0"), ("--set", "bird.particles=300"), ("--seed", "7")],
    ids=["no worker", "another case", "another design"],
)
def test_a_refused_campaign_shows_no_design(tmp_path: Path, options: tuple[str, ...]) -> None:
    assert invoke(tmp_path, "--design", "lhs", "--runs", "4").exit_code == 0
    refused = invoke(tmp_path, "--design", "lhs", "--runs", "4", *options)
    assert refused.exit_code == 1
    assert refused.stdout == ""


@pytest.mark.usefixtures("stand_in")
def test_the_python_verb_does_the_same(tmp_path: Path) -> None:
    dataset = run_doe(
        "reference_strike", tmp_path / "verb", design="lhs", runs=4, seed=3, workers=1, say=lambda _: None
    )
    assert invoke(tmp_path / "command", "--design", "lhs", "--runs", "4", "--seed", "3").exit_code == 0
    assert len(dataset.runs) == 4
    first, second = (tmp_path / name / "curves.csv" for name in ("verb", "command"))
    assert first.read_bytes() == second.read_bytes()


def test_help_shows_an_example() -> None:
    result = CliRunner().invoke(app, ["run-doe", "--help"])
    assert result.exit_code == 0
    assert "Example: birdstrike run-doe reference_strike" in result.stdout


@pytest.mark.usefixtures("stand_in")
def test_fewer_runs_than_an_emulator_needs_are_told(tmp_path: Path) -> None:
    few, enough = (invoke(tmp_path / runs, "--runs", runs) for runs in ("3", "6"))
    said = "An emulator of these parameters needs 5 finished runs."
    assert said in few.output.replace("\n", " ")
    assert "An emulator of these parameters" not in enough.output


@pytest.mark.parametrize(("runs", "said"), [(6, "runs outside the ranges"), (10_001, "not taken of over 10,000 runs")])
def test_why_a_design_has_no_discrepancy_is_said(runs: int, said: str) -> None:
    none = replace(design(6).quality(), runs=runs, discrepancy=None, wraparound=None)
    assert list(quality_table(design(6), none).columns[1].cells)[3:5] == [said, said]
