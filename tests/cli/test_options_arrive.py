"""What a command's options are handed on as: each arrives in what computes, with the value that was typed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from birdstrike.cli.app import app
from birdstrike.data.errors import UserError

SHOT = ("--measured", "record.csv", "--out", "out")


def handed(monkeypatch: pytest.MonkeyPatch, function: str, *words: str) -> dict[str, Any]:
    """Keyword arguments with which a command calls the function that computes; nothing is computed."""
    arguments = dict[str, Any]()

    def computes(*_: object, **given: object) -> None:
        arguments.update(given)
        raise UserError("nothing is computed here")

    monkeypatch.setattr(f"birdstrike.{function}", computes)
    ended = CliRunner().invoke(app, words, env={"COLUMNS": "200"})
    assert "nothing is computed here" in ended.output, ended.output
    return arguments


@pytest.mark.parametrize(
    ("words", "name", "value"),
    [
        ("--refine 3", "refine", 3),
        ("--hidden 11", "hidden", 11),
        ("--hidden search", "hidden", None),
        ("--copies 4", "copies", 4),
        ("--outputs linear", "outputs", "linear"),
        ("--discrepancy 0.02", "discrepancy", 0.02),
        ("--mesh study/convergence.csv", "mesh", Path("study/convergence.csv")),
        ("--mesh-correction", "mesh_correction", True),
        ("--filter CFC600", "filter", "CFC600"),
        ("--filtered CFC180", "filtered", "CFC180"),
        ("--no-posterior", "posterior", False),
        ("--channels strain,force", "channels", ("strain", "force")),
        ("--retry-failed", "retry_failed", True),
    ],
)
def test_options_of_train_and_invert_arrive_in_its_extras(
    monkeypatch: pytest.MonkeyPatch, words: str, name: str, value: object
) -> None:
    function = "inversion.train_and_invert.train_and_invert"
    plain, given = (
        vars(handed(monkeypatch, function, "train-and-invert", "doe", *SHOT, *more)["extras"])
        for more in ([], words.split())
    )
    assert {key: new for key, new in given.items() if new != plain[key]} == {name: value}


@pytest.mark.parametrize(
    ("words", "name", "value"),
    [
        ("--trainer br", "trainer", "br"),
        ("--method network", "method", "network"),
        ("--case other", "case", ["other"]),
        ("--seed 5", "seed", 5),
        ("--allow-rank-deficient", "allow_rank_deficient", True),
    ],
)
def test_further_options_of_train_and_invert_arrive(
    monkeypatch: pytest.MonkeyPatch, words: str, name: str, value: object
) -> None:
    function = "inversion.train_and_invert.train_and_invert"
    assert handed(monkeypatch, function, "train-and-invert", "doe", *SHOT, *words.split())[name] == value


@pytest.mark.parametrize(
    ("words", "name", "value"),
    [
        ("--optimisers least_squares,cma", "optimisers", ("least_squares", "cma")),
        ("--budget 40", "budget", 40),
        ("--runs 12", "runs", 12),
        ("--seed 5", "seed", 5),
        ("--workers 2", "workers", 2),
        ("--no-posterior", "posterior", False),
        ("--channels strain", "channels", ("strain",)),
        ("--retry-failed", "retry_failed", True),
    ],
)
def test_options_of_calibrate_models_arrive(
    monkeypatch: pytest.MonkeyPatch, words: str, name: str, value: object
) -> None:
    function = "inversion.models.calibrate_models.calibrate_models"
    assert handed(monkeypatch, function, "calibrate-models", "demo", *SHOT, *words.split())[name] == value


@pytest.mark.parametrize(
    ("words", "name", "value"),
    [
        ("--verification checks.md", "verification", Path("checks.md")),
        ("--doe campaign", "doe", Path("campaign")),
        ("--measured a.csv --measured b.csv", "measured", ["a.csv", "b.csv"]),
        ("--runs", "runs", True),
    ],
)
def test_options_of_evidence_arrive(monkeypatch: pytest.MonkeyPatch, words: str, name: str, value: object) -> None:
    assert (
        handed(monkeypatch, "reports.evidence.archive.write_evidence", "evidence", "loop", *words.split())[name]
        == value
    )


@pytest.mark.parametrize("confirmed", [True, False])
def test_an_audit_runs_the_solver_at_the_fits_unless_told_not_to(
    monkeypatch: pytest.MonkeyPatch, confirmed: bool
) -> None:
    words = ["--out", "audit", "--make", "2", "--alpha", "0.01", "--seed", "7", *["--no-confirm"] * (not confirmed)]
    given = handed(monkeypatch, "inversion.audit.audit.audit", "audit", *words)
    options = given["options"]
    assert (options.check, options.alpha, options.seed) == (confirmed, 0.01, 7)
    assert ("--no-confirm" in given["command"]) is not confirmed
