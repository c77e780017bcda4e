"""`birdstrike simulate`: the files of one strike, the same bytes twice, and its ways to fail."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import birdstrike
from birdstrike.cli.app import app
from birdstrike.cli.simulate import _peak
from birdstrike.data.curves import read_histories
from birdstrike.data.errors import RunFailed
from birdstrike.data.histories import Histories, largest

SMALL = [
    *("--set", "bird.particles=300", "--set", "plate.elements=[12, 10]", "--set", "time.end=0.4 ms"),
    *("--set", 'time.snapshots=["0.2 ms", "0.4 ms"]'),
]


def strike(out: Path, *options: str):
    return CliRunner().invoke(app, ["simulate", "reference_strike_156mm", "--out", str(out), *SMALL, *options])


@pytest.fixture(scope="module")
def twice(tmp_path_factory) -> tuple[Path, Path, str]:
    """The same strike with one thread and with the default number, and what the first printed."""
    folder = tmp_path_factory.mktemp("strikes")
    one = strike(folder / "one", "--threads", "1", "--fields", "--json")
    assert one.exit_code == 0, one.output
    assert strike(folder / "two").exit_code == 0
    return folder / "one", folder / "two", one.stdout


def test_the_python_verb_takes_a_cases_name_and_a_loaded_case(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[str] = []
    monkeypatch.setattr("birdstrike.solver.simulate.simulate", lambda case, **_: seen.append(case.name))
    birdstrike.simulate("demo")
    birdstrike.simulate(birdstrike.load_case("reference_strike"))
    assert seen == ["demo", "reference_strike"]


def test_two_runs_give_identical_bytes_whatever_the_threads(twice) -> None:
    one, two, _ = twice
    assert (one / "histories.csv").read_bytes() == (two / "histories.csv").read_bytes()


def test_histories_have_the_default_sensors_on_the_cases_clock(twice) -> None:
    histories = read_histories(twice[0] / "histories.csv")
    assert histories.units == {"displacement_centre": "m", "contact_force": "N", "reaction_force": "N"}
    np.testing.assert_allclose(histories.time, 5e-6 * np.arange(81), rtol=1e-9, atol=1e-15)


def test_the_summary_has_the_keys_that_other_programs_read(twice) -> None:
    summary = json.loads((twice[0] / "summary.json").read_text())
    keys = {"wall_s", "steps", "particles", "shells", "momentum_error", "energy_error", "eroded_particles", "peak"}
    assert keys | {"schema_version", "solver_version", "case_hash"} <= set(summary)
    histories = read_histories(twice[0] / "histories.csv")
    for sensor, values in histories.channels.items():
        assert summary["peak"][sensor]["value"] == pytest.approx(largest(values), rel=1e-8)


def test_the_json_line_is_the_summary_and_where_it_lies(twice) -> None:
    one, _, stdout = twice
    line = json.loads(stdout.splitlines()[-1])
    assert line["out"] == str(one)
    assert line["particles"] == json.loads((one / "summary.json").read_text())["particles"]


def test_the_user_is_told_where_the_result_is_and_what_comes_next(twice) -> None:
    one, _, stdout = twice
    assert f"Written to {one}: histories.csv, summary.json, fields/." in stdout
    assert re.search(r"Next: birdstrike run-doe reference_strike_156mm .*--out", stdout, re.DOTALL)


def test_fields_are_one_bird_and_one_plate_a_snapshot(twice) -> None:
    import meshio

    one, two, _ = twice
    names = sorted(path.name for path in (one / "fields").iterdir())
    files = [f"{body}_{i:04d}.vtu" for body in ("bird", "plate") for i in (0, 1)]
    assert names == sorted([*files, "bird.pvd", "plate.pvd"])
    assert not (two / "fields").exists()
    bird, plate = (meshio.read(one / "fields" / f"{body}_0001.vtu") for body in ("bird", "plate"))
    assert bird.point_data["time_s"][0] == pytest.approx(0.4e-3, abs=5e-6)
    assert len(bird.cells_dict["vertex"]) == len(bird.points) == len(bird.point_data["pressure_Pa"])
    assert plate.cells_dict["quad"].shape == (120, 4)
    assert plate.cell_data["von_mises_Pa"][0].shape == (120,)


def test_a_series_gives_paraview_every_file_with_its_time(twice) -> None:
    import xml.etree.ElementTree as ET

    import meshio

    folder = twice[0] / "fields"
    for body in ("bird", "plate"):
        entries = ET.parse(folder / f"{body}.pvd").findall("Collection/DataSet")
        for entry in entries:
            mesh = meshio.read(folder / entry.attrib["file"])
            assert mesh.point_data["time_s"][0] == pytest.approx(float(entry.attrib["timestep"]), rel=1e-12)
        assert [float(e.attrib["timestep"]) for e in entries] == pytest.approx([0.2e-3, 0.4e-3], abs=5e-6)


def test_the_plates_displacement_is_that_of_its_sensor(twice) -> None:
    """The node at the centre moves away from the bird by what displacement_centre reads."""
    import meshio

    plate = meshio.read(twice[0] / "fields" / "plate_0001.vtu")
    histories = read_histories(twice[0] / "histories.csv")
    moved = plate.point_data["displacement_m"]
    centre = int(np.argmin(np.linalg.norm((plate.points - moved)[:, :2], axis=1)))
    read = histories.at("displacement_centre", np.array([plate.point_data["time_s"][0]]))[0]
    assert abs(moved[centre, 2]) == pytest.approx(read, rel=2e-2)


def test_fields_of_an_earlier_run_do_not_stay(tmp_path: Path) -> None:
    (tmp_path / "fields").mkdir()
    for name in ("bird_0007.vtu", "notes.txt"):
        (tmp_path / "fields" / name).write_text("")
    assert strike(tmp_path).exit_code == 0
    assert [path.name for path in (tmp_path / "fields").iterdir()] == ["notes.txt"]


def test_fields_without_snapshots_is_the_users_error(tmp_path: Path) -> None:
    result = strike(tmp_path / "out", "--fields", "--set", "time.snapshots=[]")
    assert result.exit_code == 1
    assert "time.snapshots" in result.stderr
    assert not (tmp_path / "out").exists()


def test_a_wrong_setting_is_the_users_error_and_writes_nothing(tmp_path: Path) -> None:
    result = strike(tmp_path / "out", "--set", "plate.thickness=2 m")
    assert result.exit_code == 1
    assert "plate.thickness = 2 m is outside 0.1 mm .. 50 mm; millimetres?" in result.stderr
    assert not (tmp_path / "out").exists()


def test_an_output_folder_that_is_a_file_is_the_users_error(tmp_path: Path) -> None:
    (tmp_path / "out").write_text("")
    result = strike(tmp_path / "out")
    assert result.exit_code == 1
    assert str(tmp_path / "out") in result.stderr


@pytest.mark.parametrize(
    ("error", "code"), [(RunFailed("the run went unstable", "lower it"), 2), (KeyboardInterrupt(), 130)]
)
def test_a_failed_or_interrupted_run_leaves_no_histories(tmp_path: Path, monkeypatch, error, code: int) -> None:

    def fail(*_args, **_options):
        raise error

    monkeypatch.setattr(birdstrike.solver.simulate, "simulate", fail)
    result = strike(tmp_path / "out")
    assert result.exit_code == code
    assert [path.name for path in (tmp_path / "out").iterdir()] in ([], [".birdstrike.json"])


def test_the_largest_reading_is_the_one_farthest_from_zero() -> None:
    """A sensor that moves the other way alone was said to peak at 0."""
    found = Histories(np.array([0.0, 1e-3, 2e-3]), {"u": np.array([0.0, -4e-3, 1e-3])}, {"u": "m"}, {})
    assert _peak(found, "u") == "-4 mm at 1.000 ms"
    gauge = Histories(found.time, {"strain_back": np.array([0.0, 0.01234, 0.0])}, {"strain_back": ""}, {})
    assert _peak(gauge, "strain_back") == "12340 µm/m at 1.000 ms", "1.234e+04"


def test_the_hint_at_the_end_is_of_the_cases_own_model(tmp_path) -> None:
    """A case that seeks nothing is not sent to run-doe; the example names a constant that its bird has."""
    asked = tmp_path / "elastic.toml"
    asked.write_text(
        '[plate]\nrigid = true\nlength = "0.3 m"\nwidth = "0.3 m"\nelements = [4, 4]\n'
        '[bird]\nshape = "sphere"\ndiameter = "80 mm"\ndensity = "938 kg/m^3"\nmethod = "hexahedra"\nparticles = 100\n'
        'material = {model = "elastic", young = "68.9 MPa", poisson = 0.49}\n'
        '[impact]\nspeed = "50 m/s"\nangle = "90 deg"\n[time]\nend = "0.02 ms"\noutput_interval = "1 us"\n'
    )
    result = CliRunner().invoke(app, ["simulate", str(asked), "--out", str(tmp_path / "out"), "--threads", "1"])
    assert result.exit_code == 0, result.output
    assert "run-doe" not in result.stdout
    assert 'e.g. [inversion.parameters."bird.material.young"] range = ["34.45 MPa", "137.8 MPa"]' in result.stdout
    assert re.search(r"\d+ elements, 16 shells", result.stdout)


def test_a_case_with_parameters_is_sent_on_to_run_doe(twice) -> None:
    assert re.search(r"Next: birdstrike run-doe reference_strike_156mm .*--out campaign", twice[2], re.DOTALL)
