"""Histories that LS-DYNA and Radioss write come in as the numbers that were put into them."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path
from types import ModuleType
from typing import Any, ClassVar

import numpy as np
import pytest
from typer.testing import CliRunner

from birdstrike.cli.app import app
from birdstrike.data.curves import read_measured
from birdstrike.data.decks.results import read_deck_results
from birdstrike.data.decks.sensors import DeckSensor, DeckSensors
from birdstrike.data.errors import MeasuredError
from tests.data.exports.radioss_t01_writer import write_t01

TIME = 5e-3 * np.arange(81)  # ms
WAVE = -4.0 * np.sin(np.pi * TIME / 0.4)  # mm, towards -z
FORCE = 30.0 * np.sin(np.pi * TIME / 0.4) ** 2  # kN
IMPULSE = np.concatenate([[0.0], np.cumsum(0.5 * (FORCE[1:] + FORCE[:-1]) * np.diff(TIME))])
DOWN = (0.0, 0.0, -1.0)


def deck(code: str, kind: str = "displacement", numbers: tuple[int, ...] = (7, 9)) -> DeckSensors:
    unit = "m" if kind == "displacement" else "N"
    weights = (0.25, 0.75) if kind == "displacement" else (1.0,) * len(numbers)
    return DeckSensors(code, "mm-ms-kg-GPa", {"sensor": DeckSensor(kind, unit, numbers, weights, DOWN)})


def time_history(path: Path, version: int = 4021) -> Path:
    """Nodes 7 and 9 move as WAVE and twice as far; contact 1 has the impulse in z, a third of it tangential."""
    zero = np.zeros_like(TIME)
    nodes = np.column_stack([zero, zero, WAVE, zero, zero, 2.0 * WAVE])
    contact = np.column_stack([zero, zero, -2.0 / 3.0 * IMPULSE, zero, zero, -1.0 / 3.0 * IMPULSE])
    groups = [
        (("contact of the bird", {1: ""}, (1, 2, 3, 4, 5, 6)), contact),
        (("displacement sensors", {7: "a", 9: "a+b"}, (1, 2, 3)), nodes),
    ]
    write_t01(path, TIME, np.tile(np.arange(12.0), (len(TIME), 1)), groups, version)
    return path


@pytest.mark.parametrize("version", [3040, 3051, 4021])
def test_time_history_of_radioss_by_its_bytes(version: int, tmp_path: Path) -> None:
    path = time_history(tmp_path / "strikeT01", version)
    found, missing = read_deck_results([path], deck("radioss"))
    assert not missing
    np.testing.assert_allclose(found.time, 1e-3 * TIME, atol=1e-10)
    np.testing.assert_allclose(found.channels["sensor"], -1e-3 * 1.75 * WAVE, atol=1e-9)
    force, _ = read_deck_results([path], deck("radioss", "contact_force", (1,)))
    assert np.trapezoid(force.channels["sensor"], force.time) == pytest.approx(IMPULSE[-1], rel=1e-3)
    np.testing.assert_allclose(force.channels["sensor"][2:-2], 1e3 * FORCE[2:-2], rtol=0.01, atol=60.0)


def test_import_takes_a_column_of_a_time_history(tmp_path: Path) -> None:
    path, out = time_history(tmp_path / "strikeT01"), tmp_path / "record.csv"
    column = "sensor=displacement sensors 7 a DZ"
    options = ("--sensor", column, "--unit", "mm", "--time-unit", "ms", "--scale", "-1", "--out", str(out))
    found = CliRunner().invoke(app, ["import", str(path), *options, "--simulated"])
    assert found.exit_code == 0, found.output
    record = read_measured(out)
    assert record.simulated
    np.testing.assert_allclose(record.channels["sensor"], -1e-3 * WAVE, atol=1e-9)


def test_names_of_variables_are_those_of_the_titles(tmp_path: Path) -> None:
    from birdstrike.data.exports.radioss_t01 import columns_of

    path = tmp_path / "otherT01"
    zero = np.zeros_like(TIME)
    group = (("my nodes", {3: "tip"}, (44, 45)), np.column_stack([zero, WAVE]))
    write_t01(path, TIME, np.zeros((len(TIME), 12)), [group])
    assert [column.name for column in columns_of(path)][-2:] == ["my nodes 3 tip var44", "my nodes 3 tip var45"]
    path.with_name("otherT01_TITLES").write_text("         0 VX        \n         0 VZ        \n")
    assert [column.name for column in columns_of(path)][-2:] == ["my nodes 3 tip VX", "my nodes 3 tip VZ"]


def test_a_time_history_that_is_cut_short_keeps_its_whole_instants(tmp_path: Path) -> None:
    path = time_history(tmp_path / "strikeT01")
    whole = path.read_bytes()
    path.write_bytes(whole[:-30])
    found, _ = read_deck_results([path], deck("radioss"))
    assert len(found.time) == len(TIME) - 1
    path.write_bytes(b"no time history at all, but text that goes on and on")
    with pytest.raises(MeasuredError, match="is no time history of Radioss, or was cut short: read it with th_to_csv"):
        read_deck_results([path], deck("radioss"))


def test_csv_of_th_to_csv(tmp_path: Path) -> None:
    path = tmp_path / "strikeT01.csv"
    pad = "displacement sensors".ljust(100)
    heads = ["time", "INTERNAL ENERGY", *(f"{pad} {n} {'a'.ljust(100)}  DZ        " for n in (7, 9))]
    rows = [f"{t:.6f},{0.0:f},{w:f},{2.0 * w:f}" for t, w in zip(TIME, WAVE, strict=True)]
    path.write_text("\n".join([",".join(f'"{head}"' for head in heads), *rows]) + "\n")
    found, _ = read_deck_results([path], deck("radioss"))
    np.testing.assert_allclose(found.channels["sensor"], -1e-3 * 1.75 * WAVE, atol=1e-9)


def rcforc() -> str:
    lines = ["LS-DYNA", " {BEGIN LEGEND", " Entity #        Title", " {END LEGEND}", ""]
    for t, f in zip(TIME, FORCE, strict=True):
        for side, sign in (("slave ", 1.0), ("master", -1.0)):
            lines.append(
                f"  {side}        1  time {t:12.5E}  x {0.0:12.5E}  y {0.0:12.5E}  z {sign * f:12.5E} mass  0.00000E+00"
            )
    return "\n".join(lines) + "\n"


def test_rcforc_is_the_force_on_the_target_positive_in_the_push(tmp_path: Path) -> None:
    path = tmp_path / "rcforc"
    path.write_text(rcforc())
    found, missing = read_deck_results([path], deck("lsdyna", "contact_force", (1,)))
    assert not missing
    np.testing.assert_allclose(found.channels["sensor"], 1e3 * FORCE, rtol=1e-4, atol=1e-6)
    out = tmp_path / "record.csv"
    options = ("--sensor", "contact_force=z-force slave 1", "--unit", "kN", "--time-unit", "ms", "--out", str(out))
    answer = CliRunner().invoke(app, ["import", str(path), *options, "--simulated"])
    assert answer.exit_code == 0, answer.output
    np.testing.assert_allclose(read_measured(out).channels["contact_force"], 1e3 * FORCE, rtol=1e-4, atol=1e-6)


BOTH = DeckSensors(
    "lsdyna",
    "mm-ms-kg-GPa",
    {
        "moves": DeckSensor("displacement", "m", (7, 9), (0.25, 0.75), DOWN),
        "pushes": DeckSensor("contact_force", "N", (1,), (1.0,), DOWN),
    },
)


def check_both(file: Path) -> None:
    found, missing = read_deck_results([file], BOTH)
    np.testing.assert_allclose(found.channels["moves"], -1.75e-3 * WAVE, atol=1e-8)
    np.testing.assert_allclose(found.channels["pushes"], 1e3 * np.gradient(IMPULSE, TIME), atol=2.0)
    assert not missing


def test_openradioss_ran_the_deck_of_lsdyna_itself(tmp_path: Path) -> None:
    """Its groups: the keyword's name with displacements, velocities and more, and TH-INTER with energies at the end."""
    zero = np.zeros_like(TIME)
    node = [np.column_stack([zero, zero, scale * WAVE, zero, zero, zero + 5.0]) for scale in (1.0, 2.0)]
    contact = np.column_stack([zero, zero, -2.0 / 3.0 * IMPULSE, zero, zero, -1.0 / 3.0 * IMPULSE, zero + 3.0])
    groups = [
        (("DATABASE_HISTORY_NODE", {7: "", 9: ""}, (1, 2, 3, 4, 5, 6)), np.column_stack(node)),
        (("TH-INTER", {1: "bird"}, (1, 2, 3, 4, 5, 6, 20)), contact),
    ]
    write_t01(tmp_path / "strikeT01", TIME, np.tile(np.arange(12.0), (len(TIME), 1)), groups, 4021)
    check_both(tmp_path / "strikeT01")


