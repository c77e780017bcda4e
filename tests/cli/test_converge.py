"""`birdstrike converge`: three meshes of a tiny strike, its files, and its ways to end."""

from __future__ import annotations

import json
import re
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result

import birdstrike
from birdstrike.cli.app import app
from birdstrike.data.curves import read_histories
from birdstrike.data.errors import RunFailed
from tests.doe.external_case import DECK, written

TINY = [
    *("--set", "bird.particles=350", "--set", "plate.elements=[10, 8]", "--set", "time.end=0.3 ms"),
    *("--set", "time.snapshots=[]", "--set", "impact.standoff=1 mm", "--workers", "1"),
]


def invoke(out: Path, *options: str) -> Result:
    return CliRunner().invoke(app, ["converge", "reference_strike_156mm", "--out", str(out), *TINY, *options])


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Result]:
    """One study with real strikes in a process of their own."""
    out = tmp_path_factory.mktemp("meshes")
    result = invoke(out, "--json")
    assert result.exit_code == 0, result.output
    return out, result


def test_meshes_and_cost_are_said_first_and_the_place_last(study) -> None:
    out, result = study
    lines = result.stdout.splitlines()
    assert lines[1].endswith("(your mesh)")
    assert lines[3].startswith("Estimated time: ")
    assert lines[-3].startswith(f"Written to {out}: convergence.json, convergence.csv, convergence.png")


def test_the_json_holds_meshes_scalars_and_curves(study) -> None:
    out, result = study
    written = json.loads((out / "convergence.json").read_text())
    assert written["schema_version"] == 1
    assert [mesh["level"] for mesh in written["meshes"]] == [1, 0, -1]
    assert set(written["scalars"]) == {
        "displacement_centre_peak",
        "displacement_centre_peak_time",
        "contact_force_impulse",
        "reaction_force_peak",
    }
    for scalar in written["scalars"].values():
        assert (scalar["order"] is None) == (scalar["behaviour"] != "convergent")
        assert scalar["uncertainty_user"] >= 0.0
    assert json.loads(result.stdout.splitlines()[-1])["scalars"] == written["scalars"]


def test_the_curves_of_the_meshes_are_those_of_its_runs(study) -> None:
    out, _ = study
    table = read_histories(out / "convergence.csv")
    peak = json.loads((out / "convergence.json").read_text())["scalars"]["displacement_centre_peak"]
    for number, value in enumerate(peak["values"], start=1):
        assert table.channels[f"displacement_centre_mesh{number}"].max() == pytest.approx(value, rel=1e-3)
    assert np.all(table.channels["displacement_centre_uncertainty"] >= 0.0)
    assert (out / "convergence.png").read_bytes().startswith(b"\x89PNG")


def test_a_second_study_strikes_no_more_and_says_the_same(study, monkeypatch: pytest.MonkeyPatch) -> None:
    out, _ = study
    before = (out / "convergence.csv").read_bytes()
    monkeypatch.setattr(
        "birdstrike.inversion.mesh_convergence.convergence.process_pool", None
    )  # nothing is left to run
    assert invoke(out).exit_code == 0
    assert (out / "convergence.csv").read_bytes() == before


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--ratio", "1"], "--ratio = 1 is outside 1.1 .. 2"),
        (["--meshes", "2"], "--meshes = 2 is outside 3 .. 6"),
        (["--place", "top"], "--place = top is unknown"),
        (["--workers", "0"], "--workers = 0 is below 1"),
        (["--set", "plate.thickness=2 m"], "plate.thickness = 2 m is outside"),
        (["--ratio", "1.6"], "bird.particles = 58 is outside 100 .. 200000"),
        (["--ratio", "1.6"], "the case cannot be meshed 1 level away: "),
    ],
)
def test_the_users_mistakes_exit_1_and_write_nothing(tmp_path: Path, options: list[str], message: str) -> None:
    result = invoke(tmp_path / "out", *options)
    assert result.exit_code == 1, result.output
    assert message in result.stderr
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(("error", "code"), [(RunFailed("a mesh failed", "another"), 2), (KeyboardInterrupt(), 130)])
def test_a_failed_or_interrupted_study_writes_no_answer(tmp_path: Path, monkeypatch, error, code: int) -> None:
    def fail(*_args, **_options):
        raise error

    monkeypatch.setattr("birdstrike.inversion.mesh_convergence.convergence.run_meshes", fail)
    assert invoke(tmp_path).exit_code == code
    assert not list(tmp_path.glob("convergence.*"))


def test_the_python_verb_returns_the_study(study) -> None:
    from birdstrike.solver.case.case import load_case

    out, _ = study
    settings = [text for text in TINY[:-2] if text != "--set"]
    case = load_case("reference_strike_156mm", dict(setting.split("=") for setting in settings))
    found = birdstrike.converge(case, out, workers=1)
    written = json.loads((out / "convergence.json").read_text())["scalars"]
    assert found.scalars["contact_force_impulse"][1].values[0] == pytest.approx(
        written["contact_force_impulse"]["values"][0]
    )


def test_a_strain_is_shown_whole_and_in_microstrain(tmp_path: Path) -> None:
    gauge = ["--set", "sensors.strain_back.kind=strain", "--set", 'sensors.strain_back.at=["0 mm", "0 mm"]']
    command = ["converge", "reference_strike_156mm", "--out", str(tmp_path / "out"), *TINY, *gauge]
    result = CliRunner().invoke(app, [*command, "--set", "sensors.strain_back.side=back"], env={"COLUMNS": "80"})
    assert result.exit_code == 0, result.output
    assert "…" not in result.output
    assert "peak []" not in " ".join(result.output.split())
    (line,) = (line for line in result.output.splitlines() if line.startswith("strain_back: over the whole curve"))
    assert re.search(r"within \d[^ ]* µm/m, \d", line)


def test_a_deck_without_a_mesh_does_not_pass_for_converged(tmp_path: Path) -> None:
    command = ["converge", str(written(tmp_path / "none")), "--out", str(tmp_path / "out"), "--place", "coarsest"]
    result = CliRunner().invoke(app, command)
    assert result.exit_code == 1, result.output
    assert "has no place for bird.particles and plate.elements, so that all meshes would be one" in result.stderr
    assert not (tmp_path / "out").exists()


def test_a_deck_with_half_a_mesh_is_warned_about_and_has_no_estimated_time(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr("birdstrike.inversion.mesh_convergence.convergence.process_pool", ThreadPoolExecutor)
    case = written(tmp_path / "half", deck=f"{DECK}$ {{{{ bird.particles }}}}\n")
    command = ["converge", str(case), "--out", str(tmp_path / "out"), "--place", "coarsest", "--workers", "1"]
    result = CliRunner().invoke(app, command)
    assert result.exit_code == 0, result.output
    assert "How long another program takes is not known" in result.stdout
    written_json = json.loads((tmp_path / "out" / "convergence.json").read_text())
    assert "the deck has no place for plate.elements, which all meshes have alike" in written_json["warnings"][0]
    assert written_json["solver_version"] == "external: oscillator 1"
