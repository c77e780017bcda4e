"""The command that a report gives of a diagnosis asks for the same cases, records and options."""

from __future__ import annotations

import json
import shlex
from typing import Any

import pytest
from typer.testing import CliRunner

from birdstrike.cli.app import app
from birdstrike.data.errors import UserError
from birdstrike.reports.results.commands import diagnosis_command
from birdstrike.solver.case.case import case_hash
from tests.inversion.diagnosis.conftest import Laboratory
from tests.inversion.diagnosis.rig import tiny


def test_the_command_of_a_diagnosis_asks_for_the_same(laboratory: Laboratory, monkeypatch: pytest.MonkeyPatch) -> None:
    records = [str(laboratory.folder / f"{name}.csv") for name in ("loose", "clean")]
    words = ["--measured", records[0], "--baseline", records[1], "--channels", "displacement_centre"]
    words += ["--alpha", "0.01", "--refine", "0", "--baseline-bird", "recipe"]
    assert laboratory.diagnose("asked", *words).exit_code == 0
    line = diagnosis_command(laboratory.folder / "asked").line
    given: list[tuple[Any, ...]] = []

    def taken(*asked: Any) -> None:
        given.append(asked)
        raise UserError("taken")

    monkeypatch.setattr("birdstrike.inversion.diagnosis.diagnose.diagnose", taken)
    result = CliRunner().invoke(app, shlex.split(line)[1:])
    assert given, result.output
    cases, measured, _, _, heldout, options, _, baseline, clean, channels, bird = given[0]
    assert [case_hash(one) for one in (*cases, *clean)] == [case_hash(tiny())] * 2
    assert (measured, baseline, heldout) == ([records[0]], [records[1]], None)
    assert (options.alpha, options.refine, options.seed) == (0.01, 0, 0)
    assert (channels, bird) == (("displacement_centre",), "recipe")


def test_a_diagnosis_of_an_earlier_version_has_no_command(laboratory: Laboratory) -> None:
    path = laboratory.folder / "out" / "diagnosis.json"
    text = path.read_text()
    path.write_text(json.dumps({key: value for key, value in json.loads(text).items() if key != "options"}))
    try:
        assert diagnosis_command(path.parent).line.startswith("no command can be given: ")
    finally:
        path.write_text(text)


def test_the_birds_of_several_shots_are_stated_again(laboratory: Laboratory) -> None:
    """Without a baseline too: whether their birds are alike counts."""
    path = laboratory.folder / "out" / "diagnosis.json"
    text = path.read_text()
    told = json.loads(text)
    told["options"] |= {"baselines": {}, "baseline_bird": "same"}
    told["record"] |= {"shots": ["one", "two"], "files": ["one.csv", "two.csv"]}
    path.write_text(json.dumps(told))
    try:
        assert "--baseline-bird same" in diagnosis_command(path.parent).line
    finally:
        path.write_text(text)
