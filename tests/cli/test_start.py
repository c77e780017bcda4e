"""`birdstrike start`: a measured file and answers in, a commented case and a report out; a stand-in for the solver."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from birdstrike.cli.app import app
from birdstrike.cli.import_curve import factor_of
from birdstrike.cli.start import Begun, _imported, begin, cost_lines
from birdstrike.data.curves import Measured, read_measured
from birdstrike.data.errors import UserError
from birdstrike.data.tables import loose_table, text_file
from birdstrike.questions.answers import Answers, read_answers
from birdstrike.questions.clock import duration, shift_to
from birdstrike.questions.shot import Interview
from birdstrike.reports.sections import summary
from birdstrike.solver.case.case import load_case
from tests.reports.synthetic import displacement, simulate, stand_in_for_models, strike

LATE = 0.7e-3
"""s: by this the logger's clock is ahead of the simulation's."""

EFFORT = """
[effort]
particles = 300
elements = [16, 12]
runs = 6
diagnosis = false
"""


@pytest.fixture(autouse=True)
def _here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In a folder of its own, with the stand-in for every simulation and a page of one section."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("birdstrike.solver.simulate.simulate", simulate)
    monkeypatch.setattr("birdstrike.doe.campaign.campaign.process_pool", ThreadPoolExecutor)
    stand_in_for_models(monkeypatch)
    monkeypatch.setattr("birdstrike.reports.page.page.SECTIONS", (summary.section,))
    monkeypatch.setattr("birdstrike.reports.page.page.run_models", lambda results, _: results)


@pytest.fixture
def export(tmp_path: Path) -> Path:
    """A logger's file: semicolons, decimal commas, the laser downwards, a second channel in volts."""
    time = np.arange(-0.4e-3, 2.6e-3, 5e-6)
    laser = -1e3 * displacement(time, 5.5e-3, 2.38e-3) + np.random.default_rng(3).normal(0.0, 0.02, len(time))
    rows = (f"{1e3 * (t + LATE):.3f};{w:.4f};0,1".replace(".", ",") for t, w in zip(time, laser, strict=True))
    path = tmp_path / "Shot 7.csv"
    path.write_text("\n".join(["Zeit [ms];Disp Z (mm);CH2 [V]", *rows]) + "\n")
    return path


def answered(export: Path, more: str = "") -> Path:
    """A file of answers: what has no default, and a coarse model."""
    path = export.with_name("a.toml")
    path.write_text(f'[record]\nfile = "{export.name}"\n[columns."CH2 [V]"]\nkind = "leave"\n{EFFORT}{more}')
    return path


def invoke(*arguments: str | Path, typed: str | None = None) -> Result:
    return CliRunner().invoke(app, ["start", *map(str, arguments)], input=typed, env={"COLUMNS": "200"})


def test_answers_lead_from_the_export_to_the_report(export: Path) -> None:
    found = invoke(
        "--answers", answered(export, '[plate]\nthickness = "9.5 mm"\n[clock]\nuntil = "2.2 ms"\n'), "--workers", "1"
    )
    assert found.exit_code == 0, found.output
    out, said = Path("Shot_7"), found.stdout
    case = load_case(out / "Shot_7.toml")
    assert (case.plate.thickness, case.bird.particles, case.plate.elements) == (9.5e-3, 300, (16, 12))
    text = (out / "Shot_7.toml").read_text()
    assert 'thickness = "9.5 mm"' in text
    assert '# column "Disp Z" of Shot 7.csv' in text
    assert "# from the plate's SURFACE: 90 deg is head-on" in text
    record = read_measured(out / "Shot_7.csv")
    assert record.channels["displacement_centre"].max() == pytest.approx(5.5e-3, rel=0.02), "turned round by itself"
    assert float(record.time[0]) == pytest.approx(-0.4e-3, abs=0.05e-3), "its clock laid over the simulation's"
    assert float(record.time[-1]) <= case.time.end - 0.19e-3, "the simulation outlasts what is used of the record"
    assert said.index("What it will cost") < said.index("Campaign: 6 runs") < said.index("What was found")
    assert "   6 x " in said
    assert "viscosity MU" in said[said.index("What was found") :]
    assert len(said[said.index("What was found") :].splitlines()) <= 24
    assert (out / "loop" / "report.html").is_file()
    assert (out / "setup.png").stat().st_size > 10_000
    assert tomllib.loads((out / "answers.toml").read_text())["plate"]["thickness"] == "9.5 mm"
    again = invoke("--answers", out / "answers.toml", "--workers", "1")
    assert "Nothing was due" not in again.output
    assert again.exit_code == 0, again.output
    assert again.stdout.count(": still valid") == 3, "campaign, inversion and report of the first call"


