"""histories.csv: its columns, its precision, and the same bytes for the same curves."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from birdstrike.data.curves import read_histories, split_unit, write_histories
from birdstrike.data.histories import Histories


def curves() -> Histories:
    time = 5e-6 * np.arange(50.0)
    wave, ramp = np.sin(time * 3e4), -1e4 * time / time[-1]
    channels = {"displacement_centre": 5e-3 * wave, "contact_force": ramp, "ratio": time}
    return Histories(time, channels, {"displacement_centre": "m", "contact_force": "N", "ratio": ""}, {"steps": 3})


def test_columns_carry_the_si_unit(tmp_path: Path) -> None:
    write_histories(tmp_path / "h.csv", curves())
    header = (tmp_path / "h.csv").read_text().splitlines()[0]
    assert header == "time_s,displacement_centre_m,contact_force_N,ratio"


def test_histories_read_back_to_ten_digits(tmp_path: Path) -> None:
    write_histories(tmp_path / "h.csv", curves())
    again = read_histories(tmp_path / "h.csv")
    assert again.units == curves().units
    np.testing.assert_allclose(again.time, curves().time, rtol=1e-9)
    for name, values in curves().channels.items():
        np.testing.assert_allclose(again.channels[name], values, rtol=1e-9, atol=1e-300)


def test_writing_twice_gives_identical_bytes(tmp_path: Path) -> None:
    write_histories(tmp_path / "a.csv", curves())
    write_histories(tmp_path / "b.csv", curves())
    assert (tmp_path / "a.csv").read_bytes() == (tmp_path / "b.csv").read_bytes()
    write_histories(tmp_path / "c.csv", read_histories(tmp_path / "a.csv"))
    assert (tmp_path / "a.csv").read_bytes() == (tmp_path / "c.csv").read_bytes()


def test_lines_end_as_on_unix_and_minus_zero_is_zero(tmp_path: Path) -> None:
    write_histories(tmp_path / "h.csv", curves())
    content = (tmp_path / "h.csv").read_bytes()
    assert b"\r" not in content
    assert b"-0.000000000e+00" not in content


def test_a_unit_is_split_off_the_name_only_where_there_is_one() -> None:
    assert split_unit("contact_force_N") == ("contact_force", "N")
    assert split_unit("displacement_centre") == ("displacement_centre", "")
    assert split_unit("m") == ("m", "")
