"""The commands that a report gives to make its results again: the command line takes them and asks for the same."""

from __future__ import annotations

import json
import shlex
import shutil
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from birdstrike.cli.app import app
from birdstrike.data.errors import UserError
from birdstrike.inversion.diagnosis import diagnose
from birdstrike.inversion.diagnosis.pipeline import DiagnosisOptions
from birdstrike.inversion.extras import Extras
from birdstrike.reports.evidence.sources import find_sources, repeat_line, repeat_words
from birdstrike.reports.results.commands import commands
from birdstrike.reports.results.reading import read_results
from tests.reports.html import Page

UNUSUAL = Extras(
    refine=3,
    hidden=12,
    copies=4,
    discrepancy=0.02,
    mesh=Path("a mesh study/convergence.csv"),
    filter="CFC600",
    filtered="CFC180",
    posterior=False,
    channels=("displacement_centre", "contact_force"),
    mesh_correction=True,
    outputs="linear",
)


@pytest.fixture
def loop(finished: Path, tmp_path: Path) -> Path:
    """A loop whose folder has a blank in its name."""
    for part in ("doe", "inversion"):
        shutil.copytree(finished / part, tmp_path / "my loop" / part)
    return tmp_path / "my loop"


def asked(monkeypatch: pytest.MonkeyPatch, line: str, function: str) -> tuple[tuple[Any, ...], dict[str, Any]]:
    """What a command line hands to the function that does its work, which is not done."""
    given: list[tuple[tuple[Any, ...], dict[str, Any]]] = []

    def taken(*positional: Any, **named: Any) -> None:
        given.append((positional, named))
        raise UserError("taken")

    monkeypatch.setattr(function, taken)
    program, *words = shlex.split(line)
    result = CliRunner().invoke(app, words)
    assert program == "birdstrike"
    assert given, result.output
    return given[0]


def test_the_command_of_an_inversion_asks_for_the_same_options(loop: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Method, refinement, neurons, channels, discrepancy, mesh, filter, outputs and copies were left out."""
    path = loop / "inversion" / "options.json"
    stored = json.loads(path.read_text()) | {"method": "network", "trainer": "adam", "seed": 7}
    stored |= {"allow_rank_deficient": True, "measured": ["my shots/shot 7.csv"], "cases": ["the rig.toml"]}
    path.write_text(json.dumps(stored | {"extras": asdict(UNUSUAL)}, default=str))
    _, inversion = commands(read_results(loop))
    (doe, measured, _), named = asked(
        monkeypatch, inversion.line, "birdstrike.inversion.train_and_invert.train_and_invert"
    )
    assert named["extras"] == UNUSUAL
    assert (doe, measured, named["case"]) == ([Path("AGAIN/doe")], ["my shots/shot 7.csv"], ["the rig.toml"])
    for name in ("method", "trainer", "seed", "allow_rank_deficient"):
        assert named[name] == stored[name]


def test_the_command_of_a_campaign_asks_for_the_same_design(loop: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    campaign, _ = commands(read_results(loop))
    (case, design, runs, seed, out), _ = asked(monkeypatch, campaign.line, "birdstrike.cli.run_doe._plan")
    assert case.bird == read_results(loop).case.bird
    assert (design, runs, seed, out) == ("uniform", 25, 0, Path("AGAIN/doe"))


def test_campaigns_of_several_cases_stay_those_that_were_given(loop: Path) -> None:
    path = loop / "inversion" / "options.json"
    stored = json.loads(path.read_text()) | {"campaigns": ["a", "b"], "measured": ["1.csv", "2.csv"]}
    path.write_text(json.dumps(stored | {"cases": ["a/case.toml", "b/case.toml"]}))
    line = commands(read_results(loop))[1].line
    assert "train-and-invert a b --measured 1.csv --measured 2.csv --case a/case.toml --case b/case.toml" in line
    path.write_text(json.dumps(stored | {"cases": ["a/case.toml", None]}))
    assert "no command repeats the inversion: a case" in commands(read_results(loop))[1].line


def test_what_cannot_be_repeated_is_said(loop: Path) -> None:
    path = loop / "inversion" / "options.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | {"measured": [None]}))
    assert "no command repeats the inversion: a record was handed over" in commands(read_results(loop))[1].line
    path.unlink()
    assert "what it does not tell is at its default" in commands(read_results(loop))[1].line


def test_an_answer_that_a_function_in_python_verified_has_no_command(loop: Path) -> None:
    """A plain command would verify with birdstrike's solver, and get another answer."""
    path = loop / "inversion" / "options.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | {"forward": "my_lab.model"}))
    line = commands(read_results(loop))[1].line
    assert line == "no command repeats the inversion: verified by a function in Python (my_lab.model)"
    sources = find_sources(loop)
    told = (
        "verified by a function in Python (my_lab.model): no command repeats it; keep that function with this archive"
    )
    assert told in sources.open_points
    assert (repeat_words(sources), repeat_line(sources)) == ([], f"# {told}")


def test_a_diagnosis_of_one_channel_that_was_given_as_text_is_asked_for_again(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """It was stored letter by letter."""
    given: list[Any] = []

    def read(*positional: Any) -> None:
        given.append(positional[-1])
        raise UserError("taken")

    monkeypatch.setattr(diagnose, "read_records", read)
    with pytest.raises(UserError, match="taken"):
        diagnose.diagnose("demo", "table7_group5", tmp_path / "out", channels="displacement_centre")
    told = diagnose.asked(DiagnosisOptions(), [], None, given[0])
    assert told["channels"] == ["displacement_centre"]


def test_the_page_gives_the_commands(finished: Path, page: Path) -> None:
    rows = Page(page.read_text(encoding="utf-8")).tables.values()
    told = dict(row for table in rows for row in table if len(row) == 2)
    for command in commands(read_results(finished)):
        assert told[f"command of the {command.made}"] == command.line


def test_the_command_of_an_extended_campaign_says_each_call(loop: Path) -> None:
    """Of another design than sobol's the first 25 runs of 40 are not the 25."""
    path = loop / "doe" / "summary.json"
    summary = json.loads(path.read_text())
    summary["design"]["calls"] = [25, summary["design"]["runs"]]
    path.write_text(json.dumps(summary))
    line = commands(read_results(loop))[0].line
    assert "--runs 25 " in line
    assert line.endswith(f"; then the same with --runs {summary['design']['runs']}")
