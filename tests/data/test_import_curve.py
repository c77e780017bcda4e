"""Other people's curve files: the numbers they hold, in SI, and every error with its line."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from birdstrike.data.curves import Measured, read_measured, write_measured
from birdstrike.data.errors import MeasuredError, UserError
from birdstrike.data.import_curve import ImportOptions, import_record
from birdstrike.data.units import scaled

CENTRE = {"displacement_centre": ""}
MM_MS = {"time": "ms", "displacement_centre": "mm"}


def imported(path: Path, text: str, options: ImportOptions, encoding: str = "utf-8") -> Measured:
    path.write_text(text, encoding=encoding)
    return import_record(path, options)


def nodout(times: Iterable[float], nodes: Sequence[int], z: float = -1.25e-3, rotations: bool = True) -> str:
    """A nodout in the formats of LS-DYNA's own converter l2a; node n is at z * n * time."""
    text = "\n LS-DYNA user input                        date 11/21/2026\n"
    for step, time in enumerate(times):
        title = f" n o d a l   p r i n t   o u t   f o r   t i m e  s t e p{step:8d}"
        text += f"\n\n\n{title}                              ( at time{time:14.7E} )\n"
        text += "\n nodal point  x-disp     y-disp      z-disp      x-vel       y-vel       z-vel      "
        text += "x-accl      y-accl      z-accl      x-coor      y-coor      z-coor\n"
        for n in nodes:
            values = [0.0, 0.0, z * n * time, *[-1.5e101] * 9]
            text += f"{n:9d}{values[0]:13.4E}" + "".join(f"{value:12.4E}" for value in values[1:]) + "\n"
        if rotations:
            text += f"\n\n\n{title}                              ( at time{time:14.7E} )\n"
            text += "\n nodal point  x-rot      y-rot       z-rot\n"
            text += "".join(f"{n:9d}{1.0:13.4E}{1.0:12.4E}{1.0:12.4E}\n" for n in nodes)
    return text


CHINESE = "编号,撞击03\n时间(ms),中心位移(mm),背面应变(με)\n"
JAPANESE = "試験,衝突03\n時間(ms),変位(mm),ひずみ(μm/m)\n"
GERMAN = "Prüfung,Größe 3\nZeit (ms),Weg Rückseite – Mitte (mm),Dehnung (µm/m)\n"
ROWS = "".join(f"{0.1 * i:.1f},{0.01 * i:.2f},{i}\n" for i in range(12))


@pytest.mark.parametrize(
    ("head", "encoding", "column", "said"),
    [
        (CHINESE, "gbk", "中心位移", "GBK (Chinese)"),
        (JAPANESE, "shift_jis", "変位", "Shift-JIS (Japanese)"),
        (GERMAN, "cp1252", "Weg Rückseite – Mitte", "Windows-1252"),
        ("Temps (ms),Déplacement créé (mm),Effort cadré (µm/m)\n", "latin-1", "Déplacement créé", "Windows-1252"),
        ("Χρόνος (ms),Μετατόπιση (mm),Παραμόρφωση (µm/m)\n", "cp1253", "Μετατόπιση", "Windows-1253 (Greek)"),
        ("Χρόνος (ms),Θέση (mm),Δύναμη (µm/m)\n", "cp1253", "Θέση", "Windows-1253 (Greek)"),
        ("Время (ms),Прогиб (mm),Деформация (µm/m)\n", "cp1251", "Прогиб", "Windows-1251 (Cyrillic)"),
        ("ВРЕМЯ (ms),СИЛА (mm),X (µm/m)\n", "cp1251", "СИЛА", "Windows-1251 (Cyrillic)"),
    ],
)
def test_an_encoding_that_is_guessed_is_said(tmp_path: Path, head: str, encoding: str, column: str, said: str) -> None:
    """Chinese heads were read as Latin-1 without a word."""
    names = {"displacement_centre": column, "strain": "3"}
    found = imported(tmp_path / "a.csv", head + ROWS, ImportOptions(names), encoding)
    assert f'"{column}"' in " ".join(found.provenance)
    assert any(f"is not UTF-8 and was read as {said}" in line for line in found.provenance)
    assert found.channels["strain"][-1] == pytest.approx(11e-6)
    stated = imported(tmp_path / "a.csv", head + ROWS, ImportOptions(names, encoding=encoding), encoding)
    assert not any("UTF-8" in line for line in stated.provenance)
    sure = imported(tmp_path / "a.csv", head + ROWS, ImportOptions(names), "utf-8")
    assert not any("UTF-8" in line for line in sure.provenance)


@pytest.mark.parametrize(
    ("encoding", "words"),
    [
        ("klingon", "--encoding klingon is no encoding that is known; write one such as utf-8"),
        ("utf-8", "line 1: its bytes are no text in --encoding utf-8; leave the option out, or state another"),
    ],
)
def test_an_encoding_that_cannot_be_is_refused(tmp_path: Path, encoding: str, words: str) -> None:
    options = ImportOptions({"displacement_centre": "2"}, encoding=encoding)
    with pytest.raises(MeasuredError, match=words):
        imported(tmp_path / "a.csv", CHINESE + ROWS, options, "gbk")


def test_an_encoding_of_a_file_that_is_no_text_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.mat").write_bytes(b"")
    with pytest.raises(MeasuredError, match=r"--encoding gbk: .*a\.mat is no text file; leave it out"):
        import_record(tmp_path / "a.mat", ImportOptions(CENTRE, encoding="gbk"))


def test_nodout_gives_the_component_of_the_node(tmp_path: Path) -> None:
    times = np.array([0.0, 0.1, 0.2, 0.3])
    turned = {"displacement_centre": -1.0}
    options = ImportOptions({"displacement_centre": "z-disp"}, units=MM_MS, scales=turned, node=1026)
    found = imported(tmp_path / "nodout", nodout(times, (7, 1026)), options)
    assert found.time == pytest.approx(1e-3 * times, rel=1e-12)
    assert found.channels["displacement_centre"] == pytest.approx(1.25e-6 * 1026 * times, rel=1e-4)
    assert found.units == {"displacement_centre": "m"}
    assert found.simulated, "a solver's output counts as simulated"


def test_numbers_of_a_nodout_that_touch_are_told_apart_by_their_columns(tmp_path: Path) -> None:
    """-1.5000E+101 fills its column of twelve, so that no blank separates it from its neighbours."""
    found = imported(
        tmp_path / "nodout",
        nodout([0.0, 1.0], [3]),
        ImportOptions({"displacement_centre": "x-coor"}, units={"time": "s", "displacement_centre": "m"}),
    )
    assert found.channels["displacement_centre"].tolist() == [-1.5e101, -1.5e101]


def test_several_nodes_and_no_choice_is_an_error_that_lists_them(tmp_path: Path) -> None:
    units = {"time": "ms", "a": "mm"}
    with pytest.raises(UserError, match=r"holds 2 nodes; choose one: --node 7 \(there are 7, 1026\)"):
        imported(tmp_path / "nodout", nodout([0.0, 1.0], (7, 1026)), ImportOptions({"a": "z-disp"}, units=units))
    with pytest.raises(UserError, match="has no node 8; it has 7, 1026"):
        import_record(tmp_path / "nodout", ImportOptions({"a": "z-disp"}, units=units, node=8))
    with pytest.raises(UserError, match=r'which column is "a"\? Write --sensor a="z-disp"'):
        import_record(tmp_path / "nodout", ImportOptions({"a": ""}, units=units, node=7))


def test_nodout_that_was_cut_short_is_an_error_with_its_line(tmp_path: Path) -> None:
    whole = nodout([0.0, 1.0], [7], rotations=False)
    cut = whole[: whole.rindex("7") + 60]
    with pytest.raises(UserError, match=rf"line {len(cut.splitlines())}: value \d+ is .*cut short\?"):
        imported(tmp_path / "nodout", cut, ImportOptions({"a": "x-disp"}, units={"time": "ms", "a": "mm"}))


