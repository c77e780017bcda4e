"""Files of loggers, spreadsheets and solvers come in as the numbers that were put into them."""

from __future__ import annotations

import importlib
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from scipy.io import savemat
from typer.testing import CliRunner

from birdstrike.cli.app import app
from birdstrike.data.curves import Measured, read_measured
from birdstrike.data.errors import MeasuredError, UserError
from birdstrike.data.exports.columns import chosen
from birdstrike.data.import_curve import ImportOptions, import_record, read_export

TIME = 1e-5 * np.arange(200)
WAVE = 4e-3 * np.sin(np.pi * TIME / 2e-3)  # m
CENTRE = "displacement_centre"


def imported(source: Path, *options: str) -> Measured:
    out = source.with_name("out.csv")
    arguments = ["import", str(source), "--out", str(out), *options]
    found = CliRunner().invoke(app, arguments, env={"COLUMNS": "300"})
    assert found.exit_code == 0, found.output
    return read_measured(out)


def is_the_wave(found: Measured) -> None:
    np.testing.assert_allclose(found.time, TIME, atol=1e-12)
    np.testing.assert_allclose(found.channels[CENTRE], WAVE, atol=2e-8)


def test_matlab_vectors_and_structs(tmp_path: Path) -> None:
    savemat(tmp_path / "a.mat", {"t": TIME, "w": 1e3 * WAVE, "rate": 1e5, "note": "shot 12"})
    is_the_wave(imported(tmp_path / "a.mat", "--sensor", f"{CENTRE}=w", "--unit", "mm", "--time-unit", "s"))
    savemat(tmp_path / "b.mat", {"shot": {"time": 1e3 * TIME, "data": np.stack([0 * WAVE, 1e3 * WAVE], axis=1)}})
    options = ("--table", "shot", "--sensor", f"{CENTRE}=data 2", "--unit", "mm", "--time-unit", "ms")
    is_the_wave(imported(tmp_path / "b.mat", *options))


def test_matrices_of_simulink_and_arrays_of_structs(tmp_path: Path) -> None:
    """A wide matrix was read as 200 columns of two numbers; channels of a struct array were passed over."""
    options = ("--sensor", f"{CENTRE}=data 2", "--unit", "mm", "--time-unit", "s")
    savemat(tmp_path / "a.mat", {"data": np.stack([TIME, 1e3 * WAVE])})
    found = imported(tmp_path / "a.mat", *options)
    is_the_wave(found)
    assert any("of data the rows are the channels" in line for line in found.provenance)
    channels = [{"name": "force", "data": 0 * WAVE}, {"name": "laser", "data": 1e3 * WAVE}]
    savemat(tmp_path / "b.mat", {"t": TIME, "ch": channels})
    is_the_wave(imported(tmp_path / "b.mat", "--sensor", f"{CENTRE}=ch(2).data", *options[2:]))
    with h5py.File(tmp_path / "c.mat", "w") as file:
        file["t"], file["of 1"], file["of 2"] = TIME[None], 0 * WAVE[None], 1e3 * WAVE[None]
        cells = file.create_dataset("ch", (2, 1), dtype=h5py.ref_dtype)
        cells[:, 0] = [file["of 1"].ref, file["of 2"].ref]
        file["text"] = np.full((200, 1), 119, dtype=np.uint16)
        file["text"].attrs["MATLAB_class"] = np.bytes_("char")
    read = imported(tmp_path / "c.mat", "--sensor", f"{CENTRE}=ch{{2}}", *options[2:])
    is_the_wave(read)
    assert "text" not in read_export(tmp_path / "c.mat", ImportOptions({}))[0].names, "text was a column of numbers"


def test_complex_numbers_of_matlab_are_left_out_and_said(tmp_path: Path) -> None:
    """Their imaginary parts were dropped without a word; a file that then held the clock alone, in a traceback."""
    savemat(tmp_path / "a.mat", {"t": TIME, "w": WAVE + 1j, "v": WAVE})
    units = {"time": "s", CENTRE: "m"}
    assert import_record(tmp_path / "a.mat", ImportOptions({CENTRE: ""}, units=units)).channels[CENTRE] @ WAVE > 0
    savemat(tmp_path / "a.mat", {"t": TIME, "w": WAVE + 1j})
    with pytest.raises(MeasuredError, match=r"has no column beside its clock .*: t; columns of complex .* left out: w"):
        import_record(tmp_path / "a.mat", ImportOptions({CENTRE: ""}, units=units))