@pytest.mark.parametrize(
    ("more", "named"),
    [
        ('[plate]\nthickness = "2 m"\n', 'plate.thickness = "2 m" is outside 0.1 mm .. 50 mm'),
        ("[plate]\nthickness = 8\n", 'plate.thickness = 8 has no unit; write "8 mm"'),
        ('[bird]\nshape = "duck"\n', 'bird.shape = "duck" is none of hemispherical_cylinder, cylinder'),
        ('[bird]\nlength = "90 mm"\n', "bird.length = 90 mm is less than the diameter"),
        ('[columns."Disp Z (mm)"]\nat = ["400 mm", "0 mm"]\n', '"400 mm" is off the plate'),
        ('[columns."Disp Z"]\nscale = 0\n', 'columns."Disp Z".scale = 0 leaves nothing of the curve'),
        ('[plate]\nlenght = "1 m"\n', "plate.lenght is no question about this record; did you mean plate.length?"),
        ('[sought]\nviscosity = ["9 Pa s", "1 Pa s"]\n', 'sought.viscosity = ["9 Pa s", "1 Pa s"] must rise'),
        ('[clock]\nsigma = "now"\n', 'clock.sigma = "now"'),
        ('[columns."Disp Z"]\nnoise = "0 mm"\n', 'columns."Disp Z".noise = "0 mm" is no noise: it must be above 0 mm'),
        (
            '[clock]\ncontact = "5 ms"\n',
            'clock.contact = "5 ms" is outside -0.7 ms .. 3.245 ms: Shot 7.csv runs from 0.3 ms to 3.295 ms',
        ),
        ('[clock]\ncontact = "-50 ms"\n', 'clock.contact = "-50 ms" is outside -0.7 ms .. 3.245 ms'),
        ('[clock]\ncontact = "-0.8 ms"\n', "Shot 7.csv runs from 0.3 ms to 3.295 ms, and its response follows first"),
        (
            '[clock]\ncontact = "1 ms"\nuntil = "60 ms"\n',
            'clock.until = "60 ms" is outside 0.05 ms .. 2.3 ms: Shot 7.csv runs from 0.3 ms to 3.295 ms, 2.3 ms after',
        ),
        (
            '[clock]\ncontact = "-0.6 ms"\nuntil = "0.5 ms"\n',
            'clock.until = "0.5 ms" is outside 0.905 ms .. 3.9 ms',
        ),
        ('[clock]\nuntil = "60 ms"\n', "ms after its response begins; write a time in between"),
    ],
)
def test_an_answer_that_cannot_be_is_an_error_that_names_its_key(export: Path, more: str, named: str) -> None:
    found = invoke("--answers", answered(export, more))
    assert found.exit_code == 1, found.output
    assert named in found.stderr
    assert not Path("Shot_7/loop").exists()


