"""Another code's curves beside ours, from the files of a deck and by the sensors' names."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import birdstrike.reports.page.other_code
import birdstrike.solver.simulate
from birdstrike import compare, export
from birdstrike.cli.app import app
from birdstrike.data.curves import read_histories, write_histories
from birdstrike.data.decks.sensors import read_deck_sensors
from birdstrike.data.errors import UserError
from birdstrike.data.histories import Histories
from birdstrike.solver.case.case import case_hash, load_case
from tests.data.exports.radioss_t01_writer import write_t01

TIME = 5e-6 * np.arange(401)
SHAPE = np.sin(np.pi * TIME / TIME[-1]) ** 2
SPEED = load_case("demo_rig").impact.speed
SETTINGS = {"bird.particles": "150", "plate.elements": "[6, 4]", "time.end": "2 ms"}


class Formula:
    """Stands in for the solver: 4 mm at the rig's speed times the shape, and a force of 50 kN times it."""

    runs = 0

    def simulate(self, case, **_: object) -> Histories:
        Formula.runs += 1
        size = {"m": 4e-3 * case.impact.speed / SPEED, "N": 5e4}
        units = {name: sensor.unit for name, sensor in case.sensors.items()}
        return Histories(TIME, {name: size[unit] * SHAPE for name, unit in units.items()}, units)


@pytest.fixture(autouse=True)
def formula(monkeypatch: pytest.MonkeyPatch) -> None:
    Formula.runs = 0
    monkeypatch.setattr(birdstrike.solver.simulate, "simulate", Formula().simulate)


def test_a_curve_that_ends_early_and_a_force_of_the_other_sign_are_told(tmp_path: Path) -> None:
    ours = Formula().simulate(load_case("demo_rig", SETTINGS))
    turned = {name: -values if ours.units[name] == "N" else values for name, values in ours.channels.items()}
    early = Histories(TIME[:100], {name: values[:100] for name, values in turned.items()}, ours.units)
    write_histories(tmp_path / "theirs.csv", early)
    found = compare("demo_rig", tmp_path / "theirs.csv", tmp_path / "out", settings=SETTINGS)
    assert any("covers 0 to 0.495 ms of the case's 2 ms" in line for line in found["warnings"])
    assert any("contact_force: the impulses have opposite signs" in line for line in found["warnings"])
    assert "opposite signs" in (tmp_path / "out" / "compare.html").read_text(encoding="utf-8")


def t01_of_a_deck(folder: Path) -> tuple[Path, Path]:
    """A deck of the demo rig, and a time history on its clock in which every node moves 10 % farther than ours."""
    export("demo_rig", folder / "rig_0000.rad", to="radioss", units="mm-ms-kg-GPa", deck=True, settings=SETTINGS)
    deck = read_deck_sensors(folder / "rig.radioss.sensors.json")
    nodes = sorted({n for one in deck.sensors.values() if one.kind == "displacement" for n in one.numbers})
    milliseconds = 1e3 * (TIME - deck.begin)
    zero = np.zeros_like(TIME)
    moved = np.column_stack([column for _ in nodes for column in (zero, zero, -4.4 * SHAPE)])
    impulse = np.concatenate([[0.0], np.cumsum(25.0 * (SHAPE[1:] + SHAPE[:-1]) * np.diff(milliseconds))])
    contact = np.column_stack([zero, zero, impulse, zero, zero, zero])
    groups = [
        (("contact of the bird", {1: ""}, (1, 2, 3, 4, 5, 6)), contact),
        (("displacement sensors", dict.fromkeys(nodes, "w"), (1, 2, 3)), moved),
    ]
    write_t01(folder / "rigT01", milliseconds, np.zeros((len(TIME), 12)), groups)
    return folder / "rigT01", folder / "rig.radioss.sensors.json"


def test_a_time_history_of_the_deck_is_compared_sensor_by_sensor(tmp_path: Path) -> None:
    history, sensors = t01_of_a_deck(tmp_path)
    settings = [word for key, value in SETTINGS.items() for word in ("--set", f"{key}={value}")]
    line = ["compare", "demo_rig", *settings, "--histories", str(history), "--deck", str(sensors)]
    out = tmp_path / "compared"
    found = CliRunner().invoke(app, [*line, "--theirs", "OpenRadioss", "--out", str(out), "--json"])
    assert found.exit_code == 0, found.output
    answer = json.loads(found.stdout.splitlines()[-1])
    rms = 0.1 / 1.1 * np.sqrt(np.mean(SHAPE**2))
    for name in ("displacement_centre", "displacement_x105", "displacement_y107"):
        one = answer["sensors"][name]
        assert one["peak_ours"] == pytest.approx(4.0e-3, rel=1e-6)
        assert one["peak_theirs"] == pytest.approx(4.4e-3, rel=1e-6)
        assert one["rms_of_peak"] == pytest.approx(rms, rel=1e-5)
        assert one["iso18571_grade"] in ("good", "excellent")
    force = answer["sensors"]["contact_force"]
    assert force["impulse_ours"] == pytest.approx(5e4 * 1e-3, rel=1e-4)
    assert force["impulse_theirs"] == pytest.approx(5e4 * 1e-3, rel=1e-3)
    page = (out / "compare.html").read_text()
    assert "birdstrike beside OpenRadioss" in page
    assert "displacement x105: RMS difference " in page
    assert " % of the peak. Below: birdstrike less OpenRadioss." in page
    assert "rigT01, SHA-256 " in page
    assert "http://www.w3.org" in page
    assert 'src="http' not in page
    np.testing.assert_allclose(
        read_histories(out / "theirs.csv").channels["displacement_x105"], 4.4e-3 * SHAPE, atol=1e-9
    )
    assert Formula.runs == 1
    assert CliRunner().invoke(app, [*line, "--out", str(out)]).exit_code == 0
    assert Formula.runs == 1, "our run of the same case is made once"