def test_tdms_channels_with_their_units_and_clock(tmp_path: Path) -> None:
    nptdms: Any = pytest.importorskip("nptdms")
    wave = {"unit_string": "mm", "wf_increment": 1e-5, "wf_start_offset": 0.0, "wf_samples": 200}
    with nptdms.TdmsWriter(tmp_path / "a.tdms") as file:
        file.write_segment([nptdms.ChannelObject("Shot 12", "laser", 1e3 * WAVE, wave)])
    is_the_wave(imported(tmp_path / "a.tdms", "--sensor", f"{CENTRE}=laser"))


def test_dates_of_tdms_are_a_clock_and_a_damaged_scale_is_the_users_error(tmp_path: Path) -> None:
    """The channel of dates was passed over, and the laser taken for the clock; the damage ended in a traceback."""
    nptdms: Any = pytest.importorskip("nptdms")
    dates = np.datetime64("2026-11-21T10:15:30") + (1e9 * TIME).round().astype("timedelta64[ns]")
    laser = nptdms.ChannelObject("G", "laser", 1e3 * WAVE, {"unit_string": "mm"})
    with nptdms.TdmsWriter(tmp_path / "a.tdms") as file:
        file.write_segment([nptdms.ChannelObject("G", "Time", dates), laser])
    found = imported(tmp_path / "a.tdms", "--sensor", f"{CENTRE}=laser")
    is_the_wave(found)
    assert any(
        "times of day were read, and count from the first row, 2026-11-21T10:15:30" in x for x in found.provenance
    )
    wave = nptdms.ChannelObject("G", "laser", 1e3 * WAVE, {"unit_string": "mm", "wf_increment": 1e-5})
    with nptdms.TdmsWriter(tmp_path / "c.tdms") as file:
        file.write_segment([nptdms.ChannelObject("G", "Trigger", dates[:1]), wave])
    is_the_wave(imported(tmp_path / "c.tdms", "--sensor", f"{CENTRE}=laser"))
    scale = {"Scale_Type": "Linear", "Linear_Slope": 0.1, "Linear_Y_Intercept": 0.0, "Linear_Input_Source": 0}
    broken = {"NI_Number_Of_Scales": 2, "unit_string": "mm"} | {f"NI_Scale[1]_{key}": v for key, v in scale.items()}
    with nptdms.TdmsWriter(tmp_path / "b.tdms") as file:
        file.write_segment([nptdms.ChannelObject("G", "laser", np.arange(9, dtype=np.int16), broken)])
    with pytest.raises(MeasuredError, match=r"b\.tdms cannot be read as TDMS: KeyError"):
        import_record(tmp_path / "b.tdms", ImportOptions({CENTRE: ""}, rate="1 kHz"))


@pytest.mark.parametrize(
    "other",
    [{"wf_increment": 2e-5}, {"wf_start_offset": -1e-3}, {"wf_start_time": np.datetime64("2026-03-12T10:00:00.005")}],
    ids=["rate", "offset", "start"],
)
@pytest.mark.parametrize("count", [200, 150])
def test_a_tdms_channel_on_a_clock_of_its_own_is_read_on_it(tmp_path: Path, other: dict[str, Any], count: int) -> None:
    """Every channel of the group was read on the first one's clock."""
    nptdms: Any = pytest.importorskip("nptdms")
    start = np.datetime64("2026-03-12T10:00:00")
    wave = {"unit_string": "mm", "wf_increment": 1e-5, "wf_start_offset": 0.0, "wf_start_time": start}
    objects = [
        nptdms.ChannelObject("Shot", "laser", 1e3 * WAVE, wave),
        nptdms.ChannelObject("Shot", "force", WAVE[:count] + 1.0, {**wave, "unit_string": "kN", **other}),
    ]
    with nptdms.TdmsWriter(tmp_path / "a.tdms") as file:
        file.write_segment(objects)
    both = ImportOptions({CENTRE: "laser", "reaction_force": "force"})
    with pytest.raises(
        UserError, match=r'column "force" \(reaction_force\) stands behind a clock of its own, column 3'
    ):
        import_record(tmp_path / "a.tdms", both)
    found = import_record(tmp_path / "a.tdms", ImportOptions({"reaction_force": "force"}, "3"))
    begin = 5e-3 if "wf_start_time" in other else other.get("wf_start_offset", 0.0)
    time, force = found.points("reaction_force")
    np.testing.assert_allclose(time, begin + other.get("wf_increment", 1e-5) * np.arange(count), atol=1e-12)
    np.testing.assert_allclose(force, 1e3 * (WAVE[:count] + 1.0))


def test_a_waveform_without_an_offset_begins_at_zero(tmp_path: Path) -> None:
    nptdms: Any = pytest.importorskip("nptdms")
    with nptdms.TdmsWriter(tmp_path / "a.tdms") as file:
        wave = {"unit_string": "mm", "wf_increment": 1e-5}
        file.write_segment([nptdms.ChannelObject("Shot 12", "laser", 1e3 * WAVE, wave)])
    is_the_wave(imported(tmp_path / "a.tdms", "--sensor", f"{CENTRE}=laser"))


