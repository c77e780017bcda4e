"""`birdstrike import` and `birdstrike new` as a user meets them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from birdstrike import new
from birdstrike.cli.app import app
from birdstrike.data.curves import read_measured
from birdstrike.data.errors import UserError
from birdstrike.inversion.diagnosis.diagnose import read_records
from birdstrike.solver.case.case import load_case


def invoke(*arguments: str | Path) -> Result:
    return CliRunner().invoke(app, list(map(str, arguments)), env={"COLUMNS": "200"})


def test_an_imported_curve_fits_the_new_case(tmp_path: Path) -> None:
    """The two files with which a newcomer starts are all that close-the-loop asks for."""
    (tmp_path / "scope.txt").write_text("0.0 0.0\n0.5 1.1\n1.0 4.0\n1.5 5.6\n")
    record, case = tmp_path / "shot.csv", tmp_path / "shot.toml"
    options = ("--sensor", "displacement_centre", "--unit", "mm", "--time-unit", "ms", "--out", record)
    found = invoke("import", tmp_path / "scope.txt", *options, "--json")
    assert found.exit_code == 0, found.output
    assert "displacement_centre: 4 points, 0 .. 1.5 ms, largest 5.6 mm at 1.5 ms" in found.stdout
    assert f"Written to {record}. Next: birdstrike close-the-loop CASE --measured {record}" in found.stdout
    assert json.loads(found.stdout.splitlines()[-1])["points"] == 4
    assert invoke("new", case).exit_code == 0
    read_records(case, record)


def test_the_new_case_is_valid_and_says_what_every_key_is(tmp_path: Path) -> None:
    found = invoke("new", tmp_path / "my_shot")
    path = tmp_path / "my_shot.toml"
    assert found.exit_code == 0, found.output
    assert f"Written to {path}" in found.stdout
    assert f"Next: birdstrike check {path}" in found.stdout
    assert invoke("check", path).exit_code == 0
    assert load_case(path).name == "my_shot"
    assert path.read_text().startswith("# my_shot: one shot")


def test_the_new_case_states_no_noise_that_is_not_the_users_own(tmp_path: Path) -> None:
    """A default that looks like a statement would overrule the record's own noise."""
    case = load_case(new(tmp_path / "mine"))
    assert not any(sensor.noise for sensor in case.sensors.values())


@pytest.mark.parametrize(("text", "value"), [("0.002 %", 2e-5), ("20 um/m", 2e-5), ("20 microstrain", 2e-5)])
def test_noise_of_a_strain_gauge_in_its_own_units(text: str, value: float) -> None:
    case = load_case("synthetic_strike", {"sensors.strain_back.noise": text})
    assert case.sensors["strain_back"].noise == pytest.approx(value, rel=1e-12)


def test_every_key_that_the_new_case_only_mentions_is_valid_too(tmp_path: Path) -> None:
    """Lines that are commented out are TOML: taken in, the case still loads."""
    path = new(tmp_path / "all")
    text = path.read_text()
    mentioned = [line for line in text.splitlines() if line.startswith("# ") and (" = " in line or line[2] == "[")]
    for line in mentioned:
        text = text.replace(line, line[2:])
    path.write_text(text)
    case = load_case(path)
    assert len(mentioned) >= 10
    assert (case.plate.damping, case.plate.material.rate_c, case.sensors["strain_1"].noise) == (30.0, 6500.0, 2e-5)
    assert case.instrument["displacement_centre"].bandwidth == 20e3


def test_new_leaves_an_old_file_alone(tmp_path: Path) -> None:
    path = tmp_path / "shot.toml"
    path.write_text("mine")
    found = invoke("new", path)
    assert found.exit_code == 1
    assert f"{path} exists and is left as it is" in found.output
    assert path.read_text() == "mine"
    with pytest.raises(UserError, match="is no name for a case"):
        new("")


def test_scale_and_unit_may_name_their_sensor(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("t_ms,w,f\n0,0,0\n1,-2,3\n")
    out = tmp_path / "o.csv"
    sensors = ("--sensor", "w", "--sensor", "force=f", "--unit", "w=mm", "--unit", "force=kN", "--scale", "w=-1")
    found = invoke("import", tmp_path / "a.csv", *sensors, "--out", out, "--simulated")
    assert found.exit_code == 0, found.output
    record = read_measured(out)
    assert record.simulated
    assert (record.channels["w"].tolist(), record.channels["force"].tolist()) == ([0.0, 2e-3], [0.0, 3e3])


def test_a_scale_may_be_per_a_quotient(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("t_ms,load [mV/V]\n0,0\n1,2\n")
    out = tmp_path / "o.csv"
    options = ("--sensor", "f=load", "--scale", "50 kN/(mV/V)", "--out", out)
    assert invoke("import", tmp_path / "a.csv", *options).exit_code == 0
    assert read_measured(out).channels["f"].tolist() == [0.0, 1e5]


def test_a_unit_beside_the_factor_that_takes_it_is_the_column_s(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("t_ms,w\n0,0\n1,-2\n")
    out = tmp_path / "o.csv"
    options = ("--sensor", "w", "--unit", "V", "--scale", "2 mm/V", "--out", out)
    assert invoke("import", tmp_path / "a.csv", *options).exit_code == 0
    assert read_measured(out).channels["w"].tolist() == [0.0, -4e-3]


@pytest.mark.parametrize(
    ("options", "why"),
    [
        (("--unit", "x=mm"), "--unit x=mm: x is no --sensor; named: w"),
        (("--scale", "2,5 mm/V"), '--scale 2,5 mm/V has a decimal comma; write "2.5 mm/V"'),
        (("--scale", "minus"), "--scale minus is not a number; write -1 to turn a curve round"),
        (("--unit", "bananas"), '--unit w=bananas: "bananas" is not a unit; accepted: m, cm, mm'),
        (("--unit", "milimeter"), '"milimeter" is not a unit; "mm"?'),
        (("--unit", "mm", "--time-unit", "mm"), "--time-unit mm is no unit of time; accepted: s, ms, us"),
        (("--unit", "mm", "--scale", "2 mm/V"), "--unit w=mm: its --scale takes a column in V and gives mm"),
    ],
)
def test_unreadable_options_are_the_users_errors(tmp_path: Path, options: tuple[str, ...], why: str) -> None:
    (tmp_path / "a.csv").write_text("t_ms,w\n0,0\n1,-2\n")
    out = tmp_path / "o.csv"
    found = invoke("import", tmp_path / "a.csv", "--sensor", "w", *options, "--out", out)
    assert found.exit_code == 1
    assert why in " ".join(found.output.split())
    assert not out.exists()