TWO_COLUMNS = {
    "blanks, no header": ("0.34 0.121246\n0.59   1.232132\n", MM_MS),
    "tabs, header with units": ("time [ms]\tz (mm)\n0.34\t0.121246\n0.59\t1.232132\n", {}),
    "a comment as header": ("# shot 12\n# t_ms,w_mm\n0.34,0.121246\n0.59,1.232132\n", {}),
    "decimal commas": ("Zeit (ms);Weg (mm)\n0,34;0,121246\n0,59;1,232132\n", {}),
    "rows of empty cells": ("t_ms;w_mm;\n0.34;0.121246;\n0.59;1.232132;\n;;\n;;\n", {}),
    "a very long line above": ('"' + "x" * 200_000 + "\nt_ms,w_mm\n0.34,0.121246\n0.59,1.232132\n", {}),
    "strokes": ("Zeit [ms]|Weg [mm]\n0.34|0.121246\n0.59|1.232132\n", {}),
    "units behind a word": ("Zeit in ms;Weg in mm\n0,34;0,121246\n0,59;1,232132\n", {}),
    "units behind a comma": ('"Time, µs","Disp, mm"\n340,0.121246\n590,1.232132\n', {}),
    "a line of units": ("t,w\nms,mm\n0.34,0.121246\n0.59,1.232132\n", {}),
    "Fortran": ("  3.4D-01  1.21246D-01\n  5.9D-01  1.232132D+00\n", MM_MS),
    "names with blanks, blanks between": ("Time (ms)   Disp at centre (mm)\n0.34  0.121246\n0.59  1.232132\n", {}),
    "types below units": ("Time,Laser 1\nms,mm\nfloat,float\n0.34,0.121246\n0.59,1.232132\n", {}),
    "figures above the table": ("Time,Laser 1\n[ms],[mm]\nmin,0.1\nmax,1.3\n0.34,0.121246\n0.59,1.232132\n", {}),
    "a comma too many in the head": ("t_ms,w_mm,\n0.34,0.121246\n0.59,1.232132\n", {}),
    "a date before the time": (
        "Date,Time [s],w [mm]\n12-Mar,0.34e-3,0.121246\n12-Mar,0.59e-3,1.232132\n",
        {},
    ),
    "thousandths of an inch": ("t_ms,w [mils]\n0.34,4.773464566929134\n0.59,48.50913385826772\n", {}),
    "LS-PrePost": (
        "Curveplot\nLS-DYNA user input\nTime\nZ-displacement\nNode no.\n1026 #pts=2\n* Minval= 0.1\n"
        "0.34 0.121246\n0.59 1.232132\nendcurve\n",
        MM_MS,
    ),
}


@pytest.mark.parametrize("kind", TWO_COLUMNS)
def test_two_columns_however_they_are_written(tmp_path: Path, kind: str) -> None:
    text, units = TWO_COLUMNS[kind]
    found = imported(tmp_path / "curve.txt", text, ImportOptions(CENTRE, units=units))
    assert found.time.tolist() == [0.34e-3, 0.59e-3]
    values = found.channels["displacement_centre"].tolist()
    if kind == "thousandths of an inch":
        assert values == pytest.approx([0.121246e-3, 1.232132e-3], rel=1e-12)
    else:
        assert values == [scaled("0.121246", "mm"), scaled("1.232132", "mm")]
    assert not found.simulated


OF_INSTRUMENTS = {
    "oscilloscope, units written out": ("X,CH1,\nSecond,Volt,\n", "{t},{w},\n", "CH1"),
    "oscilloscope, channels by number": ("x-axis,1\nsecond,Volt\n", "{t},{w}\n", "1"),
    "a comment's column that no row has": (
        "Y_Unit_Label\tV\t\t\nX0\t0\t\t\n***End_of_Header***\t\t\t\n\nX_Value\tLaser\tComment\n",
        "{t}\t{w}\n",
        "Laser",
    ),
    "names and units behind a word, a date below them": (
        '"TraceName","CH1 "\n"VUnit","V"\n"HOffset",0\n"Date","2026/03/12"\n\n',
        "{t},{w},\n",
        "CH1",
    ),
    "an empty column on the left": ("\tVersuch 12\n\tZeit\tWeg\n\ts\tV\n", "\t{t}\t{w}\n", "Weg"),
    "the head again on every page": ("t [s];w [V]\n", "{t};{w}\n", "w"),
}


TEKTRONIX = {
    "above the table": (
        "Model,MSO54\nHorizontal Units,s\nVertical Units,V,V\n,,\nLabel,LASER,FRAME\nTIME,CH1,CH2\n",
        lambda k: f"{1e-3 * k:.6e},{k % 5},0\n",
        "CH1",
    ),
    "beside its first rows": (
        "",
        lambda k: f"{dict(enumerate(TDS)).get(k, ',')},,{1e-3 * k:.12f},{k % 5},\n",
        "5",
    ),
    "in milliseconds": ("HUnit,ms\nTIME,CH1\n", lambda k: f"{k},{k % 5}\n", "CH1"),
}
TDS = ("Record Length,12", "Sample Interval,1e-3", "Vertical Units,V", "Horizontal Units,s", "Source,CH1")


@pytest.mark.parametrize("kind", TEKTRONIX)
def test_the_clock_of_an_oscilloscope_has_the_unit_of_its_settings(tmp_path: Path, kind: str) -> None:
    """It was asked for, and milliseconds proposed."""
    head, row, column = TEKTRONIX[kind]
    options = ImportOptions({"w": column}, units={"w": "mm"}, scales={"w": 2.5}, per={"w": "V"})
    found = imported(tmp_path / "a.csv", head + "".join(map(row, range(99))), options)
    assert "its head: ,," not in found.provenance
    assert found.time == pytest.approx(1e-3 * np.arange(99))
    assert found.channels["w"] == pytest.approx(2.5e-3 * (np.arange(99) % 5))


@pytest.mark.parametrize("head", ['w (1")', 'w (")', 'w / "', "w [\u2033]"])
def test_an_inch_mark_is_a_unit(tmp_path: Path, head: str) -> None:
    found = imported(
        tmp_path / "a.csv", f"t [ms];{head}\n" + "".join(f"{k};{k}\n" for k in range(9)), ImportOptions(CENTRE)
    )
    assert found.channels["displacement_centre"] == pytest.approx(0.0254 * np.arange(9))


@pytest.mark.parametrize("name", ['Laser 1" gauge', '1" gauge'])
def test_an_inch_mark_in_a_name_is_part_of_it(tmp_path: Path, name: str) -> None:
    rows = "".join(f"{k},{k},0\n" for k in range(9))
    found = imported(tmp_path / "a.csv", f"t [ms],{name} [mm],b [mm]\n{rows}", ImportOptions({"w": name}))
    assert found.channels["w"] == pytest.approx(1e-3 * np.arange(9))


def test_one_line_behind_a_table_is_one_line(tmp_path: Path) -> None:
    rows = "".join(f"{k},{k}\n" for k in range(9))
    found = imported(tmp_path / "a.csv", f"t [ms],w [mm]\n{rows}end of record 7\n", ImportOptions(CENTRE))
    assert any(line.startswith("1 line behind the table, the last line 11, was left out") for line in found.provenance)