def test_several_times_in_a_file_of_matlab_are_told_apart(tmp_path: Path) -> None:
    savemat(tmp_path / "a.mat", {"t": TIME, "w": WAVE, "time_f": 2.0 * TIME, "f": WAVE + 1.0})
    units = {"time": "s", "w": "m", "f": "N"}
    with pytest.raises(UserError, match=r'"f" \(f\) stands behind a clock of its own, column 3 "time_f"'):
        import_record(tmp_path / "a.mat", ImportOptions({"w": "w", "f": "f"}, units=units))
    found = import_record(tmp_path / "a.mat", ImportOptions({"f": "f"}, "time_f", units={"time": "s", "f": "N"}))
    np.testing.assert_allclose(found.time, 2.0 * TIME)


def test_a_file_without_a_number_is_refused(tmp_path: Path) -> None:
    """A logger that lost its sensors writes NaN alone; it ended in a traceback."""
    savemat(tmp_path / "a.mat", {"t": np.full(9, np.nan), "w": np.full(9, np.nan)})
    with pytest.raises(MeasuredError, match=r'its columns "t", "w" hold no number'):
        import_record(tmp_path / "a.mat", ImportOptions({"w": "w"}, units={"time": "s", "w": "m"}))


def test_numbers_that_stand_as_text_in_a_sheet_are_asked_about(tmp_path: Path) -> None:
    """1,503 MPa as text beside a clock of numbers was read as 1503 MPa, and --decimal was passed over."""
    openpyxl: Any = pytest.importorskip("openpyxl")
    workbook = openpyxl.Workbook()
    for row in (["t [ms]", "p [MPa]"], [0.5, "1,503"], [0.75, "2,125"], [1.034, "1,250"]):
        workbook.active.append(row)
    workbook.save(tmp_path / "a.xlsx")
    pressure = ImportOptions({"pressure": "p"})
    with pytest.raises(UserError, match=r'line 2: "1,503" is 1503 or 1\.503; say which .*: --decimal'):
        import_record(tmp_path / "a.xlsx", pressure)
    found = import_record(tmp_path / "a.xlsx", replace(pressure, decimal=","))
    assert found.time.tolist() == [0.5e-3, 0.75e-3, 1.034e-3]
    assert found.channels["pressure"].tolist() == [1.503e6, 2.125e6, 1.25e6]


def test_a_sheet_of_excel(tmp_path: Path) -> None:
    openpyxl: Any = pytest.importorskip("openpyxl")
    workbook = openpyxl.Workbook()
    sheet = workbook.active
    sheet.append(["Shot 12", None])
    sheet.append(["Time (ms)", "Disp Z (mm)"])
    for t, w in zip(1e3 * TIME, 1e3 * WAVE, strict=True):
        sheet.append([float(t), float(w)])
    for row, shown in ((2, "Strain [%]"), *((i, 15e-6 * i) for i in range(3, 203))):
        sheet.cell(row, 3, shown).number_format = "0.00%"
        sheet.cell(row, 4, "Span [%]" if row == 2 else 15e-4 * row).number_format = '0.00"%"'
    workbook.create_sheet("Notes")
    workbook.save(tmp_path / "a.xlsx")
    sensors = (f"{CENTRE}=Disp Z (mm)", "strain=Strain", "span=Span")
    options = ("--table", "Sheet", *(text for one in sensors for text in ("--sensor", one)))
    found = imported(tmp_path / "a.xlsx", *options)
    is_the_wave(found)
    for name in ("strain", "span"):
        assert found.channels[name][-1] == pytest.approx(15e-6 * 202), "a fraction, and a number, shown as 0.30%"
    said = CliRunner().invoke(app, ["import", str(tmp_path / "a.xlsx"), "--sensor", CENTRE, "--out", "o.csv"])
    assert said.exit_code == 1
    assert 'holds 2 sheets; choose one: --table "Sheet"' in said.output
    with pytest.raises(MeasuredError, match=r"birdstrike import .*a\.xlsx --sensor"):
        read_measured(tmp_path / "a.xlsx")


