"""Curves of another solver that are no whole history: read as they are, or refused with what is wrong with them."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from birdstrike.data.errors import RunFailed
from birdstrike.data.histories import Histories
from birdstrike.doe.external.external import simulate_external
from birdstrike.doe.external.output import read_sensor
from birdstrike.solver.case.case import Case, load_case
from birdstrike.solver.case.external import ColumnsReading, CsvReading
from tests.doe.external_case import CASE

END, STEP = 2.0, 0.02
TIMES = np.arange(101) * STEP
"""[ms]; the case's output interval is 20 us."""
FORCES = 100.0 + 10.0 * np.sin(TIMES)
READINGS = {
    "csv": 'format = "csv"\nfile = "out.csv"\ncolumn = "f"\nunit = "N"\ntime_unit = "ms"',
    "columns": 'format = "columns"\nfile = "out.csv"\nunit = "N"\ntime_unit = "ms"',
}


def case_of(folder: Path, rows: Sequence[tuple[object, object]], form: str) -> Case:
    """A case whose solver writes these rows of time [ms] and contact force [N]."""
    text = "\n".join(["t,f", *(f"{t},{f}" for t, f in rows)]) + "\n"
    program = folder / "writes.py"
    program.write_text(f"open('out.csv', 'w').write({text!r})\nprint('N o r m a l    t e r m i n a t i o n')\n")
    (folder / "strike.k.j2").write_text("deck\n")
    command = f'["{sys.executable}", "-I", "-S", "{program}"]'
    stated = CASE.replace("{COMMAND}", command).replace("{READING}", READINGS[form])
    stated = stated.replace("sensors.displacement_centre]\n", "sensors.contact_force]\n").replace(
        'kind = "displacement"', 'kind = "contact_force"'
    )
    (folder / "case.toml").write_text(stated)
    return load_case(folder / "case.toml")


def read(folder: Path, rows: Sequence[tuple[object, object]], form: str = "csv") -> Histories:
    return simulate_external(case_of(folder, rows, form))


def reason(folder: Path, rows: Sequence[tuple[object, object]], form: str) -> str:
    with pytest.raises(RunFailed) as caught:
        read(folder, rows, form)
    return caught.value.reason


def whole() -> list[tuple[object, object]]:
    return list(zip(TIMES.round(6).tolist(), FORCES.tolist(), strict=True))


def test_a_file_that_ends_an_interval_early_has_its_last_value_there(tmp_path: Path) -> None:
    forces = read(tmp_path, whole()[:-1]).channels["contact_force"]
    assert np.isfinite(forces).all()
    assert forces[-1] == pytest.approx(FORCES[-2])


def test_a_file_that_begins_an_interval_late_has_its_first_value_there(tmp_path: Path) -> None:
    assert read(tmp_path, whole()[1:]).channels["contact_force"][0] == pytest.approx(FORCES[1])


@pytest.mark.parametrize("form", READINGS)
@pytest.mark.parametrize(
    ("rows", "said"),
    [
        (whole()[:51:50], "ends at 1 ms, before time.end = 2 ms by more than time.output_interval = 20 us"),
        (whole()[2:], "begins at 0.04 ms, more than time.output_interval = 20 us after 0"),
        (whole() + [(t, 0.0) for t, _ in whole()[1:]], "the time falls from 2 to 0.02 ms after row 101"),
        (whole()[::-1], "the time falls from 2 to 1.98 ms after row 1 "),
        (whole()[:20] + whole()[26:], "no reading between 0.38 and 0.52 ms, more than 5 times"),
        ([*whole()[:9], (0.18, "nan"), *whole()[10:]], "nan"),
        ([*whole()[:9], (0.18, "-inf"), *whole()[10:]], "-inf"),
        ([*whole()[:9], ("nan", 1.0), *whole()[10:]], "nan"),
        ([*whole()[:9], (0.18, "*****"), *whole()[10:]], "*****"),
    ],
)
def test_what_is_no_whole_history_is_refused(
    tmp_path: Path, rows: Sequence[tuple[object, object]], said: str, form: str
) -> None:
    assert said in reason(tmp_path, rows, form)