def test_all_answers_that_cannot_be_are_named_at_once(export: Path) -> None:
    """One was named a call."""
    path = export.with_name("a.toml")
    path.write_text(
        '[record]\nfile = "Shot 7.csv"\n[columns."CH2"]\nkind = "strain"\nside = "top"\n'
        '[columns."Disp Z"]\nkind = "duck"\nat = ["9 m", "0 mm"]\ndirection = "3 deg"\n'
        '[plate]\nthickness = "2 m"\nlenght = "1 m"\n[bird]\nshape = "duck"\n[effort]\nruns = 2\n'
        '[clock]\ncontact = "5 ms"\n'
    )
    found = invoke("--answers", path)
    assert found.exit_code == 1, found.output
    named = ["thickness", "shape", "runs", "contact", 'columns."Disp Z".kind', "columns.CH2.side", "lenght"]
    named += ["columns.CH2.scale is missing", 'columns."Disp Z".at']
    assert [word for word in named if word not in found.stderr] == []
    assert '"Disp Z".direction' not in found.stderr, "whether that is asked is for the kind to say"
    assert len(found.stderr.strip().splitlines()) == len(named)
    assert not Path("Shot_7").exists()


def test_answers_about_a_file_that_is_none_end_the_interview_with_one_line(export: Path) -> None:
    path = export.with_name("a.toml")
    path.write_text('[record]\nfile = "none.csv"\n[plate]\nlenght = "1 m"\n')
    found = invoke("--answers", path)
    assert found.exit_code == 1
    assert found.stderr.strip().endswith('record.file = "none.csv" is no file here; give its path')


def test_a_column_is_by_default_what_its_unit_or_its_name_says(tmp_path: Path) -> None:
    head = "t [us],laser [in],SG1 [µm/m],contact force [kN],load cell [kN],p1 [MPa],T [degC]"
    rows = [f"{10 * i},{0.001 * i},{i},{i},{i},{i},20" for i in range(40)]
    path = tmp_path / "many.csv"
    path.write_text("\n".join([head, *rows]), encoding="utf-8")
    shot = Interview(Answers({"record": {"file": str(path)}}), factor_of).shot()
    kinds = {name: (column.name, column.sensor["kind"]) for name, column in shot.columns.items()}
    assert kinds == {
        "displacement_centre": ("laser", "displacement"),
        "strain": ("SG1", "strain"),
        "contact_force": ("contact force", "contact_force"),
        "reaction_force": ("load cell", "reaction_force"),
        "pressure": ("p1", "pressure"),
    }
    assert shot.until == "0.7 ms", "0.39 ms of the record, and a little before its response is seen"


def test_a_column_is_by_default_what_its_unit_means(tmp_path: Path) -> None:
    """An accelerometer's was a displacement by default, and a force in KN one in millimetres."""
    head, rows = "t [ms],ACC [gn],LC [KN]\n", "".join(f"{0.1 * i:.1f},{i},{i % 20}\n" for i in range(40))
    (tmp_path / "a.csv").write_text(head + rows)
    shot = Interview(Answers({"record": {"file": "a.csv"}}), factor_of).shot()
    assert {name: column.name for name, column in shot.columns.items()} == {"reaction_force": "LC"}
    assert shot.columns["reaction_force"].unit == "kN"


@pytest.mark.parametrize("code", ["-999", "-9999.25"])
def test_a_code_for_lost_readings_does_not_turn_a_curve_round(tmp_path: Path, code: str) -> None:
    """The largest reading was the code, below zero, and -1 the factor by default."""
    rows = [f"{0.02 * i:.2f},{5.0 * np.sin(max(0.02 * i - 1.0, 0.0)):.4f}" for i in range(200)]
    rows[::7] = [f"{0.02 * i:.2f},{code}" for i in range(0, 200, 7)]
    (tmp_path / "a.csv").write_text("\n".join(["t [ms],w [mm]", *rows]))
    shot = Interview(Answers({"record": {"file": "a.csv"}}), factor_of).shot()
    assert shot.columns["displacement_centre"].scale == "1"


@pytest.mark.parametrize("text", ["w [mm],F [kN]\n" + "0.1,2\n0.2,3\n" * 9, "w\n" + "0.1\n0.2\n" * 9])
def test_a_file_without_a_clock_is_sent_to_import(tmp_path: Path, text: str) -> None:
    (tmp_path / "a.csv").write_text(text)
    with pytest.raises(UserError, match=r"make a record of it by birdstrike import with --rate"):
        Interview(Answers({"record": {"file": "a.csv"}}), factor_of).shot()


