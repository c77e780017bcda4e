"""`birdstrike train-and-invert` as a user meets it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

import birdstrike.inversion.forward
from birdstrike.cli.app import app
from birdstrike.data.errors import RunFailed
from tests.inversion import small_campaign

runner = CliRunner()
LINEARISED = ("--method", "emulator", "--no-posterior")


@pytest.fixture(autouse=True)
def formula_for_solver(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(birdstrike.inversion.forward, "simulate", small_campaign.strike)


@pytest.fixture(scope="module")
def loop(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("cli")
    small_campaign.build(folder / "doe")
    small_campaign.write_record(folder / "record.csv")
    return folder


@pytest.fixture(scope="module")
def diagonal(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A campaign on Table 6's diagonal."""
    folder = tmp_path_factory.mktemp("diagonal")
    rows = [f"{k},{-5e4 * k},{60.0 * (k - 1)},{0.05 * k},{1.30 - 0.05 * k}" for k in range(1, 26)]
    names = ("pressure_cutoff [Pa]", "viscosity [Pa s]", "tension_erosion", "compression_erosion")
    header = ",".join(["run", *(f"bird.material.{name}" for name in names)])
    (folder / "design.csv").write_text("\n".join([header, *rows]) + "\n")
    small_campaign.build(folder / "doe", folder / "design.csv")
    return folder / "doe"


def invoke(*args: str | Path):
    return runner.invoke(app, ["train-and-invert", "--refine", "0", *map(str, args)], env={"COLUMNS": "200"})


def test_help_shows_an_example() -> None:
    assert "Example: birdstrike train-and-invert" in invoke("--help").output


def test_prints_parameters_errors_verdict_and_next_step(loop: Path) -> None:
    found = invoke(loop / "doe", "--measured", loop / "record.csv", "--out", loop / "inversion")
    assert found.exit_code == 0, found.output
    written = json.loads((loop / "inversion" / "inversion.json").read_text())
    for text in (
        "is simulated, not measured",
        "12-9-4 (lm)",
        "leave-one-out Q2",
        "time origin:",
        "identified",
        "reason",
    ):
        assert text in found.output
    for method in ("network", "emulator"):
        rms = 1e3 * written["methods"][method]["verified_rmse"]
        assert f"{method}: displacement_centre verified at {rms:.3g} mm RMS" in found.output
    assert f"better verified by the solver: the {written['best']}" in found.output
    last = found.output.strip().splitlines()[-1]
    assert str(loop / "inversion") in last
    assert f"Next: birdstrike report {loop}" in last
    assert "hold-out" not in found.output, "the standing rule is said once, in docs/theory.md"
    assert "every fifth" not in found.output


def test_parameter_that_is_not_identified_is_shown_as_its_range(loop: Path) -> None:
    out = loop / "by_emulator"
    found = invoke(loop / "doe", "--measured", loop / "record.csv", "--out", out, *LINEARISED)
    line = next(text for text in found.output.splitlines() if "tension_erosion" in text and "in 0.05 .. 1.25" in text)
    value = json.loads((out / "inversion.json").read_text())["methods"]["emulator"]["parameters"]
    assert f"{value['bird.material.tension_erosion']['value']:.4g}" not in line.split("in 0.05 .. 1.25")[1]
    assert " no " in line


def test_json_is_the_last_line(loop: Path) -> None:
    found = invoke(loop / "doe", "--measured", loop / "record.csv", "--out", loop / "j", *LINEARISED, "--json")
    line = json.loads(found.output.strip().splitlines()[-1])
    assert line["schema_version"] == 1
    assert line["best"] == "emulator"
    assert line["methods"]["emulator"]["verified_rmse"] > 0.0