def test_curves_by_the_sensors_names_need_no_deck(tmp_path: Path) -> None:
    theirs = Histories(TIME, {"displacement_centre": 2e-3 * SHAPE}, {"displacement_centre": "m"})
    write_histories(tmp_path / "theirs.csv", theirs)
    answer = compare("demo_rig", tmp_path / "theirs.csv", tmp_path / "out", settings=SETTINGS)
    assert list(answer["sensors"]) == ["displacement_centre"]
    assert "contact_force has no curve of the other code" in answer["missing"]
    rows = "".join(f"{1e3 * t:.3f},{2.0 * s:.9f}\n" for t, s in zip(TIME, SHAPE, strict=True))
    (tmp_path / "record.csv").write_text("time [ms],displacement_centre [mm]\n" + rows)
    again = compare("demo_rig", tmp_path / "record.csv", tmp_path / "out", settings=SETTINGS)
    assert again["sensors"]["displacement_centre"]["rms"] == pytest.approx(
        answer["sensors"]["displacement_centre"]["rms"], rel=1e-4
    )


def test_an_interruption_leaves_no_other_cases_curve_behind(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """At 80 m/s, then 120 m/s killed while its page is written, then 80 m/s again."""
    theirs = Histories(TIME, {"displacement_centre": 2e-3 * SHAPE}, {"displacement_centre": "m"})
    write_histories(tmp_path / "theirs.csv", theirs)

    def peak(speed: int) -> float:
        settings = {**SETTINGS, "impact.speed": f"{speed} m/s"}
        found = compare("demo_rig", tmp_path / "theirs.csv", tmp_path / "out", settings=settings)
        return float(found["sensors"]["displacement_centre"]["peak_ours"])

    def killed(*_: object) -> None:
        raise KeyboardInterrupt

    before = peak(80)
    with monkeypatch.context() as patched:
        patched.setattr(birdstrike.reports.page.other_code, "write_comparison_page", killed)
        with pytest.raises(KeyboardInterrupt):
            peak(120)
    assert not (tmp_path / "out" / "compare.json").exists()
    assert peak(80) == before == pytest.approx(4e-3 * 80.0 / SPEED)
    assert Formula.runs == 2


def test_a_bird_that_cannot_be_built_is_an_error_of_the_input(tmp_path: Path) -> None:
    write_histories(
        tmp_path / "theirs.csv", Histories(TIME, {"displacement_centre": SHAPE}, {"displacement_centre": "m"})
    )
    law = '{kind="linear_polynomial", C0="-1 MPa", C1="2 MPa", C4=4.0}'
    with pytest.raises(UserError, match=r"bird\.material\.eos has no sound speed at rest"):
        compare("demo_rig", tmp_path / "theirs.csv", tmp_path / "out", settings={**SETTINGS, "bird.material.eos": law})
    assert not (tmp_path / "out" / "runs").exists()


def test_a_loaded_case_is_compared_as_its_name_and_settings_are(tmp_path: Path) -> None:
    theirs = Histories(TIME, {"displacement_centre": 2e-3 * SHAPE}, {"displacement_centre": "m"})
    write_histories(tmp_path / "theirs.csv", theirs)
    found = compare(load_case("demo_rig", SETTINGS), tmp_path / "theirs.csv", tmp_path / "out")
    assert found["case_hash"] == case_hash(load_case("demo_rig", SETTINGS))
    with pytest.raises(UserError, match="the case is loaded already; give them to load_case"):
        compare(load_case("demo_rig"), tmp_path / "theirs.csv", tmp_path / "out", settings=SETTINGS)


def test_what_cannot_be_compared_is_said_with_a_remedy(tmp_path: Path) -> None:
    other = Histories(TIME, {"w": SHAPE}, {"w": "m"})
    write_histories(tmp_path / "w.csv", other)
    with pytest.raises(UserError, match=r"no sensor is in both: .* name them as the case does \(birdstrike import"):
        compare("demo_rig", tmp_path / "w.csv", tmp_path / "a", settings=SETTINGS)
    wrong = Histories(TIME, {"displacement_centre": SHAPE}, {"displacement_centre": "N"})
    write_histories(tmp_path / "n.csv", wrong)
    with pytest.raises(UserError, match="the case records m, the other curve is in N; import it with its unit"):
        compare("demo_rig", tmp_path / "n.csv", tmp_path / "b", settings=SETTINGS)
    late = Histories(TIME + 1.0, {"displacement_centre": SHAPE}, {"displacement_centre": "m"})
    write_histories(tmp_path / "late.csv", late)
    with pytest.raises(UserError, match=r"no two points between 0 and 2 ms, .* is its clock in the right unit"):
        compare("demo_rig", tmp_path / "late.csv", tmp_path / "c", settings=SETTINGS)
    with pytest.raises(UserError, match="there is no such file"):
        compare("demo_rig", tmp_path / "none.csv", tmp_path / "d", settings=SETTINGS)
    with pytest.raises(UserError, match="birdstrike export CASE --deck writes it beside the deck"):
        compare("demo_rig", tmp_path / "w.csv", tmp_path / "e", deck=tmp_path / "no.sensors.json", settings=SETTINGS)
    (tmp_path / "rcforc").write_text("not a table\n")
    with pytest.raises(UserError, match=r"needs --deck SENSORS\.json"):
        compare("demo_rig", tmp_path / "rcforc", tmp_path / "f", settings=SETTINGS)


@pytest.mark.parametrize("rows", ["", "0,none\n"])
def test_histories_without_numbers_are_refused_by_name(rows: str, tmp_path: Path) -> None:
    (tmp_path / "histories.csv").write_text(f"time_s,displacement_centre_m\n{rows}")
    with pytest.raises(UserError, match=r"histories\.csv cannot be read: .*; write it again, a row an instant"):
        compare("demo_rig", tmp_path / "histories.csv", tmp_path / "out", settings=SETTINGS)


@pytest.mark.parametrize(("times", "line"), [((0.0, 1e-3, 1e-3), 4), ((0.0, 2e-3, 1e-3), 4), ((0.0, "nan", 1e-3), 3)])
def test_a_clock_that_does_not_rise_is_refused_with_its_line(times: tuple, line: int, tmp_path: Path) -> None:
    rows = "".join(f"{t},0.001\n" for t in times)
    (tmp_path / "histories.csv").write_text(f"time_s,displacement_centre_m\n{rows}")
    with pytest.raises(UserError, match=rf"histories\.csv, line {line}: time_s = .* does not rise above"):
        compare("demo_rig", tmp_path / "histories.csv", tmp_path / "out", settings=SETTINGS)


def test_a_deck_of_another_case_is_told(tmp_path: Path) -> None:
    history, sensors = t01_of_a_deck(tmp_path)
    given = {"deck": sensors, "settings": SETTINGS}
    assert not any("another case" in line for line in compare("demo_rig", history, tmp_path / "a", **given)["warnings"])
    given["settings"] = {**SETTINGS, "impact.speed": "80 m/s"}
    found = compare("demo_rig", history, tmp_path / "b", **given)
    assert "is of another case" in found["warnings"][0]
    assert "give the deck's --set again" in found["warnings"][0]
    content = json.loads(sensors.read_text())
    del content["case_hash"]
    sensors.write_text(json.dumps(content))
    older = compare("demo_rig", history, tmp_path / "c", **given)
    assert not any("another case" in line for line in older["warnings"])


def test_a_strain_gauge_is_not_said_to_be_in_none_of_the_files(tmp_path: Path) -> None:
    history, sensors = t01_of_a_deck(tmp_path)
    content = json.loads(sensors.read_text())
    gauge = {"kind": "strain", "unit": "", "numbers": [1], "weights": [1.0], "direction": [1.0, 0.0, 0.0]}
    content["sensors"]["gauge"] = gauge
    sensors.write_text(json.dumps(content))
    (line,) = [
        one
        for one in compare("demo_rig", history, tmp_path / "a", deck=sensors, settings=SETTINGS)["missing"]
        if one.startswith("gauge")
    ]
    assert line.startswith("gauge: strain gauges are not read from a code's files")


def test_a_sensor_whose_name_is_part_of_another_s_is_named_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from birdstrike.cli import compare as module

    theirs = Histories(TIME, {"displacement_centre": 2e-3 * SHAPE}, {"displacement_centre": "m"})
    monkeypatch.setattr(module, "_theirs", lambda *_: (theirs, ["contact_force_2 (contact force) is in none"]))
    (tmp_path / "any").write_text("not read")
    found = compare("demo_rig", tmp_path / "any", tmp_path / "out", settings=SETTINGS)
    assert "contact_force has no curve of the other code" in found["missing"]