def test_a_factor_that_a_head_states_is_asked_about(tmp_path: Path) -> None:
    text = strained("t [ms],Weg x10^-3 [m]\n", 5.0)
    with pytest.raises(UserError, match=r'scale is missing: .*its head states a factor, "x10\^-3"; factor: 1 where'):
        begun(tmp_path, text)
    found = begun(tmp_path, text, columns={"Weg x10^-3": {"scale": 1e-3}})
    assert read_measured(found.record).channels["displacement_centre"].max() == pytest.approx(5e-3, rel=0.01)


def test_the_sheet_with_the_curves_is_asked_for(tmp_path: Path) -> None:
    """A workbook of two sheets was refused with an option that the command does not have."""
    openpyxl = pytest.importorskip("openpyxl")
    workbook = openpyxl.Workbook()
    workbook.active.append(["Shot 12, laser under the centre"])
    for name, peak in (("Shot 12", 5.0), ("Shot 13", 6.0)):
        sheet = workbook.create_sheet(name)
        sheet.append(["t [ms]", "w [mm]"])
        for i in range(200):
            sheet.append([0.02 * i, peak * float(np.sin(max(0.02 * i - 1.0, 0.0)))])
    workbook.save(tmp_path / "a.xlsx")
    record = {"file": "a.xlsx"}
    with pytest.raises(UserError, match=r"record\.table is missing: .* \(Sheet, Shot 12, Shot 13\)"):
        begin(Answers({"record": record}), None, lambda _: None)
    with pytest.raises(UserError, match=r'record\.table = "Sheet" .*holds no table'):
        begin(Answers({"record": record | {"table": "Sheet"}}), None, lambda _: None)
    given = {"record": record | {"table": "Shot 13"}, "clock": {"contact": "1 ms"}}
    found = begin(Answers(given), None, lambda _: None)
    _imported(found, 0.0)
    assert read_measured(found.record).channels["displacement_centre"].max() == pytest.approx(6e-3, rel=1e-3)
    del workbook["Shot 12"]
    workbook.save(tmp_path / "b.xlsx")
    only = begin(Answers({"record": {"file": "b.xlsx"}, "clock": {"contact": "1 ms"}}), None, lambda _: None)
    assert only.shot.table == "Shot 13", "the only one that holds a table"