@pytest.mark.parametrize("kind", OF_INSTRUMENTS)
def test_heads_of_instruments_name_their_columns(tmp_path: Path, kind: str) -> None:
    head, row, column = OF_INSTRUMENTS[kind]
    rows = [row.format(t=f"{1e-3 * k:.3f}", w=k % 5) for k in range(12)]
    again = head if "again" in kind else ""
    options = ImportOptions({"w": column}, units={"time": "s", "w": "mm"}, scales={"w": 2.5}, per={"w": "V"})
    found = imported(tmp_path / "a.csv", "".join([head, *rows[:6], again, *rows[6:]]), options)
    assert found.time == pytest.approx(1e-3 * np.arange(12))
    assert found.channels["w"] == pytest.approx(2.5e-3 * (np.arange(12) % 5))
    assert any("lines that repeat the head were left out: 1, the first line 8" in t for t in found.provenance) == (
        "again" in kind
    )


def test_the_number_of_a_sample_beside_a_row_of_volts(tmp_path: Path) -> None:
    text = "X,CH1,CH2,Start,Increment,\nSequence,Volt,Volt,-1.0e-03,1.0e-03\n0,0,5,\n1,2,6,\n2,4,7,\n"
    options = ImportOptions({"w": "CH2"}, rate="1 ms", shift="-1 ms", units={"w": "mm"}, scales={"w": 1.0})
    with pytest.raises(UserError, match='"CH2" is in Volt, which is no unit of a sensor'):
        imported(tmp_path / "a.csv", text, replace(options, units={}))
    found = imported(tmp_path / "a.csv", text, options)
    assert found.time.tolist() == [-1e-3, 0.0, 1e-3]
    assert found.channels["w"].tolist() == [5e-3, 6e-3, 7e-3]


def test_a_second_record_is_not_joined_to_the_first_by_the_rate(tmp_path: Path) -> None:
    text = "w [mm];f [kN]\n0;1\n1;2\nw [mm];f [kN]\n0;1\n1;2\n"
    with pytest.raises(UserError, match=r'line 4: "w \[mm\];f \[kN\]" is not 2 numbers'):
        imported(tmp_path / "a.csv", text, ImportOptions({"w": "w"}, rate="1 ms"))


def test_settings_beside_the_first_rows_are_read_past_and_no_row_is_lost(tmp_path: Path) -> None:
    """The rows above the first one without a word beside it were lost without a word."""
    beside = ["Record Length,80", "Sample Interval,1e-3", "Trigger Point,0", "", "Source,CH1", "Vertical Units,V"]
    rows = [f"{beside[k] if k < len(beside) and beside[k] else ','},,{1e-3 * k:.3f},{k % 5},\n" for k in range(80)]
    options = ImportOptions({"w": ""}, units={"time": "s", "w": "mm"})
    found = imported(tmp_path / "scope.csv", "".join(rows), options)
    assert found.time == pytest.approx(1e-3 * np.arange(80))
    assert found.channels["w"] == pytest.approx(1e-3 * (np.arange(80) % 5))


def test_a_comment_behind_the_first_row_does_not_lose_it(tmp_path: Path) -> None:
    text = "t [s]\tw [mm]\n0\t1\tshot 12\n1\t2\n2\t3\n"
    with pytest.raises(UserError, match=r"line 2: .* is not 2 numbers, as the rows below it are"):
        imported(tmp_path / "a.lvm", text, ImportOptions(CENTRE))


def test_csv_with_other_headers_by_name_and_by_number(tmp_path: Path) -> None:
    text = "Date;11/21\nSample;t (ms);Disp Z (mm);Force (kN)\n1;0.0;0.0;\n2;0.1;-0.5;12.5\n3;0.2;;13.5\n"
    columns = {"displacement_centre": "disp z", "contact_force": "4"}
    options = ImportOptions(columns, "t", scales={"displacement_centre": -2.0})
    found = imported(tmp_path / "daq.csv", text, options)
    assert found.time.tolist() == [0.0, 1e-4, 2e-4]
    np.testing.assert_array_equal(found.channels["displacement_centre"], [0.0, 1e-3, np.nan])
    np.testing.assert_array_equal(found.channels["contact_force"], [np.nan, 12.5e3, 13.5e3])
    assert found.provenance[0].startswith("Imported by birdstrike from daq.csv (SHA-256 ")
    assert "displacement_centre was multiplied by -2." in found.provenance


def test_a_clock_that_stands_twice_is_one_clock(tmp_path: Path) -> None:
    text = "t_ms,w_mm,t_us,f_kN\n0,0,0,0\n1,1,1000,1\n2,2,,\n"
    found = imported(tmp_path / "daq.csv", text, ImportOptions({"w": "w", "f": "f"}))
    np.testing.assert_array_equal(found.channels["f"], [0.0, 1e3, np.nan])


CLOCKS = {
    "called times": ("Time_w,w,Time_f,f", ImportOptions({"w": "w", "f": "f"}), 3),
    "numbered": ("t1,w,t2,f", ImportOptions({"w": "w", "f": "f"}), 3),
    "without heads": ("", ImportOptions({"w": "2", "f": "4"}), 3),
    "behind their readings": ("w [mm],t [ms],f [kN],t [ms]", ImportOptions({"w": "w", "f": "f"}, "2"), 4),
}


@pytest.mark.parametrize("kind", CLOCKS)
def test_a_reading_is_never_put_on_the_clock_of_another(tmp_path: Path, kind: str) -> None:
    """Two channels at 1 and 2 kHz: the second was read at half its speed, without a word."""
    head, options, place = CLOCKS[kind]
    readings = (0.0, 1.5, 3.0, 2.0, 2.5, 0.5, 1.0, 0.7, 0.2, 0.1)
    order = (1, 0, 3, 2) if place == 4 else (0, 1, 2, 3)
    made = [(k, w, 0.5 * k, w + 1.0) for k, w in enumerate(readings)]
    rows = "".join(",".join(str(row[i]) for i in order) + "\n" for row in made)
    units = {} if "[" in head else {"time": "ms", "w": "mm", "f": "kN"}
    with pytest.raises(UserError, match=rf"\(f\) stands (behind|before) a clock of its own, column {place} "):
        imported(tmp_path / "daq.csv", f"{head}\n{rows}", replace(options, units=units))


def test_the_shorter_of_two_records_beside_each_other_comes_in_by_its_clock(tmp_path: Path) -> None:
    text = "t [ms],w [mm],t [ms],f [kN]\n0,0,0,0\n1,1,0.5,1\n2,2,,\n3,3,,\n"
    assert imported(tmp_path / "a.csv", text, ImportOptions({"f": "f"}, "3")).time.tolist() == [0.0, 5e-4]


def test_a_clock_and_a_reading_that_are_both_empty_are_refused(tmp_path: Path) -> None:
    """It ended in a traceback."""
    text = "t [ms],w [mm],t2 [ms],f [kN]\n0,0,,\n1,1,,\n2,2,,\n"
    with pytest.raises(MeasuredError, match=r'its columns "t2", "f" hold no number; choose others: --time'):
        imported(tmp_path / "a.csv", text, ImportOptions({"f": "f"}, "t2"))


def test_an_even_reading_that_has_a_unit_is_no_clock(tmp_path: Path) -> None:
    rows = "".join(f"{k},{0.5 * k},{k * k}\n" for k in range(10))
    found = imported(tmp_path / "daq.csv", f"t [ms],Weg [mm],f [kN]\n{rows}", ImportOptions({"f": "f"}))
    assert found.channels["f"][-1] == 81e3


def test_one_column_is_not_both_clock_and_reading(tmp_path: Path) -> None:
    options = ImportOptions({"w": "w"}, units={"time": "ms", "w": "mm"})
    with pytest.raises(
        UserError, match=r'"w" is taken for the clock and for w; choose the column of the clock: --time'
    ):
        imported(tmp_path / "daq.csv", "w,f\n0,1\n1,2\n", options)


