"""make_design: ranges, kinds, and a user's own file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from birdstrike.cli.app import app
from birdstrike.data.errors import UserError
from birdstrike.data.paths import REFERENCE
from birdstrike.doe.campaign.folder import design_text
from birdstrike.doe.designs.design import Design, DesignKind
from birdstrike.doe.designs.registry import KINDS, make_design
from birdstrike.doe.designs.space import ParameterSpace
from tests.doe.stand_in import reference

SPACE = ParameterSpace.of(reference().parameters())
PC, MU, TEROD, CEROD = SPACE.names


def read(folder: Path, *lines: str) -> Design:
    """The design of a file with these lines."""
    path = folder / "mine.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return make_design(path, SPACE)


def test_the_space_is_the_case_s_ranges_in_si() -> None:
    assert SPACE.names[1] == "bird.material.viscosity"
    assert SPACE.units == ("Pa", "Pa s", "", "")
    np.testing.assert_allclose(SPACE.lows, [-1.25e6, 0.0, 0.05, 0.05])
    np.testing.assert_allclose(SPACE.highs, [-0.05e6, 1500.0, 1.25, 1.25])


def test_fractions_and_values_are_each_other_s_inverse() -> None:
    unit = np.random.default_rng(0).random((10, 4))
    np.testing.assert_allclose(SPACE.to_unit(SPACE.to_physical(unit)), unit, atol=1e-14)


@pytest.mark.parametrize("kind", ["lhs", "sobol", "orthogonal"])
def test_values_are_the_fractions_of_the_ranges(kind: str) -> None:
    design = make_design(kind, SPACE, 25, seed=1)
    assert design.values.shape == (25, 4)
    assert not SPACE.outside(design.values).any()
    np.testing.assert_allclose(design.values, SPACE.lows + design.unit * (SPACE.highs - SPACE.lows))
    np.testing.assert_array_equal(design.numbers, np.arange(1, 26))
    np.testing.assert_array_equal(design.values, make_design(kind, SPACE, 25, seed=1).values)


def test_a_latin_hypercube_has_one_run_in_every_stratum() -> None:
    unit = make_design("lhs", SPACE, 12, seed=0).unit
    np.testing.assert_array_equal(np.sort(np.floor(unit * 12), axis=0), np.tile(np.arange(12)[:, None], 4))


def test_a_sobol_design_is_balanced_at_powers_of_two_and_says_so_otherwise() -> None:
    unit = make_design("sobol", SPACE, 32, seed=0).unit
    np.testing.assert_array_equal(np.sort(np.floor(unit * 32), axis=0), np.tile(np.arange(32)[:, None], 4))
    assert make_design("sobol", SPACE, 32).warnings == ()
    (warning,) = make_design("sobol", SPACE, 25).warnings
    assert "25" in warning
    assert "32" in warning


@pytest.mark.parametrize(
    ("kind", "runs", "seed", "message"),
    [
        ("unifrom", 25, 0, "neither a file nor one of uniform, orthogonal, lhs, sobol"),
        ("lhs", 1, 0, "--runs = 1 is below 2"),
        ("lhs", 5, -1, "--seed = -1 is below 0"),
    ],
)
def test_what_cannot_be_designed_is_the_user_s_error(kind: str, runs: int, seed: int, message: str) -> None:
    with pytest.raises(UserError, match=message):
        make_design(kind, SPACE, runs, seed)


def test_the_paper_s_table_6_is_read_in_si() -> None:
    design = make_design(REFERENCE / "table6_design.csv", SPACE, runs=25)
    k = np.arange(1, 6)
    expected = np.stack([-0.05e6 * k, 100.0 * (k - 1), 0.05 * k, 1.30 - 0.05 * k], axis=1)
    np.testing.assert_allclose(design.values, expected, rtol=1e-12)
    np.testing.assert_array_equal(design.numbers, k)
    assert design.kind == "file"
    assert design.seed is None


def test_columns_come_in_any_order_and_runs_keep_their_numbers(tmp_path: Path) -> None:
    design = read(
        tmp_path, "# mine", f"{CEROD} [],run,{TEROD} [],{MU} [N*ms/mm^2],{PC} [kPa]", "0.9,7,1.1,0.5,-100", "",
        "0.8,3,1.2,1.5,-200",
    )  # fmt: skip
    np.testing.assert_array_equal(design.numbers, [7, 3])
    np.testing.assert_allclose(design.values, [[-1e5, 500.0, 1.1, 0.9], [-2e5, 1500.0, 1.2, 0.8]])


def test_a_campaign_s_own_design_is_read_as_it_stands_and_only_there(tmp_path: Path) -> None:
    design = make_design("uniform", SPACE, 8, seed=3)
    path = tmp_path / "design.csv"
    path.write_text(design_text(design))
    with pytest.raises(UserError, match="has no unit"):
        make_design(path, SPACE)
    (tmp_path / "case.json").write_text("{}")
    np.testing.assert_array_equal(make_design(path, SPACE).values, design.values)


def test_runs_that_repeat_another_are_warned_of_and_kept(tmp_path: Path) -> None:
    header = f"run,{PC} [MPa],{MU} [Pa s],{TEROD} [],{CEROD} []"
    design = read(
        tmp_path, header, "3,-0.1,100,0.5,0.5", "5,-0.2,100,0.5,0.5", "9,-0.1,100,0.5,0.5", "4,-0.1,100,0.5,0.5"
    )
    (warning,) = design.warnings
    assert warning.startswith("2 of 4 runs repeat the values of an earlier one (first: run 9)")
    assert len(design.values) == 4


def test_values_outside_a_range_are_warned_of_and_kept(tmp_path: Path) -> None:
    header = f"{PC} [MPa],{MU} [Pa s],{TEROD} [],{CEROD} []"
    design = read(tmp_path, header, "-0.1,100,0.5,0.5", "-0.2,1600,0.5,0.5", "-0.3,1700,0.6,0.7")
    (warning,) = design.warnings
    assert warning.startswith(f"{MU}: 2 of 3 runs are outside the case's range (first: run 2)")
    assert design.values[2, 1] == 1700.0


HEADER = f"{PC} [MPa],{MU} [Pa s],{TEROD} [],{CEROD} []"


@pytest.mark.parametrize(
    ("lines", "messages"),
    [
        ([HEADER.replace(" [MPa]", ""), "-0.1,1,1,1", "-0.2,2,1,1"], [rf"line 1: column {PC} has no unit.*MPa"]),
        ([HEADER.replace("[Pa s]", "[mm]"), "-0.1,1,1,1", "-0.2,2,1,1"], [rf'column {MU} has the unit "mm".*Pa s']),
        ([f"{PC} [MPa],{MU} [Pa s]", "-0.1,1", "-0.2,2"], [f"{TEROD} is missing", f"{CEROD} is missing"]),
        (
            [HEADER + ",impact.sped [m/s]", "-0.1,1,1,1,9", "-0.2,2,1,1,9"],
            ["impact.sped is not a parameter of the case"],
        ),
        ([HEADER, "-0.1,nan,1,1", "-0.2,2,,1"], [f'line 2, column {MU}: "nan"', f'line 3, column {TEROD}: ""']),
        ([HEADER, "-0.1,1,1", "-0.2,2,1,1"], ["line 2: 3 cells where the header has 4"]),
        (["run," + HEADER, "1,-0.1,1,1,1", "1,-0.2,2,1,1"], ["column run: 1 stands more than once"]),
        (["run," + HEADER, "0,-0.1,1,1,1", "x,-0.2,2,1,1"], ['"0" is not a run number', '"x" is not a run number']),
        ([HEADER, "-0.1,1,1,1"], ["has 1 runs; a design needs"]),
        ([f"{HEADER},{PC} [MPa]", "-0.1,1,1,1,1", "-0.1,1,1,1,1"], [f"column {PC} stands twice"]),
    ],
)
def test_every_error_of_a_design_file_is_listed_with_its_place(
    tmp_path: Path, lines: list[str], messages: list[str]
) -> None:
    with pytest.raises(UserError) as caught:
        read(tmp_path, *lines)
    for message in messages:
        assert caught.match(message)


@pytest.mark.parametrize("command", ["run-doe", "close-the-loop"])
def test_help_names_every_kind_of_the_registry(command: str) -> None:
    shown = CliRunner().invoke(app, [command, "--help"], env={"COLUMNS": "200"}).stdout
    assert [kind for kind in KINDS if kind not in shown] == []


def test_a_kind_is_added_by_one_entry_of_the_registry(monkeypatch: pytest.MonkeyPatch) -> None:
    def middle(runs: int, columns: int, *_: object) -> np.ndarray:
        return np.full((runs, columns), 0.5)

    monkeypatch.setitem(KINDS, "middle", DesignKind("middle", middle, note=lambda runs: f"{runs} times the same"))
    design = make_design("middle", SPACE, 3)
    np.testing.assert_allclose(design.values, np.tile(0.5 * (SPACE.lows + SPACE.highs), (3, 1)))
    assert (design.kind, design.warnings) == ("middle", ("3 times the same",))
    with pytest.raises(UserError, match="neither a file nor one of uniform, orthogonal, lhs, sobol, middle"):
        make_design("centre", SPACE, 3)
