"""`birdstrike import` on files as laboratories have them."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest
from typer.testing import CliRunner, Result

from birdstrike.cli.app import app
from birdstrike.cli.import_curve import import_curve
from birdstrike.data.curves import read_measured
from birdstrike.data.errors import MeasuredError, UserError
from birdstrike.inversion.diagnosis.diagnose import read_records
from birdstrike.inversion.observations.before_contact import FEWEST_FOR_LEVEL
from tests.inversion.stand_in import pulse, truth

CENTRE = "displacement_centre"
TIME = np.arange(-0.5, 2.5, 0.005)  # ms


def invoke(*arguments: str | Path) -> Result:
    return CliRunner().invoke(app, ["import", *map(str, arguments)], env={"COLUMNS": "200"})


def export(path: Path, noise: float = 0.03, offset: float = 0.0, head: str = "Disp Z (mm)", **changed: float) -> Path:
    """A logger's file: the pulse in mm, 0.5 ms of rest, noise and offset [mm]; changed: "row_7" = a reading."""
    values = 1e3 * pulse(truth(0.5), 1e-3 * TIME) + offset
    values = values + noise * np.random.default_rng(0).normal(size=len(TIME))
    for row, value in changed.items():
        values[int(row.removeprefix("row_"))] = value
    rows = "".join(f"{t:.3f};{v:.6f}\n" for t, v in zip(TIME, values, strict=True))
    path.write_text(f"Logger 3\nTime (ms);{head}\n{rows}")
    return path


def test_the_tutorials_column_is_found_as_it_stands_in_the_file(tmp_path: Path) -> None:
    found = invoke(export(tmp_path / "a.csv"), "--sensor", f"{CENTRE}=Disp Z (mm)", "--out", tmp_path / "o.csv")
    assert found.exit_code == 0, found.output
    assert f"{CENTRE}: noise 0.03" in found.stdout or f"{CENTRE}: noise 0.02" in found.stdout


@pytest.mark.parametrize(("first", "shift"), [(1.7e9, "-1700000000 s"), (35.25, "-35.25 s"), (-35.5, "35.5 s")])
def test_a_clock_far_from_its_trigger_is_told_with_its_shift(tmp_path: Path, first: float, shift: str) -> None:
    """Seconds since 1970 were imported without a word."""
    rows = "".join(f"{first + 1e-5 * k:.5f},{k % 7}\n" for k in range(99))
    (tmp_path / "a.csv").write_text(f"t [s],w [mm]\n{rows}")
    options = (tmp_path / "a.csv", "--sensor", CENTRE, "--out", tmp_path / "o.csv")
    assert f"look at the clock: it begins at {first:.10g} s, 0.98 ms before the record ends" in invoke(*options).stdout
    assert f'--shift "{shift}"' in invoke(*options).stdout
    moved = invoke(*options, "--shift", shift)
    assert "look at the clock" not in moved.stdout
    assert read_measured(tmp_path / "o.csv").time[0] == pytest.approx(0.0, abs=1e-6)


def test_the_line_that_makes_a_record_of_an_export_stands_before_what_is_wrong_with_it(tmp_path: Path) -> None:
    """It stood behind ten lines."""
    with pytest.raises(MeasuredError) as raised:
        read_measured(export(tmp_path / "a.csv"))
    first, *others = raised.value.errors
    assert first.startswith(f"{tmp_path / 'a.csv'} is no measured-data CSV; if it is an export, this makes a record")
    assert "birdstrike import" in first
    assert others


def test_volts_come_in_with_what_they_stand_for(tmp_path: Path) -> None:
    source = export(tmp_path / "a.csv", head="CH1 [V]")
    for sensor in ("CH1", "CH1 [V]"):
        options = ("--sensor", f"{CENTRE}={sensor}", "--scale", "2 mm/V", "--out", tmp_path / "o.csv")
        found = invoke(source, *options)
        assert found.exit_code == 0, found.output
        assert read_measured(tmp_path / "o.csv").channels[CENTRE].max() == pytest.approx(2 * 4.7e-3, rel=0.05)
    found = invoke(source, "--sensor", f"{CENTRE}=CH1", "--out", tmp_path / "p.csv")
    assert found.exit_code == 1
    assert '"CH1" is in V' in found.output
    assert '--scale displacement_centre="2.5 mm/V"' in found.output