@pytest.mark.parametrize(
    "head", ["Index,Time [s],w [mm]", "Index [1],t [s],w [mm]", "Stage,Zeit [s],w [mm]", "w [mm],Zeit [s]"]
)
def test_the_clock_is_found_behind_another_column(tmp_path: Path, head: str) -> None:
    rows = ("0,0.5,0", "1,0.6,1", "2,0.7,2") if head.count(",") == 2 else ("0,0.5", "1,0.6", "2,0.7")
    found = imported(tmp_path / "dic.csv", "\n".join([head, *rows]), ImportOptions({"w": ""}))
    assert found.time.tolist() == [0.5, 0.6, 0.7]
    assert found.channels["w"].tolist() == [0.0, 1e-3, 2e-3]


def test_a_number_of_the_row_is_not_read_as_milliseconds(tmp_path: Path) -> None:
    options = ImportOptions({"w": "w"}, units={"time": "ms", "w": "mm"})
    found = imported(tmp_path / "a.csv", "Index,Time,w\n0,0.5,0\n1,0.6,1\n2,0.7,2\n", options)
    assert found.time.tolist() == [0.5e-3, 0.6e-3, 0.7e-3]


FRAMES = {
    "whole numbers": ("Frame;w [mm]", ("1", "2", "4")),
    "decimals": ("Frame;w [mm]", ("1.0", "2.0", "4.0")),
    "before the trigger": ("Frame;w [mm]", ("-1", "0", "2")),
    "behind the picture's name": ("File;Frame;w [mm]", ("a.tif;1", "b.tif;2", "c.tif;4")),
}


@pytest.mark.parametrize("kind", FRAMES)
@pytest.mark.parametrize("rate", ["10 kHz", "10000 fps", "10 kS/s", "0.01 MSa/s"])
def test_the_frames_of_a_camera_are_counted_and_a_lost_one_leaves_its_time_out(
    tmp_path: Path, kind: str, rate: str
) -> None:
    """The third frame is lost: by the number of the row all that follows came 0.1 ms too early."""
    head, frames = FRAMES[kind]
    rows = "".join(f"{frame};{k}.5\n" for k, frame in enumerate(frames))
    found = imported(tmp_path / "track.csv", f"{head}\n{rows}", ImportOptions({"w": "w"}, rate=rate))
    assert np.diff(found.time) == pytest.approx([1e-4, 2e-4], rel=1e-12)


@pytest.mark.parametrize("column", ["w", "1", ""])
def test_a_reading_in_whole_numbers_that_rises_does_not_count_samples(tmp_path: Path, column: str) -> None:
    """Samples came 0, 1, 4 and 9 steps after the first."""
    options = ImportOptions({"w": column}, units={"w": "um"}, rate="10 kHz")
    found = imported(tmp_path / "a.csv", "w,u\n0,1\n1,0\n4,2\n9,0\n", options)
    assert found.time == pytest.approx([0.0, 1e-4, 2e-4, 3e-4], rel=1e-12)
    assert found.channels["w"] == pytest.approx([0.0, 1e-6, 4e-6, 9e-6], rel=1e-12)


def test_a_rate_that_contradicts_the_clock_behind_a_number_of_the_row_is_refused(tmp_path: Path) -> None:
    text = "i,t [ms],w [mm]\n5,-1.0,0\n6,-0.9,1\n8,-0.7,2\n"
    with pytest.raises(UserError, match=r'its column "t" spans 0.3 ms and its 3 rows at --rate 0.6 ms'):
        imported(tmp_path / "a.csv", text, ImportOptions({"w": ""}, rate="5 kHz"))
    found = imported(tmp_path / "a.csv", text, ImportOptions({"w": ""}, rate="10 kHz"))
    assert found.time == pytest.approx([-1e-3, -0.9e-3, -0.7e-3], rel=1e-12)


def test_a_clock_that_is_named_is_not_multiplied_by_the_rate(tmp_path: Path) -> None:
    """--time t --rate "10 kHz" took the times for numbers of samples."""
    text = "t [ms],u [V],w [mm]\n0,0.5,0\n0.1,1.5,1\n0.2,0.5,2\n"
    found = imported(tmp_path / "a.csv", text, ImportOptions({"w": "w"}, "t", rate="10 kHz"))
    assert found.time.tolist() == [0.0, 1e-4, 2e-4]
    with pytest.raises(UserError, match=r"--time u: with --rate it counts samples, .*; leave --time out"):
        imported(tmp_path / "a.csv", text, ImportOptions({"w": "w"}, "u", rate="10 kHz"))


def test_a_column_is_read_on_its_own_clock_where_that_is_chosen(tmp_path: Path) -> None:
    text = "t_ms,w_mm,t_ms,f_kN\n0,0,0,0\n1,1,0.5,1\n2,2,1,2\n"
    assert imported(tmp_path / "daq.csv", text, ImportOptions({"f": "f"}, "3")).time.tolist() == [0.0, 5e-4, 1e-3]


def test_the_last_letter_of_a_name_is_not_taken_for_a_unit(tmp_path: Path) -> None:
    """pint knows a year called a and a speed called c; a gauge called a is in neither."""
    options = ImportOptions({"strain_1": "gauge_a"}, units={"strain_1": "um/m"})
    found = imported(tmp_path / "a.csv", "t_ms,gauge_a\n0,0\n1,250\n", options)
    assert found.channels["strain_1"].tolist() == [0.0, 250e-6]


def test_a_byte_of_latin_1_in_the_head_does_no_harm(tmp_path: Path) -> None:
    text = "time (µs);w (µm)\n1;2\n3;4\n"
    found = imported(tmp_path / "old.csv", text, ImportOptions(CENTRE), "latin-1")
    assert found.channels["displacement_centre"].tolist() == [2e-6, 4e-6]


def test_the_clock_can_be_shifted(tmp_path: Path) -> None:
    found = imported(tmp_path / "a.csv", "t_ms,w_mm\n1.2,0\n1.3,1\n", ImportOptions(CENTRE, shift="-1.2 ms"))
    assert found.time == pytest.approx([0.0, 1e-4], abs=1e-18)


def test_what_is_written_is_a_record_that_reads_back_bit_for_bit(tmp_path: Path) -> None:
    found = imported(tmp_path / "a.csv", "t_s,w_in\n0.1,0.25\n0.2,0.31\n", ImportOptions(CENTRE, simulated=True))
    write_measured(tmp_path / "b.csv", found)
    again = read_measured(tmp_path / "b.csv")
    assert again.time.tolist() == found.time.tolist()
    assert again.channels["displacement_centre"].tolist() == [scaled("0.25", "in"), scaled("0.31", "in")]
    assert again.simulated
    assert again.provenance == found.provenance