def test_rank_deficient_design_exits_1_and_names_the_rank(diagonal: Path, loop: Path, tmp_path: Path) -> None:
    found = invoke(diagonal, "--measured", loop / "record.csv", "--out", tmp_path)
    assert found.exit_code == 1
    assert "the design carries 1 direction, not 4" in found.output
    assert "Traceback" not in found.output
    assert not (tmp_path / "inversion.json").exists()


def test_rank_deficient_design_gives_its_one_combination_when_asked(diagonal: Path, loop: Path, tmp_path: Path) -> None:
    found = invoke(diagonal, "--measured", loop / "record.csv", "--out", tmp_path, "--allow-rank-deficient")
    assert found.exit_code == 0, found.output
    assert "of the way through the runs, that is together" in found.output
    written = json.loads((tmp_path / "inversion.json").read_text())
    assert all(p["value"] is None for p in written["methods"]["emulator"]["parameters"].values())


@pytest.mark.parametrize(
    ("content", "text"),
    [
        ("time [ms],displacement_centre [mm]\n0.5,nan\n1.0,2.0\n", "line 2"),
        ("time [ms],strain [-]\n0.5,1\n1.0,2.0\n", "sensors: displacement_centre"),
        ("time [s],displacement_centre [mm]\n5,1\n6,2\n", "has 0 points in the simulated record 0 .. "),
    ],
    ids=["nan", "unknown channel", "another clock"],
)
def test_bad_measurement_exits_1_with_a_line_that_helps(loop: Path, tmp_path: Path, content: str, text: str) -> None:
    (tmp_path / "bad.csv").write_text(content)
    found = invoke(loop / "doe", "--measured", tmp_path / "bad.csv", "--out", tmp_path / "out")
    assert found.exit_code == 1
    assert text in found.output
    assert "Traceback" not in found.output


def test_gap_in_the_measurement_is_fine(loop: Path, tmp_path: Path) -> None:
    lines = (loop / "record.csv").read_text().splitlines()
    lines[5] = lines[5].split(",")[0] + ","
    (tmp_path / "gap.csv").write_text("\n".join(lines) + "\n")
    options = ("--method", "network", "--no-posterior")
    found = invoke(loop / "doe", "--measured", tmp_path / "gap.csv", "--out", tmp_path / "out", *options)
    assert found.exit_code == 0, found.output
    assert "11-9-4" in found.output


def test_curve_outside_the_prior_predictive_range_warns_and_goes_on(loop: Path, tmp_path: Path) -> None:
    rows = [f"{t},{9.0 + (i % 2)}" for i, t in enumerate((0.5, 0.8, 1.1, 1.4, 1.7, 2.0, 2.3))]
    (tmp_path / "foreign.csv").write_text("\n".join(["time [ms],displacement_centre [mm]", *rows]) + "\n")
    options = ("--measured", tmp_path / "foreign.csv", "--out", tmp_path / "out", "--no-posterior")
    found = invoke(loop / "doe", *options)
    assert found.exit_code == 0, found.output
    assert "warning: the model cannot produce this curve: nearest is run" in found.output
    assert " yes " not in found.output