def test_csv_without_names_of_variables(tmp_path: Path) -> None:
    """What th_to_csv writes of it: numbers of columns, and impulses as they stand in the binary file."""
    names = [f"DATABASE_HISTORY_NODE      {node}       " for node in (7, 9) for _ in range(4)]
    names += ["TH-INTER      1      bird  "] * 7
    head = ",".join(f'"{name} var {i}"' for i, name in enumerate(names, 13))
    rows = "".join(
        f"{t:.6f},0.0,0.0,{w:.9f},1.0,0.0,0.0,{2.0 * w:.9f},1.0,0.0,0.0,{-p:.9f},0.0,0.0,0.0,9.0\n"
        for t, w, p in zip(TIME, WAVE, IMPULSE, strict=True)
    )
    (tmp_path / "strikeT01.csv").write_text(f'"time",{head}\n{rows}')
    check_both(tmp_path / "strikeT01.csv")


def test_files_without_any_sensor_are_an_error_that_says_what_to_look_for(tmp_path: Path) -> None:
    path = time_history(tmp_path / "strikeT01")
    with pytest.raises(MeasuredError, match="no output of a sensor of 1 is there; are they of this deck, radioss"):
        read_deck_results([path], deck("radioss", numbers=(1, 2)))


def binout(folder: Path, sides: tuple[int, ...] | None) -> Path:
    """The branch rcforc of a binout as LS-DYNA writes it: a column for each side of contact 1."""
    pytest.importorskip("lasso.dyna.binout")
    lsda = importlib.import_module("lasso.dyna.lsda_py3").Lsda
    path = folder / "binout0000"
    file = lsda(str(path), "w")
    file.cd("/rcforc", 1)
    file.cd("/rcforc/metadata", 1)
    file.write("ids", lsda.I4, [1, 1])
    if sides is not None:
        file.write("side", lsda.I4, list(sides))
    for i, (t, f) in enumerate(zip(TIME, FORCE, strict=True)):
        file.cd(f"/rcforc/d{i + 1:06d}", 1)
        file.write("time", lsda.R8, [t])
        for axis, values in zip("xyz", ([0.0, 0.0], [0.0, 0.0], [f, -f]), strict=True):
            file.write(f"{axis}_force", lsda.R8, values)
    file.close()
    return path