WRONG = [
    ("0 0\n1 1\n2 x\n3 3\n", ImportOptions(CENTRE, units=MM_MS), r'line 3: "2 x" is not 2 numbers as in line 1'),
    ("0 0\n1 1\n2\n", ImportOptions(CENTRE, units=MM_MS), r'line 3: "2" is not 2 numbers'),
    (
        "0,0\n1,1\n2,n.b.\n",
        ImportOptions(CENTRE, units=MM_MS),
        r'line 3: "2,n.b." is not 2 numbers .*; a gap is an empty',
    ),
    ("0 0\n1 1\n1 2\n", ImportOptions(CENTRE, units=MM_MS), r"line 3: the time 1 does not increase"),
    ("0,0\n,1\n2,2\n", ImportOptions(CENTRE, units=MM_MS), r"line 2: the time is missing"),
    ("0 0\n1 1\n", ImportOptions(CENTRE), r'column "1" has no unit; say which: --time-unit ms'),
    ("0 0\n1 1\n", ImportOptions(CENTRE, units={"time": "ms"}), r"no unit; say which: --unit displacement_centre=mm"),
    ("t_ms,w_mm\n0,0\n1,1\n", ImportOptions(CENTRE, units={"time": "s"}), r'"t" is in ms, and --time-unit says s'),
    ("w_mm,f_kN\n0,0\n1,1\n", ImportOptions({"f": "f"}), r'"w" is no time; choose the clock\'s column: --time NAME'),
    ("t_ms,a_mm,b_mm\n0,0,0\n1,1,1\n", ImportOptions(CENTRE), r'which column is "displacement_centre"\? .*: t, a, b'),
    ("Shot,t_ms,w_mm\n3,0,0\n3,1,1\n", ImportOptions({"w2": ""}, time="t"), r'which column is "w2"\? .*w2="w"; '),
    ("t_ms,a_mm\n0,0\n1,1\n", ImportOptions({"w": "z"}), r'has no column "z"; its columns: t, a'),
    ("t_ms,a_mm\n0,0\n1,1\n", ImportOptions({"w": "a"}, node=3), r"is no nodout: --node has nothing to choose from"),
    (
        "t_ms,w_mm\n0,wait\n1,wait\n2,1\n3,2\n",
        ImportOptions(CENTRE),
        r'line 2: "0,wait" is not 2 numbers, as the rows below it are; a gap is an empty cell',
    ),
    ("t_ms,w_mm,w_mm\n0,0,1\n1,1,1\n", ImportOptions({"w": ""}), r'several columns "w": give a number, of 2 .*, 3'),
    (
        "t_ms,w_mm,t_ms,f_kN\n0,0,0,0\n1,1,0.5,1\n2,2,1,2\n",
        ImportOptions({"w": "2", "f": "4"}, "1"),
        r'column "f" \(f\) stands behind a clock of its own, column 3 "t", .* with --time 3',
    ),
    ("t [kg],a_mm\n0,0\n1,1\n", ImportOptions({"w": "a"}), r'"t" is no time'),
    (
        "400,2\n16,1\nTime [ms],w [mm]\n0,0\n1,1\n2,2\n",
        ImportOptions(CENTRE),
        r'line 3: "Time \[ms\],w \[mm\]" is not 2 numbers .*; where a second table begins, put each into a file of',
    ),
    (
        "Zeit [ms],Weg [mm]\n0,0,500\n1,1,250\n2,0,125\n",
        ImportOptions({"w": "2"}, units={"time": "ms", "w": "mm"}),
        r"line 2: 3 numbers stand below the heads of 2 columns, all of them whole: commas part the columns and mark",
    ),
    ('"' + "x" * 200_000 + "\njust text\n", ImportOptions(CENTRE), "holds no table"),
    (
        "data =\n\n   1.0e+03 *\n\n    0.0001    0.0052\n    0.0002    0.0061\n",
        ImportOptions(CENTRE, units=MM_MS),
        r'line 3: "1.0e\+03 \*" multiplies all numbers below it; write them in full',
    ),
    ("t [V],a_mm\n0,0\n1,1\n", ImportOptions({"w": "a"}), r'"t" is in V, which is no unit of time; .*--time-unit ms'),
    ("just text\nand more\n", ImportOptions(CENTRE), r"no table: no two lines in a row of two or more numbers each"),
    ("t [ms],f [lbs]\n0,0\n1,1\n", ImportOptions({"f": ""}), r'in lbs, a mass, .* --scale f="1 lbf/lbs"'),
    ("t [ms],a [g]\n0,0\n1,1\n", ImportOptions({"w": ""}), r'"a" is in g: .* 9.80665 m/s\^2; .* integrate it twice'),
    ("t [ms],a [m/s^2]\n0,0\n1,1\n", ImportOptions({"w": ""}), r"in m/s\^2, an acceleration; .* integrate it twice"),
    ("t [ms],a [g_n]\n0,0\n1,1\n", ImportOptions({"w": ""}), r"in g_n: of an accelerometer, .* integrate it twice"),
    (
        "t [ms],a [-]\n0,0\n1,1\n",
        ImportOptions({"w": ""}, units={"w": "mm"}),
        r'"a" is a ratio \("-" in its head\), and --unit says mm; .* --scale w=NUMBER',
    ),
    ("t,w_mm\n0,0\n1e-3,1\n", ImportOptions(CENTRE), r'"t" has no unit; say which: --time-unit s,'),
    ("t,w_mm\n0,0\n3000,1\n", ImportOptions(CENTRE), r'"t" has no unit; say which: --time-unit us,'),
    ("t [ms],f [kg]\n0,0\n1,1\n", ImportOptions({"f": ""}), r'in kg, a mass, .* --scale f="1 kgf/kg"'),
    ("t [ms],a [gn]\n0,0\n1,1\n", ImportOptions({"w": ""}, units={"w": "mm"}), r"in gn: of an accelerometer, 9.80665"),
    ("t [ms],a [Mm]\n0,0\n1,1\n", ImportOptions({"w": ""}), r'"a" is in Mm; is "mm" meant\? Correct .* --unit w=mm'),
    ("t [Msec],a [mm]\n0,0\n1,1\n", ImportOptions({"w": ""}), r'"t" is in Msec; is "ms" meant\? .* --time-unit ms'),
    ("t [ms],f [LBF]\n0,0\n1,1\n", ImportOptions({"f": ""}), r'"f" is in LBF; is "lbf" meant\? .* --unit f=lbf'),
    ("t [ms],p [mPa]\n0,0\n1,1\n", ImportOptions({"p": ""}), r'"p" is in mPa; is "MPa" meant\?'),
    ("Time,a,b\nms,mm,KN\n0,0,0\n1,1,1\n", ImportOptions({"f": "b"}), r'"b" is in KN; is "kN" meant\?'),
    ("Time,a,b\nSec,Mm,kN\n0,0,0\n1,1,1\n", ImportOptions({"w": "a"}), r'"a" is in Mm; is "mm" meant\?'),
    ("t [ms],a [G]\n0,0\n1,1\n", ImportOptions({"w": ""}, units={"w": "mm"}), r"in G: of an accelerometer, 9.80665"),
    ("t [ms],a [A]\n0,0\n1,1\n", ImportOptions({"w": ""}), r'"a" is in A, .* --scale w="2.5 mm/A"'),
    ("t [ms],a [Msec]\n0,0\n1,1\n", ImportOptions({"w": ""}), r'"a" is in ms, which no sensor of a case measures'),
    ("t [ms],a [Number]\n0,0\n1,1\n", ImportOptions({"w": ""}), r'"a \[Number\]" has no unit; say which'),
    ("t [MM],a [mm]\n0,0\n1,1\n", ImportOptions({"w": ""}), r'"t" is in MM, which is no unit of time; .* ms'),
    ("t [ms],a x10^-3 [m]\n0,0\n1,1\n", ImportOptions({"w": ""}), r'states a factor, "x10\^-3"; .* --scale w=NUMBER'),
    ("t [ms],a x10-6 [-]\n0,0\n1,1\n", ImportOptions({"w": ""}), r'states a factor, "x10-6"'),
    ("t [ms],a ×10⁻³ [m]\n0,0\n1,1\n", ImportOptions({"w": ""}), r'states a factor, "×10⁻³"'),
    ("t (x1e-3) [s],a [mm]\n0,0\n1,1\n", ImportOptions({"w": ""}), r'"x1e-3"; put into the head the unit of its nu'),
    (
        "Time(s),CH1(mm),t0 = 0 s\n,0,\n,1,\n",
        ImportOptions(CENTRE),
        r'column "Time" of the times is empty; name another, --time COLUMN, or, if the file has no clock, .*--rate',
    ),
    ("t [ms],e [%]\n0,0\n1,0.15%\n2,1%\n", ImportOptions({"e": ""}), r"line 4: .* per cent, and line 2 has no such"),
    ("t [ms],e [%],e_sigma\n0,0,0.1%\n1,1,0.1\n", ImportOptions({"e": "e"}), r"e_sigma. bears a sign of per cent"),
    ("t [ms],e [um/m]\n0,0%\n1,1%\n", ImportOptions({"e": ""}), r"per cent, and its head says um/m; write all"),
    ("t_ms,a_mm\n0,1e400\n1,1\n", ImportOptions(CENTRE), r"1e400.*is not|too large|not a finite"),
]