def test_a_script_states_a_factor_as_the_command_does(tmp_path: Path) -> None:
    source, sensors = export(tmp_path / "a.csv", head="CH1 [V]"), {CENTRE: "CH1"}
    records = [import_curve(source, tmp_path / "o.csv", sensors, scales={CENTRE: "2 mm/V"})]
    records.append(
        import_curve(source, tmp_path / "o.csv", sensors, scales={CENTRE: 2.0}, units={CENTRE: "mm"}, per={CENTRE: "V"})
    )
    assert records[0].channels[CENTRE] == pytest.approx(records[1].channels[CENTRE])
    with pytest.raises(UserError, match="--scale twice is not a number"):
        import_curve(source, tmp_path / "o.csv", sensors, scales={CENTRE: "twice"})
    with pytest.raises(UserError, match="--unit displacement_centre=mm: its --scale takes a column in V"):
        import_curve(source, tmp_path / "o.csv", sensors, scales={CENTRE: "2 mm/V"}, units={CENTRE: "mm"})


@pytest.mark.parametrize("scale", ["0", "0.0", "nan", "0 mm/V", "one"])
def test_a_scale_that_is_no_factor_is_refused(tmp_path: Path, scale: str) -> None:
    found = invoke(export(tmp_path / "a.csv"), "--sensor", CENTRE, "--scale", scale, "--out", tmp_path / "o.csv")
    assert found.exit_code == 1
    assert f"--scale {scale}" in found.output
    assert not (tmp_path / "o.csv").exists()


def test_zero_takes_the_mean_before_the_response_out_and_says_so(tmp_path: Path) -> None:
    source = export(tmp_path / "a.csv", offset=1.2)
    plain = invoke(source, "--sensor", CENTRE, "--out", tmp_path / "raw.csv")
    assert "reads 1.2 mm before contact, beyond its noise: a calibration takes the sensor's zero from" in plain.stdout
    found = invoke(source, "--sensor", CENTRE, "--zero", "--out", tmp_path / "o.csv")
    assert found.exit_code == 0, found.output
    record = read_measured(tmp_path / "o.csv")
    assert abs(record.channels[CENTRE][TIME < 0.2].mean()) < 1e-5
    assert any("the mean before" in line and "was subtracted" in line for line in record.provenance)
    assert "was subtracted" in found.stdout


def test_zero_of_a_record_without_rest_is_refused(tmp_path: Path) -> None:
    rows = "".join(f"{t},{v}\n" for t, v in zip(np.arange(30), np.linspace(1, 5, 30) ** 2, strict=True))
    (tmp_path / "a.csv").write_text(f"t_ms,w_mm\n{rows}")
    found = invoke(tmp_path / "a.csv", "--sensor", CENTRE, "--zero", "--out", tmp_path / "o.csv")
    assert found.exit_code == 1
    assert "points at rest before its response and needs 8" in found.output


def test_a_force_without_rest_gives_no_noise_of_its_own(tmp_path: Path) -> None:
    """Its ringing between two samples was written into the record as noise."""
    time = 1e-5 * np.arange(300)
    force = 20.0 * np.sin(np.pi * time / 3e-3) + 3.0 * np.sin(2.0 * np.pi * 38e3 * time)
    rows = "".join(f"{t:.5f},{f:.4f}\n" for t, f in zip(time, force, strict=True))
    (tmp_path / "a.csv").write_text(f"t [s],F [kN]\n{rows}")
    options = ("--sensor", "reaction_force", "--out", tmp_path / "o.csv")
    found = invoke(tmp_path / "a.csv", *options, "--sigma", "record")
    assert found.exit_code == 1
    assert 'where only a displacement can show it; state it: --sigma reaction_force="0.1 kN"' in found.output
    assert f"fewer than {FEWEST_FOR_LEVEL} points before its response" in found.output
    assert "noise" not in invoke(tmp_path / "a.csv", *options).output
    none = invoke(tmp_path / "a.csv", *options, "--sigma", "0 kN")
    assert 'above 0, such as --sigma reaction_force="0.1 kN"' in none.output


@pytest.mark.parametrize(("given", "sigma"), [("0.05 mm", 5e-5), (f"{CENTRE}=50 um", 5e-5), ("record", 3e-5)])
def test_sigma_states_the_noise_in_the_record(tmp_path: Path, given: str, sigma: float) -> None:
    found = invoke(export(tmp_path / "a.csv"), "--sensor", CENTRE, "--sigma", given, "--out", tmp_path / "o.csv")
    assert found.exit_code == 0, found.output
    assert read_measured(tmp_path / "o.csv").sigma[CENTRE] == pytest.approx(np.full(len(TIME), sigma), rel=0.2)