def test_the_two_sides_of_a_contact_in_a_binout_do_not_cancel(tmp_path: Path) -> None:
    path = binout(tmp_path, (0, 1))
    found, missing = read_deck_results([path], deck("lsdyna", "contact_force", (1,)))
    assert not missing
    np.testing.assert_allclose(found.channels["sensor"], 1e3 * FORCE, atol=1e-6)
    out = tmp_path / "record.csv"
    column = "contact_force=z_force slave 1"
    options = ("--table", "rcforc", "--sensor", column, "--unit", "kN", "--time-unit", "ms", "--out", str(out))
    answer = CliRunner().invoke(app, ["import", str(path), *options])
    assert answer.exit_code == 0, answer.output
    np.testing.assert_allclose(read_measured(out).channels["contact_force"], 1e3 * FORCE, atol=1e-6)


class StoredBinout:
    """Stands in for lasso-python's reader, where that is not installed: two sides of contact 1."""

    content: ClassVar = {
        "ids": np.array([1, 1]),
        "side": np.array([0, 1]),
        "time": TIME,
        **{f"{a}_force": np.zeros((len(TIME), 2)) for a in "xy"},
        "z_force": np.column_stack([FORCE, -FORCE]),
    }

    def __init__(self, path: str) -> None:
        self.path = path

    def read(self, *place: str) -> Any:
        if not place:
            return ["rcforc"]
        return list(self.content) if len(place) == 1 else self.content[place[1]]


def stand_in(monkeypatch: pytest.MonkeyPatch, reader: type[StoredBinout]) -> None:
    """The reader in the place of lasso-python's."""
    module = ModuleType("lasso.dyna.binout")
    module.__dict__["Binout"] = reader
    for name in ("lasso", "lasso.dyna"):
        monkeypatch.setitem(sys.modules, name, ModuleType(name))
    monkeypatch.setitem(sys.modules, module.__name__, module)
    monkeypatch.delitem(sys.modules, "birdstrike.data.exports.binout", raising=False)


def test_the_two_sides_of_a_contact_are_told_apart_without_the_library(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stand_in(monkeypatch, StoredBinout)
    (tmp_path / "binout0000").write_bytes(b"")
    found, missing = read_deck_results([tmp_path / "binout0000"], deck("lsdyna", "contact_force", (1,)))
    monkeypatch.delitem(sys.modules, "birdstrike.data.exports.binout")
    assert not missing
    np.testing.assert_allclose(found.channels["sensor"], 1e3 * FORCE, atol=1e-6)


class OneName(StoredBinout):
    """Two columns of contact 1, of which no side is stated."""

    content: ClassVar = {name: value for name, value in StoredBinout.content.items() if name != "side"}


def test_columns_of_one_name_are_refused_not_added(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    stand_in(monkeypatch, OneName)
    (tmp_path / "binout0000").write_bytes(b"")
    with pytest.raises(MeasuredError, match=r'two columns are called "[xyz]_force 1"'):
        read_deck_results([tmp_path / "binout0000"], deck("lsdyna", "contact_force", (1,)))
    monkeypatch.delitem(sys.modules, "birdstrike.data.exports.binout")
