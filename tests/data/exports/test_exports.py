"""Files of loggers, spreadsheets and solvers come in as the numbers that were put into them."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat
from typer.testing import CliRunner

from birdstrike.cli.app import app
from birdstrike.data.curves import Measured, read_measured
from birdstrike.data.errors import MeasuredError

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


def test_tdms_channels_with_their_units_and_clock(tmp_path: Path) -> None:
    nptdms: Any = pytest.importorskip("nptdms")
    wave = {"unit_string": "mm", "wf_increment": 1e-5, "wf_start_offset": 0.0, "wf_samples": 200}
    with nptdms.TdmsWriter(tmp_path / "a.tdms") as file:
        file.write_segment([nptdms.ChannelObject("Shot 12", "laser", 1e3 * WAVE, wave)])
    is_the_wave(imported(tmp_path / "a.tdms", "--sensor", f"{CENTRE}=laser"))


def test_a_sheet_of_excel(tmp_path: Path) -> None:
    openpyxl: Any = pytest.importorskip("openpyxl")
    workbook = openpyxl.Workbook()
    sheet = workbook.active
    sheet.append(["Shot 12", None])
    sheet.append(["Time (ms)", "Disp Z (mm)"])
    for t, w in zip(1e3 * TIME, 1e3 * WAVE, strict=True):
        sheet.append([float(t), float(w)])
    workbook.create_sheet("Notes")
    workbook.save(tmp_path / "a.xlsx")
    is_the_wave(imported(tmp_path / "a.xlsx", "--table", "Sheet", "--sensor", f"{CENTRE}=Disp Z (mm)"))
    found = CliRunner().invoke(app, ["import", str(tmp_path / "a.xlsx"), "--sensor", CENTRE, "--out", "o.csv"])
    assert found.exit_code == 1
    assert 'holds 2 sheets; choose one: --table "Sheet"' in found.output
    with pytest.raises(MeasuredError, match=r"birdstrike import .*a\.xlsx --sensor"):
        read_measured(tmp_path / "a.xlsx")


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