def test_a_long_export_is_read_once_for_all_questions(export: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A file of 200,000 rows was read seven times before the questions about the plate, for half a minute."""
    read = []
    monkeypatch.setattr(loose_table, "decoded_lines", lambda *a: read.append(a) or text_file.decoded_lines(*a))
    begin(Answers(read_answers(answered(export))), None, lambda _: None)
    assert len(read) == 2, "once for the questions, once as the record"


def test_an_encoding_that_was_guessed_may_be_stated(tmp_path: Path) -> None:
    """Traditional characters in Big5, which is taken for another encoding."""
    rows = "".join(f"{0.02 * i:.2f},{5.0 * np.sin(max(0.02 * i - 1.0, 0.0)):.4f}\n" for i in range(200))
    (tmp_path / "ready.csv").write_text(f"時間(ms),中心位移量(mm)\n{rows}", encoding="big5")
    found = begin(Answers({"record": {"file": "ready.csv", "encoding": "big5"}}), None, lambda _: None)
    assert found.shot.columns["displacement_centre"].name == "中心位移量"
    _imported(found, 0.0)
    assert '"中心位移量"' in " ".join(read_measured(found.record).provenance)
    with pytest.raises(UserError, match=r'record\.encoding = "klingon" .*is no encoding that is known'):
        begin(Answers({"record": {"file": "ready.csv", "encoding": "klingon"}}), None, lambda _: None)


def strained(head: str, reached: float) -> str:
    """A file of a strain that rises to `reached` and falls again."""
    return head + "".join(f"{0.02 * i:.2f},{reached * np.sin(max(0.02 * i - 1.0, 0.0)):.6g}\n" for i in range(200))


@pytest.mark.parametrize("head", ["time [ms],strain [-]\n", "t [ms],strain [-]\n"], ids=["ready", "export"])
def test_microstrain_below_a_head_that_says_none_is_asked_for(tmp_path: Path, head: str) -> None:
    """2000 um/m was read as a strain of 2000."""
    told = r"columns\.strain\.scale is missing: .* a strain of up to 20\d\d .*; factor: 1e-6 if it is microstrain"
    with pytest.raises(UserError, match=told):
        begun(tmp_path, strained(head, 2050.0))
    found = begun(tmp_path, strained(head, 2050.0), columns={"strain": {"scale": 1e-6}})
    assert read_measured(found.record).channels["strain"].max() == pytest.approx(2.05e-3, rel=0.01)
    plain = begun(tmp_path, strained(head, 2.05e-3))
    assert read_measured(plain.record).channels["strain"].max() == pytest.approx(2.05e-3, rel=0.01)


@pytest.mark.parametrize(("reached", "unit"), [(2050.0, "um/m"), (2.05e-3, "m/m")])
def test_a_strain_without_a_unit_is_by_default_what_its_size_says(tmp_path: Path, reached: float, unit: str) -> None:
    found = begun(tmp_path, strained("t [ms],strain\n", reached))
    assert found.shot.columns["strain"].unit == unit
    assert read_measured(found.record).channels["strain"].max() == pytest.approx(2.05e-3, rel=0.01)


@pytest.mark.parametrize(("size", "unit"), [(1e-3, "s"), (1.0, "ms"), (1e3, "us")])
def test_the_unit_of_a_clock_is_by_default_the_one_its_length_says(tmp_path: Path, size: float, unit: str) -> None:
    """Milliseconds were proposed of every clock."""
    rows = "".join(f"{0.02 * i * size:.6g},{5.0 * np.sin(max(0.02 * i - 1.0, 0.0)):.4f}\n" for i in range(200))
    found = begun(tmp_path, f"t,w [mm]\n{rows}")
    assert found.shot.time_unit == unit
    assert read_measured(found.record).time[-1] == pytest.approx(3.98e-3, rel=0.2)


def test_a_number_of_the_row_is_by_default_neither_clock_nor_sensor(tmp_path: Path) -> None:
    path = tmp_path / "dic.csv"
    path.write_text("Index [1],Time [s],Point 1 dZ [mm]\n" + "".join(f"{k},{1e-3 * k},{k % 3}\n" for k in range(9)))
    shot = Interview(Answers({"record": {"file": "dic.csv"}}), factor_of).shot()
    assert shot.time == "Time"
    assert [column.name for column in shot.columns.values()] == ["Point 1 dZ"]


def test_a_column_of_text_or_of_nothing_is_not_asked_about(tmp_path: Path) -> None:
    rows = "".join(f"img_{k}.tif,{1e-3 * k},{k % 3},,\n" for k in range(9))
    (tmp_path / "dic.csv").write_text("x" * 200_000 + "\nFile,Time [s],dZ [mm],F [kN],\n" + rows)
    shot = Interview(Answers({"record": {"file": "dic.csv"}}), factor_of).shot()
    assert [column.name for column in shot.columns.values()] == ["dZ"]


def test_an_answer_that_is_due_is_named(export: Path) -> None:
    path = answered(export)
    path.write_text(path.read_text().replace('kind = "leave"', 'kind = "displacement"'))
    found = invoke("--answers", path)
    assert found.exit_code == 1
    assert 'columns.CH2.scale is missing: Column "CH2": it is in V: factor such as 2.5 mm/V' in found.stderr


def test_a_bad_answer_is_asked_again_with_its_range_and_what_was_answered_is_kept(export: Path) -> None:
    """The first call is left midway; the second asks only what the first has not been told."""
    first = invoke(export, typed="no\n" + 7 * "\n" + "9\n0.6 m\n")  # ends while the plate is asked about
    assert first.exit_code == 1
    assert "the input ended before the last question" in first.stderr
    assert "--answers" in first.stderr
    assert "has no unit" in first.output
    assert "(allowed: 20 mm .. 5000 mm)" in first.output
    kept = tomllib.loads(Path("Shot_7/answers.toml").read_text())
    assert kept["plate"] == {"length": "0.6 m"}
    assert kept["columns"]["Disp Z"]["scale"] == -1, "the default for a curve that points downwards"
    second = invoke(export, typed="\n")
    assert "Answers of Shot_7/answers.toml are taken" in second.stdout
    assert "Plate: length" not in second.stdout
    assert "Plate: width" in second.stdout


def test_answers_that_do_not_go_together_are_asked_again_and_no_at_the_end_computes_nothing(export: Path) -> None:
    begin(Answers(read_answers(answered(export))), None, print)
    answers = Path("Shot_7/answers.toml")
    answers.write_text(answers.read_text().replace('length = "262 mm"', 'length = "90 mm"'))
    found = invoke(export, typed="120 mm\nno\n")
    assert found.exit_code == 1
    assert "bird.length = 90 mm is less than the diameter" in found.stderr
    assert found.stdout.count("Bird: length overall") == 1
    assert "Bird: diameter" not in found.stdout
    assert load_case("Shot_7/Shot_7.toml").bird.length == pytest.approx(0.12)
    assert "Is that your set-up" in found.stdout
    assert "What it will cost" in found.stdout
    assert "change Shot_7/answers.toml and run birdstrike start again" in found.stderr
    assert not Path("Shot_7/loop").exists()


def test_the_cost_on_one_core_is_said_in_the_singular(export: Path) -> None:
    begun = begin(Answers(read_answers(answered(export))), None, print)
    assert "min on 1 idle core with everything else." in [*cost_lines(begun, 1)][-1]
    assert "min on 2 idle cores with everything else." in [*cost_lines(begun, 2)][-1]


def test_what_a_diagnosis_may_add_at_its_fits_is_said_beforehand(export: Path) -> None:
    path = answered(export)
    path.write_text(path.read_text().replace("diagnosis = false", "diagnosis = true"))
    begun = begin(Answers(read_answers(path)), None, print)
    assert "the diagnosis adds 16 to 192 x" in [*cost_lines(begun, 1)][-1]


def test_a_column_of_noise_is_no_sensor(export: Path) -> None:
    head, *rows = export.read_text().splitlines()
    export.write_text("\n".join([f"{head};Disp Z_sigma (mm)", *(f"{row};0,02" for row in rows)]) + "\n")
    begun = begin(Answers(read_answers(answered(export))), None, print)
    assert list(begun.shot.columns) == ["displacement_centre"]


def test_the_records_clock_is_laid_over_the_simulations() -> None:
    """A noisy record of the simulation itself, 0.7 ms late, is moved back to within a few samples."""
    run = strike()
    time = np.arange(-0.4e-3, 2.5e-3, 5e-6)
    seen = run.at("displacement_centre", np.clip(time, 0.0, None))
    noisy = 1.3 * seen + np.random.default_rng(0).normal(0.0, 3e-5, len(time))
    late = Measured(time + LATE, {"displacement_centre": noisy}, {}, {"displacement_centre": "m"})
    assert shift_to(run, late, 2.5e-3) == pytest.approx(-LATE, abs=1.5e-5)


READY = "time [ms],displacement_centre [mm],displacement_centre_sigma [mm]\n" + "".join(
    f"{0.02 * i:.2f},{5.0 * np.sin(max(0.02 * i - 1.0, 0.0)):.4f},0.05\n" for i in range(200)
)
"""A record that is measured-data CSV already, with a column of its noise."""


def begun(tmp_path: Path, text: str, **more: dict[str, object]) -> Begun:
    """An interview about a file that holds `text`, in which first contact is at 1 ms, and the record that follows."""
    (tmp_path / "ready.csv").write_text(text)
    given = {"record": {"file": "ready.csv"}, "clock": {"contact": "1 ms"}}
    found = begin(Answers({**given, **more}), None, lambda _: None)
    _imported(found, 0.0)
    return found


def test_a_record_that_is_said_to_be_simulated_is_called_so_whatever_its_format(tmp_path: Path) -> None:
    assert not read_measured(begun(tmp_path, READY).record).simulated
    said = begun(tmp_path, READY, record={"file": "ready.csv", "simulated": True})
    assert read_measured(said.record).provenance[0] == "SIMULATED, NOT MEASURED."
    again = begun(tmp_path, "# SIMULATED by a formula\n" + READY)
    assert [line for line in read_measured(again.record).provenance if "SIMULATED" in line] == [
        "SIMULATED by a formula"
    ]


@pytest.mark.parametrize("text", [READY, READY.replace("time [ms]", "t [ms]")], ids=["ready", "export"])
def test_a_noise_beside_the_record_s_own_is_refused(tmp_path: Path, text: str) -> None:
    """The case held the stated one, and the record's was used."""
    with pytest.raises(UserError, match=r'centre.noise = "0.5 mm" would not be used: .* "displacement_centre_sigma'):
        begun(tmp_path, text, columns={"displacement_centre": {"noise": "0.5 mm"}})
    found = begun(tmp_path, text, columns={"displacement_centre": {"noise": "record"}})
    assert "noise" not in found.shot.columns["displacement_centre"].sensor
    assert np.allclose(read_measured(found.record).sigma["displacement_centre"], 5e-5)


def test_a_ready_record_that_points_downwards_is_turned_round_or_kept_as_is_answered(tmp_path: Path) -> None:
    """It was neither asked about nor turned, and refused when its campaign was paid for."""
    down = "\n".join(re.sub(",", ",-", line, count=1) for line in READY.splitlines()).replace("],-", "],") + "\n"
    record = read_measured(begun(tmp_path, down).record)
    assert record.channels["displacement_centre"].max() == pytest.approx(5e-3, rel=0.02)
    assert record.sigma["displacement_centre"].min() > 0.0
    assert "displacement_centre was multiplied by -1." in record.provenance
    kept = begun(tmp_path, down, columns={"displacement_centre": {"scale": 1}})
    assert read_measured(kept.record).channels["displacement_centre"].max() <= 0.0
    with pytest.raises(UserError, match=r'scale = "2 mm/V" has a unit, and so has the record\'s column already'):
        begun(tmp_path, down, columns={"displacement_centre": {"scale": "2 mm/V"}})
    with pytest.raises(UserError, match="scale is no question about this record"):
        begun(tmp_path, READY, columns={"displacement_centre": {"scale": -1}})


@pytest.mark.parametrize(
    ("before", "rate", "fault"),
    [
        (25e-3, 2e5, lambda t, _: 0.6e-3 * np.sin(2.0 * np.pi * 50.0 * t)),
        (20e-3, 2e5, lambda t, _: 0.1 * (t - t[0])),
        (3e-3, 2e5, lambda t, rng: rng.normal(0.0, 0.3e-3, len(t))),
        (20e-3, 1e6, lambda t, rng: rng.normal(0.0, 0.3e-3, len(t))),
        (3e-3, 2e5, lambda t, rng: 4e-3 * (rng.random(len(t)) < 0.01)),
        (3e-3, 2e5, lambda t, _: np.full(len(t), 2e-3)),
    ],
    ids=["hum", "drift", "noise", "noise of many points", "spikes", "offset"],
)
def test_a_fault_before_contact_is_not_taken_for_the_response(
    before: float, rate: float, fault: Callable[[np.ndarray, np.random.Generator], np.ndarray]
) -> None:
    """The first reading above a tenth of the peak was the response: the clock was off by up to 25 ms."""
    run, time = strike(), np.arange(-before, 2.5e-3, 1.0 / rate)
    seen = run.at("displacement_centre", np.clip(time, 0.0, None)) + fault(time, np.random.default_rng(2))
    record = Measured(time + LATE, {"displacement_centre": seen}, {}, {"displacement_centre": "m"})
    assert shift_to(run, record, 2.4e-3) == pytest.approx(-LATE, abs=3e-5)
    assert duration(record) == pytest.approx(2.3e-3, abs=0.1e-3)