@pytest.mark.parametrize("head", ["strain [%]", "strain [-]", "strain"])
def test_cells_that_bear_a_sign_of_per_cent_are_in_per_cent(tmp_path: Path, head: str) -> None:
    """Text with the sign was left out; an Excel cell of 0.0015 shown as 0.15% was read as 0.0015 %."""
    found = imported(tmp_path / "a.csv", f"t [ms],{head}\n0,0%\n1,0.15%\n2,-1.5 %\n", ImportOptions({"strain": ""}))
    assert found.channels["strain"].tolist() == pytest.approx([0.0, 0.0015, -0.015], rel=1e-15)


def test_signs_of_per_cent_in_a_column_that_is_not_asked_for_are_no_fault_of_the_file(tmp_path: Path) -> None:
    """A logger's battery refused the file."""
    found = imported(tmp_path / "a.csv", "t [ms],w [mm],Battery\n0,0,85%\n1,5,85\n", ImportOptions({"w": "w"}))
    assert found.channels["w"].tolist() == [0.0, 5e-3]


def test_a_factor_that_a_head_states_is_the_user_s_to_apply(tmp_path: Path) -> None:
    """Readings below "Weg x10^-3 [m]" were taken for metres without a word."""
    for scale, peak in ((1e-3, 5e-3), (1.0, 5.0)):
        options = ImportOptions(CENTRE, scales={"displacement_centre": scale})
        found = imported(tmp_path / "a.csv", "t [ms],Weg x10^-3 [m]\n0,0\n1,5\n", options)
        assert found.channels["displacement_centre"].tolist() == [0.0, peak]
    plain = imported(tmp_path / "a.csv", "t [ms],w_x100_y50 [mm]\n0,0\n1,5\n", ImportOptions(CENTRE))
    assert plain.channels["displacement_centre"].tolist() == [0.0, 5e-3]


@pytest.mark.parametrize(
    "head", ["时间（ms）,位移（mm）", "時間［ms］,変位［mm］", "Время [ms];Прогиб [mm]".replace(";", ",")]
)
def test_names_and_brackets_of_other_scripts(tmp_path: Path, head: str) -> None:
    name = head.partition(",")[2][:-4].strip()
    found = imported(tmp_path / "a.csv", f"{head}\n0,0\n1,5\n", ImportOptions({"displacement_centre": name}))
    assert found.channels["displacement_centre"].tolist() == [0.0, 5e-3]
    bare = f"时间,位移,力\n{ROWS}"
    units = {"time": "ms", "displacement_centre": "mm"}
    found = imported(tmp_path / "b.csv", bare, ImportOptions({"displacement_centre": "位移"}, units=units))
    assert found.channels["displacement_centre"][-1] == pytest.approx(0.11e-3), (
        "its heads were left out: columns 1, 2, 3"
    )


@pytest.mark.parametrize(("text", "options", "why"), WRONG)
def test_what_is_wrong_is_said_with_its_line_and_a_remedy(
    tmp_path: Path, text: str, options: ImportOptions, why: str
) -> None:
    with pytest.raises(UserError, match=why):
        imported(tmp_path / "curve.txt", text, options)


CELLS = {
    "NaN": ("t_ms,w_mm\n0,1\n1,NaN\n2,3\n", [1.0, np.nan, 3.0], '1 cell "NaN", the first in line 3, read as gaps'),
    "overload": (
        "t_ms;w_mm\n0;1\n1;OVL\n2;OVL\n3;2\n",
        [1.0, np.nan, np.nan, 2.0],
        '2 cells "OVL", the first in line 3',
    ),
    "a dash": ("t_ms\tw_mm\n0\t-\n1\t-2\n2\t3\n", [np.nan, -2.0, 3.0], '1 cell "-"'),
    "points for thousands": ("t_ms;w_mm\n0;0,5\n1;1.234,5\n2;1.234.567,25\n", [0.5, 1234.5, 1234567.25], ""),
    "commas for thousands": ("t_ms;w_mm\n0;0.5\n1;1,234.5\n2;1,234\n", [0.5, 1234.5, 1234.0], ""),
    "quoted commas": ('t_ms,w_mm\n0,0.5\n1,"1,234.5"\n2,7\n', [0.5, 1234.5, 7.0], ""),
    "blanks for thousands": ("t_ms;w_mm\n0;0,5\n1;1\u00a0234,5\n2;12 345\n", [0.5, 1234.5, 12345.0], ""),
    "an infinity": ("t_ms;w_mm\n0;1\n1;\u221e\n2;-\u221e\n3;2\n", [1.0, np.nan, np.nan, 2.0], '1 cell "\u221e"'),
    "stars": ("t_ms;w_mm\n0;1\n1;*****\n2;3\n", [1.0, np.nan, 3.0], '1 cell "*****"'),
    "SCPI's not a number": ("t_ms,w_mm\n0,1\n1,9.91E+37\n2,3\n", [1.0, np.nan, 3.0], '1 cell "9.91E+37"'),
    "1E+30 beyond the range": ("t_ms,w_mm\n0,1\n1,1E+30\n2,-1e30\n3,3\n", [1.0, np.nan, np.nan, 3.0], '1 cell "1E+30"'),
    "not a number in C": (
        "t_ms,w_mm\n0,1\n1,-1.#IND\n2,1.#QNAN0\n3,1.#INF00\n4,3\n",
        [1.0, np.nan, np.nan, np.nan, 3.0],
        '1 cell "-1.#IND"',
    ),
    "beyond a limit": ("t_ms,w_mm\n0,1\n1,>4.5\n2,---.---\n3,3\n", [1.0, np.nan, np.nan, 3.0], '1 cell ">4.5"'),
    "a spreadsheet's errors": (
        "t_ms;w_mm\n0;#BEZUG!\n1;1\n2;#DIV/0!\n3;#NAME?\n4;#NV\n5;3\n6;#N/D\n",
        [np.nan, 1.0, np.nan, np.nan, np.nan, 3.0, np.nan],
        '1 cell "#BEZUG!"',
    ),
    "typeset minus": ("t_ms,w_mm\n0,\u22121\n1,\u22122\n2,3\n", [-1.0, -2.0, 3.0], ""),
    "apostrophes for thousands": ("t_ms;w_mm\n0;0.5\n1;1'234.5\n2;7\n", [0.5, 1234.5, 7.0], ""),
}


@pytest.mark.parametrize("kind", CELLS)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_cells_as_loggers_and_spreadsheets_write_them(tmp_path: Path, kind: str, encoding: str) -> None:
    text, values, note = CELLS[kind]
    found = imported(tmp_path / "logger.csv", text, ImportOptions(CENTRE), encoding)
    np.testing.assert_allclose(found.channels["displacement_centre"], 1e-3 * np.array(values), rtol=1e-15)
    assert any(note in line for line in found.provenance)


def test_utf_16_without_its_mark_is_known_by_its_empty_bytes(tmp_path: Path) -> None:
    found = imported(tmp_path / "old.txt", "t_ms\tw_mm\n0\t1\n1\t2\n", ImportOptions(CENTRE), "utf-16-le")
    assert found.channels["displacement_centre"].tolist() == [1e-3, 2e-3]


