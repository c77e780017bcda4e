"""Measured-data CSV: what it promises of gaps, units, noise and every kind of bad cell."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from birdstrike.data.curves import Measured, only_channels, read_measured, write_measured
from birdstrike.data.errors import MeasuredError

GOOD = """# Gauge 3 of the door panel, shot 12
time [ms],displacement_centre [mm],displacement_centre_sigma [mm],contact_force [kN]
-0.1,0.01,0.03,
0.0,,,0.5
0.25,1.5,0.03,12
"""


def written(folder: Path, text: str, encoding: str = "utf-8") -> Path:
    path = folder / "shot.csv"
    path.write_bytes(text.encode(encoding))
    return path


def errors_of(folder: Path, text: str) -> list[str]:
    with pytest.raises(MeasuredError) as caught:
        read_measured(written(folder, text))
    return [error.removeprefix(f"{folder / 'shot.csv'}, ") for error in caught.value.errors]


def test_a_record_reads_in_si_with_its_gaps(tmp_path: Path) -> None:
    measured = read_measured(written(tmp_path, GOOD))
    assert measured.time.tolist() == [-1e-4, 0.0, 2.5e-4]
    assert measured.units == {"displacement_centre": "m", "contact_force": "N"}
    np.testing.assert_array_equal(measured.channels["displacement_centre"], [1e-5, np.nan, 1.5e-3])
    np.testing.assert_array_equal(measured.channels["contact_force"], [np.nan, 500.0, 12e3])
    np.testing.assert_array_equal(measured.sigma["displacement_centre"], [3e-5, np.nan, 3e-5])
    assert measured.provenance == ("Gauge 3 of the door panel, shot 12",)
    assert not measured.simulated
    times, values = measured.points("displacement_centre")
    assert times.tolist() == [-1e-4, 2.5e-4]
    assert values.tolist() == [1e-5, 1.5e-3]


def test_a_byte_order_mark_and_windows_line_ends_change_nothing(tmp_path: Path) -> None:
    plain = read_measured(written(tmp_path, GOOD))
    foreign = read_measured(written(tmp_path, GOOD.replace("\n", "\r\n"), "utf-8-sig"))
    np.testing.assert_array_equal(plain.channels["contact_force"], foreign.channels["contact_force"])
    assert plain.provenance == foreign.provenance


@pytest.mark.parametrize("cell", ["nan", "NaN", "inf", "-inf", "1x", "0x10", "1e999"])
def test_what_is_no_finite_number_is_an_error_with_its_line(tmp_path: Path, cell: str) -> None:
    error, *hint = errors_of(tmp_path, f"# note\ntime [ms],w [mm]\n0,0\n\n1,{cell}\n2,3\n")
    assert all("birdstrike import" in line for line in hint)
    assert hint or cell in ("1x", "0x10")  # what a logger writes where it has no reading
    assert error.startswith(f'line 5: w = "{cell}"')
    assert "leave the cell empty" in error


def test_all_bad_cells_are_listed_in_the_order_of_lines(tmp_path: Path) -> None:
    found = errors_of(tmp_path, "time [ms],w [mm],f [N]\n0,a,1\nb,2,c\n")
    assert [error.split(" = ")[0] for error in found] == ["line 2: w", "line 3: time", "line 3: f"]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("time [ms],w [mm]\n1,0\n1,2\n", "line 3: the time 1 does not increase"),
        (
            "time [ms],w [mm]\n0,0\n1,1\n1,1\n2,2\n",
            "line 4: the time 1 does not increase: it stands in line 3 too, with the same values; leave one out",
        ),
        (
            "time [ms],w [mm]\n0,0\n1,1\n1,2\n2,2\n",
            "line 4: the time 1 does not increase: it stands in line 3 too, with other values; keep one for each",
        ),
        (
            "time [ms],w [mm]\n" + "".join(2 * f"{i},{i}\n" for i in range(9)),
            "line 3: the time 0 does not increase: the row stands in line 2 too, as do 9 rows with all their values",
        ),
        (
            "time [ms],w [mm]\n" + 2 * "0,0\n1,1\n2,2\n",
            "line 5: the time 0 does not increase: the clock begins again, with the same values as at",
        ),
        (
            "time [ms],w [mm]\n0,0\n1,1\n2,2\n0,0\n1,3\n",
            "line 5: the time 0 does not increase: the clock begins again, with other values than at",
        ),
        (
            "time [ms],w [mm]\n" + "".join(f"{9 - i},{i}\n" for i in range(9)),
            "line 3: the time 8 does not increase, nor does that of any row: the file runs backwards; sort its rows",
        ),
        ("time [ms],w [mm]\n0,0\n2,1\n1,2\n", "line 4: the time 1 does not increase; sort the rows"),
        ("time [ms],w [mm]\n1,0\n,2\n3,1\n", "line 3: the time is missing"),
        ("time [ms],w\n0,1\n1,2\n", 'line 1: "w" needs a name and a unit'),
        ("time,w [mm]\n0,1\n1,2\n", 'line 1: "time" needs a name and a unit'),
        ("time [mm],w [mm]\n0,1\n1,2\n", 'line 1: the first column is "time [mm]"'),
        ("w [mm],time [ms]\n0,1\n1,2\n", 'line 1: the first column is "w [mm]"'),
        ("time [ms],w [parsnip]\n0,1\n1,2\n", 'line 1: "w [parsnip]": "parsnip" is not a unit'),
        ("time [ms],w [mm],w [mm]\n0,1,1\n1,2,2\n", 'line 1: "w" stands twice'),
        ("time [ms],w [mm]\n0,1\n1,2,3\n", "line 3: 3 cells where the header has 2"),
        ("time [ms];w [mm]\n0;1\n", "line 1: one column only; columns are separated by commas"),
        ("time [ms],w [mm]\n0,1\n", "line 1: 1 rows follow; a record needs at least 2"),
        ("time [ms],w [mm],f [N]\n0,1,\n1,2,3\n", 'line 1: "f [N]" has fewer than 2 values'),
        ("time [ms],w [mm],w_sigma [N]\n0,1,1\n1,2,1\n", 'line 1: "w_sigma [N]" is not in a unit of "w [mm]"'),
        ("time [ms],w [mm],f_sigma [N]\n0,1,1\n1,2,1\n", 'line 1: "f_sigma [N]" has no column "f"'),
        ("time [ms],w [mm],w_sigma [mm]\n0,1,0\n1,2,1\n", "line 2: w_sigma must be greater than 0"),
        ("time [ms],w [mm],w_sigma [mm]\n0,1,1\n1,2,1\n2,3,\n", "line 4: w has a value here and w_sigma has none"),
    ],
)
def test_a_malformed_record_is_refused_by_line(tmp_path: Path, text: str, expected: str) -> None:
    assert any(error.startswith(expected) for error in errors_of(tmp_path, text))


def test_files_without_a_table_are_refused(tmp_path: Path) -> None:
    with pytest.raises(MeasuredError, match="holds no table; a header is such as "):
        read_measured(written(tmp_path, "# only a note\n"))
    with pytest.raises(MeasuredError, match="cannot be read"):
        read_measured(tmp_path / "absent.csv")
    with pytest.raises(MeasuredError, match="UTF-8"):
        read_measured(written(tmp_path, GOOD + "µ", "latin-1"))


finite = st.floats(allow_nan=False, allow_infinity=False, min_value=-1e12, max_value=1e12)
cells = st.one_of(finite, st.just(np.nan))


@settings(max_examples=50, deadline=None)
@given(
    time=st.lists(st.floats(min_value=-1.0, max_value=1.0), min_size=3, max_size=8, unique=True).map(sorted),
    data=st.data(),
)
def test_writing_and_reading_a_record_changes_no_bit(time: list[float], data: st.DataObject, tmp_path_factory) -> None:
    n = len(time)
    values = np.array(data.draw(st.lists(cells, min_size=n, max_size=n)))
    values[:2] = data.draw(st.lists(finite, min_size=2, max_size=2))
    sigma = np.array(data.draw(st.lists(st.floats(min_value=1e-9, max_value=1e3), min_size=n, max_size=n)))
    record = Measured(np.array(time), {"w": values}, {"w": sigma}, {"w": "m"}, ("made up, not measured",))
    path = tmp_path_factory.mktemp("record") / "record.csv"
    write_measured(path, record)
    again = read_measured(path)
    np.testing.assert_array_equal(again.time, record.time)
    np.testing.assert_array_equal(again.channels["w"], values)
    np.testing.assert_array_equal(again.sigma["w"], sigma)
    assert again.provenance == record.provenance


def test_a_dead_sensor_is_told(tmp_path: Path) -> None:
    path = tmp_path / "dead.csv"
    path.write_text("time [ms],displacement_centre [mm]\n0,0\n1,0\n2,0\n")
    with pytest.raises(MeasuredError, match="is zero everywhere: a dead sensor"):
        read_measured(path).refuse_dead_sensors()
    path.write_text("time [ms],strain_back [um/m]\n0,12340\n1,12340\n2,12340\n")
    with pytest.raises(MeasuredError, match="reads 12340 µm/m everywhere"):
        read_measured(path).refuse_dead_sensors()


def test_each_of_several_records_keeps_those_of_the_channels_that_it_has() -> None:
    """A laser that one shot of a series lacks kept every other channel of that shot from being left out."""
    time = np.array([0.0, 1e-3, 2e-3])

    def record(name: str, *channels: str) -> Measured:
        return Measured(time, dict.fromkeys(channels, time), {}, dict.fromkeys(channels, "m"), (), f"{name}.csv")

    both, single = record("both", "laser", "centre", "gauge"), record("single", "centre", "gauge")
    kept = only_channels([both, single], ("laser", "centre"))
    assert [list(one.channels) for one in kept] == [["laser", "centre"], ["centre"]]
    assert only_channels([both, single], ()) == [both, single]
    with pytest.raises(MeasuredError, match='no record has a channel "lazer"; their channels: laser, centre, gauge'):
        only_channels([both, single], ("lazer", "centre"))
    with pytest.raises(MeasuredError, match=r"single\.csv has none of laser; .* or leave the record out"):
        only_channels([both, single], ("laser",))
    with pytest.raises(MeasuredError, match=r'single\.csv has no channel "laser"'):
        only_channels([single], ("laser",))
