"""What ships with the program: provenance on everything, and the numbers of the sources."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from birdstrike.data.curves import read_measured
from birdstrike.data.errors import UserError
from birdstrike.data.paths import CASES, MEASURED, REFERENCE, resolve_case, resolve_measured


@pytest.mark.parametrize("group", range(1, 6))
def test_table7_is_labelled_simulated_and_equals_the_printed_table(group: int) -> None:
    measured = read_measured(resolve_measured(f"table7_group{group}"))
    table = np.loadtxt(REFERENCE / "lsdyna_table7_simulated.csv", delimiter=",", skiprows=2)
    assert measured.simulated
    assert "NOT MEASURED" in measured.provenance[0]
    np.testing.assert_allclose(measured.time, 1e-3 * table[:, 0], rtol=1e-15)
    np.testing.assert_allclose(measured.channels["displacement_centre"], 1e-3 * table[:, group], rtol=1e-15)


def test_table6_is_the_diagonal_that_its_header_says() -> None:
    rows = np.loadtxt(REFERENCE / "table6_design.csv", delimiter=",", skiprows=5)
    k = rows[:, 0]
    diagonal = np.column_stack([-0.05 * k, 0.1 * (k - 1), 0.05 * k, 1.30 - 0.05 * k])
    np.testing.assert_allclose(rows[:, 1:], diagonal, atol=1e-12)
    assert np.linalg.matrix_rank(rows[:, 1:] - rows[:, 1:].mean(axis=0), tol=1e-9) == 1


SHIPPED = sorted([*CASES.glob("*.toml"), *MEASURED.glob("*.csv"), *REFERENCE.glob("*.csv")])


@pytest.mark.parametrize("path", SHIPPED, ids=lambda p: p.name)
def test_every_shipped_file_begins_with_its_provenance(path) -> None:
    text = path.read_text(encoding="utf-8")
    notes = [line for line in text.splitlines() if line.startswith("#")]
    assert text.startswith("# ")
    assert any(word in " ".join(notes) for word in ("Source", "SIMULATED", "COMPUTED"))


def test_a_bare_name_means_a_shipped_file_unless_one_lies_here(tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert resolve_case("reference_strike") == CASES / "reference_strike.toml"
    assert resolve_case("reference_strike.toml") == CASES / "reference_strike.toml"
    (tmp_path / "reference_strike.toml").write_text("# mine")
    assert resolve_case("reference_strike.toml") == (tmp_path / "reference_strike.toml").resolve()


def test_an_unknown_name_is_answered_with_the_nearest() -> None:
    with pytest.raises(UserError, match='did you mean "reference_strike"'):
        resolve_case("refrence_strike")
    with pytest.raises(UserError, match="table7_group1"):
        resolve_measured("zzz")


def test_a_mistyped_path_names_what_lies_in_that_folder(tmp_path: Path) -> None:
    """Shipped names are of no use to someone who gave a path."""
    (tmp_path / "catman.csv").touch()
    with pytest.raises(UserError, match=r'"catman.csv"\?$'):
        resolve_measured(tmp_path / "catmn.csv")
    with pytest.raises(UserError, match=r"files there: none"):
        resolve_measured(tmp_path / "nowhere" / "catmn.csv")
    with pytest.raises(UserError, match=r"files there: none"):
        resolve_measured(tmp_path / ("n" * 300) / "catmn.csv")