def test_a_comma_that_may_part_thousands_or_decimals_is_asked_about(tmp_path: Path) -> None:
    text = "t_ms;w_mm\n0;1,234\n1;2,345\n"
    with pytest.raises(UserError, match=r'line 2: "1,234" is 1234 or 1\.234; say which .*: --decimal "\." or'):
        imported(tmp_path / "a.csv", text, ImportOptions(CENTRE))
    for mark, value in ((",", 1.234), (".", 1234.0)):
        found = imported(tmp_path / "a.csv", text, ImportOptions(CENTRE, decimal=mark))
        assert found.channels["displacement_centre"][0] == pytest.approx(1e-3 * value, rel=1e-15)


@pytest.mark.parametrize("name", ["déplacement", "w mid", "time", "1st"])
def test_a_sensor_that_no_record_could_name_is_refused(tmp_path: Path, name: str) -> None:
    """It was written all the same, into a file that cannot be read."""
    with pytest.raises(UserError, match=f"--sensor {name} cannot be a sensor's name: .*displacement_centre=COLUMN"):
        imported(tmp_path / "a.csv", "t_ms;w_mm\n0;1\n1;2\n", ImportOptions({name: "w"}))


def test_a_shift_without_a_unit_is_named(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r'--shift 0\.2: "0\.2" has no unit; .*write --shift "-0\.2 ms"'):
        imported(tmp_path / "a.csv", "t_ms;w_mm\n0;1\n1;2\n", ImportOptions(CENTRE, shift="0.2"))


@pytest.mark.parametrize("head", ["Disp Z_sigma (mm)", "disp z_sigma", "Disp Z_sigma (um)"])
def test_a_column_of_noise_beside_a_sensors_is_read_with_it(tmp_path: Path, head: str) -> None:
    noise = "20" if "um" in head else "0.02"
    text = f"t_ms;Disp Z (mm);{head}\n0;1;{noise}\n1;2;{noise}\n2;;\n"
    options = ImportOptions({"displacement_centre": "Disp Z"}, scales={"displacement_centre": -2.0})
    found = imported(tmp_path / "a.csv", text, options)
    assert list(found.channels) == ["displacement_centre"]
    assert found.sigma["displacement_centre"][:2].tolist() == [scaled("0.04", "mm")] * 2
    assert "Disp Z_sigma" in found.provenance[0] or "disp z_sigma" in found.provenance[0]
    assert not imported(tmp_path / "a.csv", text, replace(options, stated=("displacement_centre",))).sigma


def test_decimal_points_and_commas_in_one_file_are_read_column_by_column(tmp_path: Path) -> None:
    """A clock of 1.010 ms and a force of 1.250 kN beside a deflection with commas are no thousands."""
    text = "t_ms;w_mm;f_kN\n0.990;0,5;0.250\n1.010;1,25;1.250\n"
    sensors = {"displacement_centre": "w", "reaction_force": "f"}
    for decimal in ("", ",", "."):
        found = imported(tmp_path / "a.csv", text, ImportOptions(sensors, decimal=decimal))
        assert found.time.tolist() == [scaled("0.99", "ms"), scaled("1.01", "ms")]
        assert found.channels["displacement_centre"].tolist() == [0.5e-3, 1.25e-3]
        assert found.channels["reaction_force"].tolist() == [250.0, 1250.0]


def test_both_marks_of_decimals_in_one_column_are_refused_where_thousands_may_be_meant(tmp_path: Path) -> None:
    text = "t_ms;w_mm\n0,5;0,5\n0.75;0.75\n1.000;1.25\n"
    with pytest.raises(UserError, match=r'line 4: "1\.000" is 1000 or 1\.000, for the file has decimal points and'):
        imported(tmp_path / "a.csv", text, ImportOptions(CENTRE))
    found = imported(tmp_path / "b.csv", text.replace("1.000", "1.0"), ImportOptions(CENTRE))
    assert found.time[-1] == 1e-3


def test_points_that_may_part_thousands_are_asked_about(tmp_path: Path) -> None:
    """998 beside 1.034: a curve in micrometres that would fall to a thousandth where it passes 999."""
    text = "t_ms;w_um\n0;997\n1;998\n2;1.034\n3;1.220\n"
    with pytest.raises(UserError, match=r'line 4: "1\.034" stands in a column of whole numbers, .*: --decimal ","'):
        imported(tmp_path / "a.csv", text, ImportOptions(CENTRE))
    for mark, value in ((",", 1034.0), (".", 1.034)):
        found = imported(tmp_path / "a.csv", text, ImportOptions(CENTRE, decimal=mark))
        assert found.channels["displacement_centre"][2] == pytest.approx(1e-6 * value, rel=1e-15)
    dropped_zeros = "t_ms;w_mm\n0;1.125\n1;1.5\n2;100\n"
    assert imported(tmp_path / "b.csv", dropped_zeros, ImportOptions(CENTRE)).channels["displacement_centre"][0] == (
        scaled("1.125", "mm")
    )


@pytest.mark.parametrize(
    "stamps",
    [
        ("11:59:59.9999 AM", "12:00:00.0001 PM", "12:00:00.0002 PM"),
        ("23:59:59.9999", "00:00:00.0001", "00:00:00.0002"),
        ("59:59.9999", "00:00.0001", "00:00.0002"),
        ("10:15:30:125100", "10:15:30:125300", "10:15:30:125400"),
        ("2026-11-21 10:00:00.0001", "2026-11-21 10:00:00.0003", "2026-11-21 10:00:00.0004"),
        ("2026-11-21T10:00:00.0001Z", "2026-11-21T10:00:00.0003Z", "2026-11-21T10:00:00.0004Z"),
        ("10:00:00.0001+01:00", "10:00:00.0003+01:00", "10:00:00.0004+01:00"),
    ],
    ids=["AM and PM", "over midnight", "over the hour", "with a colon", "with a date", "in UTC", "with a zone"],
)
def test_a_clock_of_the_day_counts_from_its_first_row(tmp_path: Path, stamps: tuple[str, ...]) -> None:
    rows = "".join(f"{stamp},{i}\n" for i, stamp in enumerate(stamps))
    found = imported(tmp_path / "a.csv", f"Timestamp,w [mm]\n{rows}", ImportOptions(CENTRE))
    np.testing.assert_allclose(found.time, [0.0, 2e-4, 3e-4], atol=1e-15)
    assert any("times of day were read, and count from the first row" in line for line in found.provenance)


@pytest.mark.parametrize(("head", "unit"), [("Time/s\tw/mm", 1e-3), ("t/s\tDMS/%", 1e-2), ("t/s\tF/kN", 1e3)])
def test_a_stroke_parts_name_and_unit_without_blanks(tmp_path: Path, head: str, unit: float) -> None:
    name = head.split("\t")[1].split("/")[0]
    found = imported(tmp_path / "a.txt", f"{head}\n0\t0.5\n1E-3\t1.5\n", ImportOptions({"w": name}))
    assert np.allclose(found.time, [0.0, 1e-3])
    assert np.allclose(found.channels["w"], [0.5 * unit, 1.5 * unit])


def test_a_unit_with_a_stroke_in_it_is_no_name(tmp_path: Path) -> None:
    with pytest.raises(UserError, match='column "m/s" has no unit'):
        imported(tmp_path / "a.txt", "t [s]\tm/s\n0\t0.5\n1\t1.5\n", ImportOptions({"w": "m/s"}))


@pytest.mark.parametrize("pattern", ["hh:mm:ss", "[HH:MM:SS,fff]", "dd.mm.yyyy hh:mm:ss.000"])
def test_a_row_of_units_may_say_how_the_clock_is_written(tmp_path: Path, pattern: str) -> None:
    day = "24.11.2026 " if "yyyy" in pattern else ""
    rows = "".join(f"{day}10:15:30,00{k};{k},5\n" for k in range(5))
    found = imported(tmp_path / "a.csv", f"# Versuch 4\nZeit;Weg\n{pattern};mm\n{rows}", ImportOptions({"w": "Weg"}))
    assert np.allclose(found.time, 1e-3 * np.arange(5))
    assert np.allclose(found.channels["w"], 1e-3 * (np.arange(5) + 0.5))