def test_a_spike_and_a_logger_that_stopped_are_said_at_once(tmp_path: Path) -> None:
    changed = {"row_200": 9.0, **{f"row_{i}": 2.5 for i in range(400, 430)}}
    source = export(tmp_path / "a.csv", 0.03, 0.0, "Disp Z (mm)", **changed)
    found = invoke(source, "--sensor", CENTRE, "--out", tmp_path / "o.csv")
    assert found.exit_code == 0, found.output
    assert "1 point at 0.5 ms is far off its neighbours" in found.stdout
    assert "30 points at 1.5 .. 1.645 ms are frozen (one reading repeated)" in found.stdout


def test_gaps_of_a_logger_are_counted(tmp_path: Path) -> None:
    source = export(tmp_path / "a.csv")
    lines = source.read_text().splitlines()
    lines[202] = f"{lines[202].split(';')[0]};OVL"
    source.write_text("\n".join(lines))
    found = invoke(source, "--sensor", CENTRE, "--out", tmp_path / "o.csv")
    assert found.exit_code == 0, found.output
    assert '1 cell "OVL", the first in line 203, read as gaps' in found.stdout


def test_the_picture_shows_what_is_used_and_what_is_cut(tmp_path: Path) -> None:
    """Colours of the used curve, of the reading at rest and of the spike are in it."""
    source = export(tmp_path / "a.csv", offset=1.2, row_200=9.0)
    found = invoke(source, "--sensor", CENTRE, "--out", tmp_path / "o.csv", "--picture", tmp_path / "o.png")
    assert found.exit_code == 0, found.output
    pixels = (255 * matplotlib.image.imread(tmp_path / "o.png")[..., :3]).round().astype(int).reshape(-1, 3)
    for colour in ((0, 0, 0), (0, 0x72, 0xB2), (0, 0x9E, 0x73)):
        assert (np.abs(pixels - colour).max(axis=1) < 25).any()


def test_a_raw_export_in_a_records_place_names_the_import_line(tmp_path: Path) -> None:
    source = export(tmp_path / "daq file.csv")
    with pytest.raises(MeasuredError) as caught:
        read_measured(source)
    line = caught.value.errors[0]
    assert "birdstrike import" in line
    assert f"--sensor {CENTRE}='Disp Z (mm)' --out" in line
    assert str(source) in line
    assert "'" in line.split("--sensor")[0], "a name with a blank is quoted for the shell"


def test_the_import_line_names_every_sensor_apart_and_no_empty_column(tmp_path: Path) -> None:
    source = tmp_path / "a.csv"
    source.write_text("Zeit [ms];Weg [mm];Kraft [kN];\n0,0;0,1;2,0;\n0,5;0,2;3,0;\n1,0;0,3;4,0;\n")
    with pytest.raises(MeasuredError) as caught:
        read_measured(source)
    assert f"--sensor {CENTRE}='Weg [mm]' --sensor SENSOR_2='Kraft [kN]' --out" in caught.value.errors[0]


def test_the_import_line_names_no_counter_no_clock_and_no_column_of_text_as_a_sensor(tmp_path: Path) -> None:
    """It read the clock as a sensor and the row's number as the clock: --sensor displacement_centre=Date."""
    source = tmp_path / "a.csv"
    rows = "".join(f"{i},2026-11-24,10:15:30.{i:06d},{0.1 * i:.1f}\n" for i in range(9))
    source.write_text(f"Index,Date,Time,Laser (mm)\n{rows}")
    with pytest.raises(MeasuredError) as caught:
        read_measured(source)
    line = caught.value.errors[0].partition("makes a record of it: ")[2]
    assert line == f"birdstrike import {source} --sensor {CENTRE}='Laser (mm)' --out a_si.csv"
    assert invoke(*shlex.split(line)[2:-1], tmp_path / "o.csv").exit_code == 0


def test_the_import_line_takes_no_volt_for_a_millimetre_and_states_each_unit_by_itself(tmp_path: Path) -> None:
    """It said --unit mm of all columns, by which volts were read as millimetres, and kN refused."""
    source = tmp_path / "a.csv"
    source.write_text("t [ms],w,CH2 [V],F [KN]\n0,0,0,0\n1,1,1,1\n")
    with pytest.raises(MeasuredError, match="this makes a record of it") as caught:
        read_measured(source)
    line = next(text for text in caught.value.errors if "birdstrike import" in text)
    assert '--unit displacement_centre=mm --scale SENSOR_2="FACTOR mm/V" --unit SENSOR_3=kN --out' in line
    assert "--unit mm" not in line