def test_failed_verification_exits_2(loop: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def unstable(*_args: object, **_options: object) -> None:
        raise RunFailed("the energy balance is off by 9 %", "lower solver.courant")

    monkeypatch.setattr(birdstrike.inversion.forward, "simulate", unstable)
    found = invoke(loop / "doe", "--measured", loop / "record.csv", "--out", tmp_path, *LINEARISED)
    assert found.exit_code == 2
    assert "energy balance is off" in found.output


def laboratory_record(path: Path, noise: float, offset: float = 0.0, more: str = "") -> Path:
    """600 points from 0.5 ms before t = 0 on [ms, mm], at a viscosity of 600 Pa s."""
    time = np.arange(-0.5, 2.5, 0.005)
    values = 1e3 * np.interp(1e-3 * time, small_campaign.TIME, small_campaign.curve(600.0, -0.5e6)) + offset
    values = values + noise * np.random.default_rng(2).normal(size=len(time))
    head = "time [ms],displacement_centre [mm]" + (f",{more}" if more else "")
    rows = (
        f"{t:.3f},{v:.6f}" + (f",{100 * np.sin(9 * t):.3f}" if more else "") for t, v in zip(time, values, strict=True)
    )
    path.write_text("\n".join([head, *rows]) + "\n")
    return path


def viscosity_of(folder: Path) -> dict[str, Any]:
    methods = json.loads((folder / "inversion.json").read_text())["methods"]
    return methods["emulator"]["parameters"]["bird.material.viscosity"]


def test_a_record_noisier_than_the_case_states_is_inverted_and_both_figures_are_said(
    loop: Path, tmp_path: Path
) -> None:
    """0.03 mm by the case, 0.15 mm by the record: five times the noise is no other model."""
    record = laboratory_record(tmp_path / "noisy.csv", 0.15)
    found = invoke(loop / "doe", "--measured", record, "--out", tmp_path / "out", *LINEARISED)
    assert found.exit_code == 0, found.output
    assert "cannot produce" not in found.output
    said = " ".join(found.output.split())
    assert "the noise stated (0.03 mm, case) is not that of the record before contact (0.1" in said
    value = viscosity_of(tmp_path / "out")
    assert value["identified"]
    assert value["interval_95"][0] < 600.0 < value["interval_95"][1]


def test_an_offset_is_found_subtracted_and_written_with_its_interval(loop: Path, tmp_path: Path) -> None:
    record = laboratory_record(tmp_path / "offset.csv", 0.03, offset=1.2)
    found = invoke(loop / "doe", "--measured", record, "--out", tmp_path / "out", *LINEARISED)
    assert found.exit_code == 0, found.output
    value = viscosity_of(tmp_path / "out")
    assert value["identified"]
    assert value["interval_95"][0] < 600.0 < value["interval_95"][1]
    rest = json.loads((tmp_path / "out" / "inversion.json").read_text())["measured"]["at_rest"]["displacement_centre"]
    assert rest["interval_95"][0] < 1.2e-3 < rest["interval_95"][1]
    measured = pd.read_csv(tmp_path / "out" / "verification.csv")["measured_displacement_centre_m"].to_numpy()
    assert abs(float(np.mean(measured[:100]))) < 2e-5


def test_a_channel_can_be_left_out(loop: Path, tmp_path: Path) -> None:
    record = laboratory_record(tmp_path / "two.csv", 0.03, more="contact_force [kN]")
    options = (*LINEARISED, "--channels", "displacement_centre")
    found = invoke(loop / "doe", "--measured", record, "--out", tmp_path / "out", *options)
    assert found.exit_code == 0, found.output
    assert "contact_force" not in found.output
    assert viscosity_of(tmp_path / "out")["identified"]
    wrong = invoke(loop / "doe", "--measured", record, "--out", tmp_path / "w", "--channels", "laser")
    assert wrong.exit_code == 1
    assert 'has no channel "laser"; its channels: displacement_centre, contact_force' in wrong.output


def test_a_raw_export_in_place_of_a_record_names_the_import_that_makes_one(loop: Path, tmp_path: Path) -> None:
    (tmp_path / "daq.csv").write_text("Time;Disp Z\nms;mm\n0,0;0,1\n0,1;0,2\n")
    found = invoke(loop / "doe", "--measured", tmp_path / "daq.csv", "--out", tmp_path / "out")
    assert found.exit_code == 1
    assert "birdstrike import" in found.output
    assert "--sensor displacement_centre='Disp Z'" in found.output


def test_refine_takes_a_number_or_auto(loop: Path) -> None:
    found = invoke(*(loop / "doe", "--measured", loop / "record.csv", "--out", loop / "refused", "--refine", "often"))
    assert found.exit_code == 1
    assert '--refine = often; give the number of runs that may be added, 0 .. 1000, or "auto"' in found.output