@pytest.mark.parametrize(
    ("head", "asked"),
    [
        ("Disp Z (mm)", "Disp Z (mm)"),
        ("Disp Z (mm)", "disp z"),
        ("Disp Z / mm", "Disp Z / mm"),
        ("disp_z_mm", "disp_z_mm"),
        ("disp_z_mm", "disp_z"),
    ],
)
def test_a_column_is_named_as_it_stands_in_the_file_or_without_its_unit(tmp_path: Path, head: str, asked: str) -> None:
    options = ImportOptions({"displacement_centre": asked})
    found = imported(tmp_path / "a.csv", f"t_ms,{head},other [mm]\n0,1,5\n1,2,6\n", options)
    assert found.channels["displacement_centre"].tolist() == [1e-3, 2e-3]


@pytest.mark.parametrize(("sensor", "unit"), [("reaction_force", "kN"), ("strain_1", "um/m"), ("pressure", "MPa")])
def test_a_column_whose_unit_is_unknown_has_its_name_and_a_fitting_remedy(
    tmp_path: Path, sensor: str, unit: str
) -> None:
    with pytest.raises(UserError, match=rf'"F \[kp\]" has no unit; say which: --unit {sensor}={unit}'):
        imported(tmp_path / "a.csv", "t_ms,F [kp],G [kp]\n0,1,5\n1,2,6\n", ImportOptions({sensor: "f"}))


@pytest.mark.parametrize("asked", ["CH1 [V]", "ch1"])
def test_volts_are_multiplied_by_what_a_volt_stands_for(tmp_path: Path, asked: str) -> None:
    text = "t_ms,CH1 [V],CH2 [V]\n0,0,5\n1,2,6\n"
    options = {"sensors": {"displacement_centre": asked}, "scales": {"displacement_centre": 2.5}}
    with_unit = ImportOptions(**options, units={"displacement_centre": "mm"})
    assert imported(tmp_path / "a.csv", text, with_unit).channels["displacement_centre"].tolist() == [0.0, 5e-3]
    per = ImportOptions(**options, units={"displacement_centre": "mm"}, per={"displacement_centre": "mV"})
    assert imported(tmp_path / "a.csv", text, per).channels["displacement_centre"].tolist() == [0.0, 5.0]
    with pytest.raises(UserError, match=r'"CH1" is in V, .*--scale displacement_centre="2.5 mm/V"'):
        import_record(tmp_path / "a.csv", ImportOptions({"displacement_centre": asked}))


@pytest.mark.parametrize(
    "unit",
    [
        *("µm/m", "\u03bcm/m", "um/m", "microstrain", "micro strain", "µstrain", "µStrain", "ustrain", "µε", "ppm"),
        *("1e-6", "1E-06", "10^-6", "10-6", "10\u207b\u2076", "x10^-6", "\u00d7 10**-6"),
    ],
)
def test_microstrain_however_it_is_written(tmp_path: Path, unit: str) -> None:
    """Of [1e-6] a factor such as "2000 um/m/1e-6" was asked for: pint takes its e for the charge of an electron."""
    found = imported(tmp_path / "a.csv", f"t [ms],SG1 [{unit}]\n0,0\n1,250\n", ImportOptions({"strain_1": "SG1"}))
    assert found.channels["strain_1"].tolist() == [0.0, 250e-6]
    assert found.units["strain_1"] == ""


def test_per_cent_of_strain_and_millions_of_psi(tmp_path: Path) -> None:
    plain = imported(tmp_path / "b.csv", "t [ms],SG1 [strain]\n0,0\n1,0.0025\n", ImportOptions({"strain_1": "SG1"}))
    assert plain.channels["strain_1"].tolist() == [0.0, 2.5e-3]
    options = ImportOptions({"strain_1": "SG1", "pressure": "P"})
    found = imported(tmp_path / "a.csv", "t [ms],SG1 [%],P [Msi]\n0,0,0\n1,0.25,1\n", options)
    assert found.channels["strain_1"][1] == pytest.approx(2.5e-3, rel=1e-15)
    assert found.channels["pressure"][1] == pytest.approx(6.894757e9, rel=1e-6)


@pytest.mark.parametrize(("unit", "per", "value"), [("mV/V", "mV/V", 4e-3), ("uV/V", "mV/V", 4e-6)])
def test_the_output_of_a_bridge_is_no_strain(tmp_path: Path, unit: str, per: str, value: float) -> None:
    """2 mV/V of a quarter bridge are 4000 um/m; they were read as 2000."""
    text = f"t_ms,SG1 [{unit}]\n0,0\n1,2\n"
    with pytest.raises(UserError, match=rf'"SG1" is in {unit}, .*--scale strain_1="2000 um/m/\({unit}\)"'):
        imported(tmp_path / "a.csv", text, ImportOptions({"strain_1": "SG1"}))
    with pytest.raises(UserError, match="mV/V, which no sensor of a case measures"):
        imported(tmp_path / "a.csv", "t_ms,SG1\n0,0\n1,2\n", ImportOptions({"s": "SG1"}, units={"s": "mV/V"}))
    options = {"scales": {"strain_1": 2000.0}, "units": {"strain_1": "um/m"}, "per": {"strain_1": per}}
    found = imported(tmp_path / "a.csv", text, ImportOptions({"strain_1": "SG1"}, **options))
    assert found.channels["strain_1"].tolist() == pytest.approx([0.0, value], rel=1e-12)


def test_what_no_sensor_measures_is_refused_at_import(tmp_path: Path) -> None:
    with pytest.raises(UserError, match='"LDV" is in m/s, which no sensor of a case measures'):
        imported(tmp_path / "a.csv", "t_ms,LDV [m/s]\n0,0\n1,2\n", ImportOptions(CENTRE))


@pytest.mark.parametrize("scale", [0.0, np.nan, np.inf])
def test_a_scale_that_leaves_nothing_is_refused(tmp_path: Path, scale: float) -> None:
    options = ImportOptions(CENTRE, scales={"displacement_centre": scale})
    with pytest.raises(UserError, match="leaves nothing of the curve; give the factor"):
        imported(tmp_path / "a.csv", "t_ms,w_mm\n0,1\n1,2\n", options)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (ImportOptions({}), r"sensors = \{\}: name at least one"),
        (ImportOptions("w"), "sensors = 'w': name at least one, with its column"),  # pyright: ignore[reportArgumentType]
        (ImportOptions(["w"]), r"sensors = \['w'\]: name at least one"),  # pyright: ignore[reportArgumentType]
        (ImportOptions(CENTRE, units={"centre": "mm"}), "--unit centre: centre is no sensor that is read; named: disp"),
        (ImportOptions(CENTRE, scales={"centre": -1.0}), "--scale centre: centre is no sensor"),
        (ImportOptions(CENTRE, stated=("centre",)), "--sigma centre: centre is no sensor"),
        (ImportOptions(CENTRE, decimal=";"), "--decimal ; is no mark of decimals"),
    ],
)
def test_an_option_that_says_nothing_of_the_file_is_refused(
    tmp_path: Path, options: ImportOptions, message: str
) -> None:
    with pytest.raises(UserError, match=message):
        imported(tmp_path / "a.csv", "t_ms,w_mm\n0,1\n1,2\n", options)


def test_a_picture_is_no_curve(tmp_path: Path) -> None:
    (tmp_path / "plot.png").write_bytes(b"\x89PNG\0\0")
    with pytest.raises(UserError, match="is no text file"):
        import_record(tmp_path / "plot.png", ImportOptions(CENTRE))