def test_the_import_line_keeps_the_names_of_sensors_and_leaves_their_noise_out(tmp_path: Path) -> None:
    source = tmp_path / "a.csv"
    source.write_text(f"time [ms];{CENTRE} [mm];{CENTRE}_sigma [mm];contact_force [kN]\n0;0,1;0,1;2\n1;0,3;0,1;4\n")
    with pytest.raises(MeasuredError) as caught:
        read_measured(source)
    assert f"--sensor {CENTRE} --sensor contact_force --out" in caught.value.errors[0]


@pytest.mark.parametrize(
    ("sensors", "said"),
    [(("c", "c=Kraft"), "--sensor c is given twice"), (("c=",), "lacks a name or a column"), (("=w",), "lacks a name")],
)
def test_a_sensor_twice_or_without_a_column_is_refused(tmp_path: Path, sensors: tuple[str, ...], said: str) -> None:
    options = [part for text in sensors for part in ("--sensor", text)]
    found = invoke(export(tmp_path / "a.csv"), *options, "--out", tmp_path / "o.csv")
    assert found.exit_code == 1
    assert said in found.output


@pytest.mark.parametrize("sigma", ["-0.02 mm", "0 mm"])
def test_a_noise_that_is_none_is_refused(tmp_path: Path, sigma: str) -> None:
    found = invoke(export(tmp_path / "a.csv"), "--sensor", CENTRE, "--out", tmp_path / "o.csv", "--sigma", sigma)
    assert found.exit_code == 1
    assert "a standard deviation is above 0" in found.output


def test_many_cells_that_are_no_numbers_are_told_by_the_first_and_their_number(tmp_path: Path) -> None:
    source = tmp_path / "a.csv"
    source.write_text("time [ms],w [mm]\n" + "".join(f"{i},{'NaN' if i % 2 else i}\n" for i in range(100)))
    with pytest.raises(MeasuredError) as caught:
        read_measured(source)
    assert len(caught.value.errors) == 7
    assert caught.value.errors[5].endswith("line 101: the last of 50 such lines")
    assert "birdstrike import" in caught.value.errors[6]


def test_a_unit_in_the_wrong_case_is_told_with_the_right_one(tmp_path: Path) -> None:
    source = tmp_path / "a.csv"
    source.write_text("time [MS],w [MM]\n0,1\n1,2\n2,3\n")
    with pytest.raises(MeasuredError) as caught:
        read_measured(source)
    assert [line.rpartition("; ")[2] for line in caught.value.errors] == ['"ms"?', '"mm"?']
    found = invoke(source, "--sensor", "w", "--out", tmp_path / "o.csv")
    assert 'is in MS; is "ms" meant? Correct the head, or write --time-unit ms' in found.output.replace("\n", " ")


def test_a_channel_that_is_left_out_need_not_be_a_sensor_of_the_case(tmp_path: Path) -> None:
    """What `close-the-loop --channels` checks before it pays for a simulation."""
    record = tmp_path / "two.csv"
    record.write_text(f"time [ms],{CENTRE} [mm],trigger [mm]\n0,0,1\n1,2,5\n2,1,5\n")
    with pytest.raises(MeasuredError, match=r'channel "trigger" in .* is no sensor of case'):
        read_records("reference_strike", record)
    assert list(read_records("reference_strike", record, channels=(CENTRE,)).shots[0].record.channels) == [CENTRE]
    with pytest.raises(MeasuredError, match=f'--channels: .* has no channel "laser"; its channels: {CENTRE}, trigger'):
        read_records("reference_strike", record, channels=("laser",))


ROWS = [f"{1e3 * v:.4f}" for v in pulse(truth(0.5), 1e-3 * TIME)]