def test_an_empty_cell_is_no_number(tmp_path: Path) -> None:
    told = reason(tmp_path, [*whole()[:9], (0.18, ""), *whole()[10:]], "csv")
    assert "1 of 101 rows hold no finite number, the first being row 10 of the data" in told


def test_a_gap_of_five_intervals_and_a_repeated_instant_are_a_history(tmp_path: Path) -> None:
    rows = [*whole()[:20], *whole()[24:]]
    found = read(tmp_path, [row for row in rows for _ in (0, 1)]).channels["contact_force"]
    np.testing.assert_allclose(found[2:-2], FORCES[2:-2], rtol=5e-3)


def test_whole_numbers_with_an_exponent_are_numbers_of_a_column(tmp_path: Path) -> None:
    rows = [(f"{20 * i}e-03", f"{round(force)}E+00") for i, force in enumerate(FORCES)]
    found = read(tmp_path, rows, "columns").channels["contact_force"]
    np.testing.assert_allclose(found, FORCES, atol=0.6)


def written(folder: Path, text: str) -> Path:
    (folder / "out.csv").write_text(text)
    return folder


CSV = CsvReading(format="csv", file="out.csv", column="f", unit="N", time_unit="ms")
COLUMNS = ColumnsReading(format="columns", file="out.csv", unit="N", time_unit="ms")


def test_a_comma_at_the_end_of_each_row_shifts_no_column(tmp_path: Path) -> None:
    time, forces = read_sensor(written(tmp_path, "t,w,f\n0,1,5,\n1,2,6,\n"), CSV)
    np.testing.assert_allclose(time, [0.0, 1e-3])
    np.testing.assert_array_equal(forces, [5.0, 6.0])
    with pytest.raises(RunFailed, match="more cells than its header"):
        read_sensor(written(tmp_path, "t,w,f\n0,1,5,7\n1,2,6,8\n"), CSV)


def test_a_column_that_stands_twice_is_not_read(tmp_path: Path) -> None:
    with pytest.raises(RunFailed, match="2 columns are called f"):
        read_sensor(written(tmp_path, "t, f,t, f\n0,5,0,7\n1,6,1,8\n"), CSV)
    time, forces = read_sensor(written(tmp_path, "t, g,t, f\n0,5,0,7\n1,6,1,8\n"), CSV)  # of times the first counts
    np.testing.assert_allclose([time, forces], [[0.0, 1e-3], [7.0, 8.0]])


@pytest.mark.parametrize(
    ("row", "said"),
    [
        ("0,1 6,5", "line 3 has decimal commas"),
        ("0.1 x", "line 3 begins with a number and holds x"),
        ("1 0,5", "line 3 has decimal commas"),
    ],
)
def test_a_row_that_is_no_row_of_numbers_is_named(tmp_path: Path, row: str, said: str) -> None:
    with pytest.raises(RunFailed, match=said):
        read_sensor(written(tmp_path, f"time force\n0 5\n{row}\n2 7\n"), COLUMNS)


def test_titles_between_rows_commas_and_fortran_s_short_exponents_are_read(tmp_path: Path) -> None:
    text = "1 st run\n0, 5\npage 2\n1.0-1,  6.0+1\n0.2,7.0 9\n"
    time, forces = read_sensor(written(tmp_path, text), COLUMNS)
    np.testing.assert_allclose(time, [0.0, 1e-4, 2e-4])
    np.testing.assert_allclose(forces, [5.0, 60.0, 7.0])


def test_the_mark_of_utf_8_before_the_first_row_does_not_take_it(tmp_path: Path) -> None:
    time, forces = read_sensor(written(tmp_path, "\ufeff0 5\n1 6\n2 7\n"), COLUMNS)
    np.testing.assert_allclose([time, forces], [[0.0, 1e-3, 2e-3], [5.0, 6.0, 7.0]])