def test_sheets_of_a_chart_alone_are_no_tables_and_a_damaged_sheet_is_named(tmp_path: Path) -> None:
    """The first were to be chosen, and ended in a traceback, as a damaged one did."""
    openpyxl: Any = pytest.importorskip("openpyxl")
    workbook, chart = openpyxl.Workbook(), openpyxl.chart.LineChart()
    for row in (["t [ms]", "w [mm]"], *([0.1 * i, float(i)] for i in range(50))):
        workbook.active.append(row)
    chart.add_data(openpyxl.chart.Reference(workbook.active, min_col=2, min_row=1, max_row=51))
    workbook.create_chartsheet("Plot").add_chart(chart)
    workbook.save(tmp_path / "a.xlsx")
    assert import_record(tmp_path / "a.xlsx", ImportOptions({"w": "w"})).time.shape == (50,)
    content = bytearray((tmp_path / "a.xlsx").read_bytes())
    at = content.find(b"xl/worksheets/sheet1.xml") + 200
    content[at : at + 20] = bytes(20)
    (tmp_path / "b.xlsx").write_bytes(content)
    with pytest.raises(MeasuredError, match=r"b\.xlsx cannot be read as a workbook of Excel"):
        import_record(tmp_path / "b.xlsx", ImportOptions({"w": "w"}))


def test_a_file_without_a_table_is_refused(tmp_path: Path) -> None:
    """A TDMS file of properties alone ended in a traceback."""
    with pytest.raises(MeasuredError, match="holds no group with a curve"):
        chosen(tmp_path / "a.tdms", [], "", "group")


def test_universal_files_of_type_58(tmp_path: Path) -> None:
    pyuff: Any = pytest.importorskip("pyuff")
    made = {
        "type": 58, "binary": 0, "func_type": 1, "rsp_node": 7, "rsp_dir": 3, "ref_node": 0, "ref_dir": 0,
        "data": 1e3 * WAVE, "x": TIME, "id1": "laser", "id4": "", "id5": "", "rsp_ent_name": "NONE",
        "ref_ent_name": "NONE", "abscissa_spacing": 1, "abscissa_spec_data_type": 17, "ordinate_spec_data_type": 8,
        "orddenom_spec_data_type": 0, "ordinate_axis_units_lab": "mm", "abscissa_axis_units_lab": "s",
    }  # fmt: skip
    pyuff.UFF(str(tmp_path / "a.uff")).write_sets([made], "overwrite")
    is_the_wave(imported(tmp_path / "a.uff", "--sensor", f"{CENTRE}=laser"))


def test_a_node_of_a_binout(tmp_path: Path) -> None:
    binout: Any = pytest.importorskip("lasso.dyna.binout")
    assert binout.Binout
    lsda = importlib.import_module("lasso.dyna.lsda_py3").Lsda
    file = lsda(str(tmp_path / "binout0000"), "w")
    file.cd("/nodout", 1)
    file.cd("/nodout/metadata", 1)
    file.write("ids", lsda.I4, [7, 1026])
    for i, (t, w) in enumerate(zip(1e3 * TIME, 1e3 * WAVE, strict=True)):
        file.cd(f"/nodout/d{i + 1:06d}", 1)
        file.write("time", lsda.R8, [t])
        file.write("z_displacement", lsda.R8, [0.0, -w])
    file.close()
    options = ("--sensor", f"{CENTRE}=z_displacement 1026", "--scale", "-1", "--unit", "mm", "--time-unit", "ms")
    found = imported(tmp_path / "binout0000", *options)
    is_the_wave(found)
    assert found.simulated


def test_a_binout_is_refused_with_what_reads_it_where_that_is_not_installed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(__import__("sys").modules, "lasso.dyna.binout", None)
    monkeypatch.delitem(__import__("sys").modules, "birdstrike.data.exports.binout", raising=False)
    (tmp_path / "binout0000").write_bytes(b"\0" * 64)
    found = CliRunner().invoke(app, ["import", str(tmp_path / "binout0000"), "--sensor", CENTRE, "--out", "o.csv"])
    assert found.exit_code == 1
    assert 'lasso-python reads: pip install "birdstrike[binout]"' in found.output


@pytest.mark.parametrize("name", ["a.mat", "a.tdms", "a.xlsx", "a.uff"])
def test_a_file_that_is_not_what_its_name_says_is_the_users_error(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text("no such thing\n" * 3)
    found = CliRunner().invoke(app, ["import", str(tmp_path / name), "--sensor", CENTRE, "--out", "o.csv"])
    assert found.exit_code == 1
    assert "Traceback" not in found.output
    assert name in found.output


@pytest.mark.parametrize("name", ["curves.csv", "curves.uff", "strikeT01"])
def test_a_table_is_not_chosen_where_a_format_holds_one(name: str, tmp_path: Path) -> None:
    with pytest.raises(MeasuredError, match=r"--table shot 2: .* holds a single table; leave it out"):
        import_record(tmp_path / name, ImportOptions({"displacement_centre": ""}, table="shot 2"))