def test_a_file_without_a_clock_comes_in_by_its_rate(tmp_path: Path) -> None:
    """Samples that are counted, every second of them missing from row 100 on, and readings alone."""
    counted, alone = tmp_path / "counted.csv", tmp_path / "alone.txt"
    kept = [i for i in range(len(ROWS)) if i < 100 or i % 2]
    head = "Abtastrate 200 kHz\nSample;w [mm]\n"
    counted.write_text(head + "".join(f"{i};{ROWS[i]}\n" for i in kept))
    alone.write_text("w [mm]\n" + "\n".join(ROWS) + "\n")
    out = tmp_path / "o.csv"
    refused = invoke(counted, "--sensor", CENTRE, "--out", out)
    assert refused.exit_code == 1
    assert '--rate "200 kHz" (its head says "Abtastrate 200 kHz")' in refused.output
    assert '--rate "200 kHz"' in invoke(alone, "--sensor", CENTRE, "--out", out).output
    for source, rate, expected in ((counted, "200 kHz", TIME[kept]), (alone, "5 us", TIME)):
        found = invoke(source, "--sensor", CENTRE, "--rate", rate, "--shift", "-0.5 ms", "--out", out)
        assert found.exit_code == 0, found.output
        assert "The clock was made of the samples' number" in found.output
        np.testing.assert_allclose(read_measured(out).time, 1e-3 * expected, atol=1e-12)


@pytest.mark.parametrize("rate", ["200", "3 mm", "0 Hz", "-1 kHz", "nan Hz"])
def test_a_rate_that_is_none_is_refused(tmp_path: Path, rate: str) -> None:
    found = invoke(export(tmp_path / "a.csv"), "--sensor", CENTRE, "--rate", rate, "--out", tmp_path / "o.csv")
    assert found.exit_code == 1
    assert f"--rate {rate}" in found.output


def test_a_clock_of_too_few_digits_is_made_anew_and_must_agree_with_the_rate(tmp_path: Path) -> None:
    source, out = tmp_path / "a.csv", tmp_path / "o.csv"
    source.write_text("t [ms],w [mm]\n" + "".join(f"{t:.2f},{v}\n" for t, v in zip(TIME, ROWS, strict=True)))
    refused = invoke(source, "--sensor", f"{CENTRE}=w", "--out", out)
    assert refused.exit_code == 1
    assert refused.output.count("\n") <= 2
    assert "the clock has too few digits" in refused.output
    found = invoke(source, "--sensor", CENTRE, "--rate", "200 kHz", "--out", out)
    assert found.exit_code == 0, found.output
    np.testing.assert_allclose(read_measured(out).time, 1e-3 * TIME, atol=1e-12)
    wrong = invoke(source, "--sensor", f"{CENTRE}=w", "--rate", "100 kHz", "--out", out)
    assert wrong.exit_code == 1
    assert "correct the rate" in wrong.output


def test_units_of_anything_text_and_a_summary_behind_the_table_are_read_past(tmp_path: Path) -> None:
    source, out = tmp_path / "a.csv", tmp_path / "o.csv"
    rows = "".join(
        f"{t:.3f};{v};9.99;{'OK' if i % 9 else ''}\n" for i, (t, v) in enumerate(zip(TIME, ROWS, strict=True))
    )
    head = "Device;7;8;9\nRange;10;20;30\nZeit;Weg;Reserve;Zustand\n[ms];[mm];[V];[]\n"
    source.write_text(f"{head}{rows}\nMaximum;4.4;9.99;\nEnd of data\n")
    found = invoke(source, "--sensor", f"{CENTRE}=Weg", "--out", out)
    assert found.exit_code == 0, found.output
    assert "columns of text were left out: Zustand" in found.output
    assert "2 lines behind the table" in found.output
    record = read_measured(out)
    assert len(record.time) == len(TIME)
    assert record.channels[CENTRE].max() == pytest.approx(4.4e-3, rel=0.02)


def test_a_second_record_behind_the_first_is_no_summary(tmp_path: Path) -> None:
    rows = "".join(f"{t:.3f},{v}\n" for t, v in zip(TIME, ROWS, strict=True))
    source = tmp_path / "a.csv"
    source.write_text(f"t [ms],w [mm]\n{rows}{rows}")
    found = invoke(source, "--sensor", f"{CENTRE}=w", "--out", tmp_path / "o.csv")
    assert found.exit_code == 1
    assert f"line {len(TIME) + 2}: the time -0.500 does not increase" in found.output


def test_a_clock_that_counts_from_1970_keeps_its_steps(tmp_path: Path) -> None:
    """Shifted before it is rounded: 1.7e9 s has no room for a microsecond beside it in a double's 16 digits."""
    source, out = tmp_path / "a.csv", tmp_path / "o.csv"
    source.write_text(
        "t [s],w [mm]\n" + "".join(f"17000000{30 + 1e-3 * t:.8f},{v}\n" for t, v in zip(TIME, ROWS, strict=True))
    )
    found = invoke(source, "--sensor", f"{CENTRE}=w", "--shift", "-1700000030 s", "--out", out)
    assert found.exit_code == 0, found.output
    np.testing.assert_allclose(read_measured(out).time, 1e-3 * TIME, atol=1e-11)


def test_a_channel_that_is_constant_is_said_at_import(tmp_path: Path) -> None:
    source = tmp_path / "a.csv"
    source.write_text("t [ms],w [mm]\n" + "".join(f"{t:.3f},9.998\n" for t in TIME))
    found = invoke(source, "--sensor", f"{CENTRE}=w", "--out", tmp_path / "o.csv")
    assert f'look at the record: {source}: "{CENTRE}" reads 9.998 mm everywhere' in found.output.replace("\n", " ")


@pytest.mark.parametrize("name", ["picture.csv", "picture", "a.xyz"])
def test_a_picture_of_an_unknown_format_is_refused_before_the_record_is_written(tmp_path: Path, name: str) -> None:
    source, out = export(tmp_path / "a.csv"), tmp_path / "o.csv"
    found = invoke(source, "--sensor", f"{CENTRE}=Disp Z", "--out", out, "--picture", tmp_path / name)
    assert found.exit_code == 1
    assert "a picture ends in .png, .svg, .pdf" in " ".join(found.output.split())
    assert not out.exists()


def test_files_of_one_shot_on_clocks_of_their_own_become_one_record(tmp_path: Path) -> None:
    laser, cell, shot = export(tmp_path / "laser.csv"), tmp_path / "cell.txt", tmp_path / "shot.csv"
    cell.write_text("Time [us]\tCell [lbf]\n-500\t0\n-2.5\t1000\n10\t2000\n")  # every second instant is the laser's
    first = invoke(laser, "--sensor", CENTRE, "--sigma", "0.03 mm", "--out", tmp_path / "first.csv")
    assert first.exit_code == 0, first.output
    options = ("--sensor", "reaction_force=Cell", "--out", shot)
    found = invoke(cell, *options, "--beside", tmp_path / "first.csv")
    assert found.exit_code == 0, found.output
    alone, both = read_measured(tmp_path / "first.csv"), read_measured(shot)
    for time, values in zip(both.points(CENTRE), alone.points(CENTRE), strict=True):
        assert np.array_equal(time, values)
    assert np.isfinite(both.sigma[CENTRE]).sum() == len(alone.time) == len(both.time) - 1
    time, force = both.points("reaction_force")
    assert time == pytest.approx([-5e-4, -2.5e-6, 1e-5])
    assert force == pytest.approx([0.0, 4448.2216152605, 8896.443230521])
    assert both.provenance[: len(alone.provenance)] == alone.provenance
    assert any("cell.txt" in line for line in both.provenance)
    again = invoke(cell, *options[:2], "--out", tmp_path / "again.csv", "--beside", shot)
    assert again.exit_code == 1
    assert 'both have "reaction_force"; leave it out of one of them' in again.output
    assert not (tmp_path / "again.csv").exists()


def test_microstrain_under_a_head_without_a_unit_is_told(tmp_path: Path) -> None:
    """A gauge's 2771 under "Strain [-]" was imported as a strain without a remark."""
    source = tmp_path / "strain.csv"
    values = 2771.0 * np.exp(-(((TIME - 1.5) / 0.3) ** 2)) + np.random.default_rng(0).normal(size=len(TIME))
    source.write_text(
        "Time [ms];Strain [-]\n" + "".join(f"{t:.3f};{v:.4f}\n" for t, v in zip(TIME, values, strict=True))
    )
    found = invoke(source, "--sensor", "strain_back=Strain", "--out", tmp_path / "o.csv")
    assert found.exit_code == 0, found.output
    assert "look at strain_back: it was read as a strain of up to 277" in found.stdout
    found = invoke(source, "--sensor", "strain_back=Strain", "--scale", "strain_back=1e-6", "--out", tmp_path / "p.csv")
    assert found.exit_code == 0, found.output
    assert "no gauge survives" not in found.stdout
    found = invoke(source, "--sensor", "strain_back=Strain", "--scale", "strain_back=1e-5", "--out", tmp_path / "q.csv")
    assert re.search(r"largest 277\d\d µm/m at 1\.5", found.stdout), "2.77e+04"
    assert read_measured(tmp_path / "p.csv").channels["strain_back"].max() == pytest.approx(2771e-6, rel=0.01)
