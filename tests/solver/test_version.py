"""The solver's version follows every file that computes a history, wherever it lies, and no other."""

from __future__ import annotations

import ast
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from birdstrike.solver import version

SOLVER = Path(__file__).parents[2] / "solver"


@pytest.fixture
def edited(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[Path, str], str]:
    """The version after a comment is added to a file of a copy of the solver, or after a text of it is replaced."""
    copy = tmp_path / "solver"
    shutil.copytree(SOLVER, copy, ignore=shutil.ignore_patterns("__pycache__"))
    monkeypatch.setattr(version, "HERE", copy)

    def edit(path: Path, old: str) -> str:
        target = copy / path.relative_to(SOLVER)
        text = target.read_text(encoding="utf-8")
        assert old in text
        target.write_text(text.replace(old, f"{old}  # changed", 1), encoding="utf-8")
        found = version.digest_sources()
        target.write_text(text, encoding="utf-8")
        return found

    return edit


def holding(text: str) -> Path:
    """The one file of the solver that holds a text."""
    (found,) = [path for path in SOLVER.rglob("*.py") if text in path.read_text(encoding="utf-8")]
    return found


@pytest.mark.parametrize(
    "formula",
    [
        "return polynomial_k(rho0, self.c0, self.k)",
        "return porous_density(self.z, self.water_density)",
        "return linear_polynomial(rho0, [self.C0, self.C1, self.C2, self.C3, self.C4, self.C5, self.C6], self.E0)",
        "self.mass / self.volume",
        "return tuple(float(k * interval)",
    ],
)
def test_a_formula_that_a_case_s_table_holds_changes_the_version(
    edited: Callable[[Path, str], str], formula: str
) -> None:
    """Coefficients from k, densities of mixtures and of weighed birds, instants: wherever the table that says them."""
    assert edited(holding(formula), formula.split("(")[0]) != version.digest_sources()


def test_every_file_counts_but_those_that_compute_no_history(edited: Callable[[Path, str], str]) -> None:
    before = version.digest_sources()
    first = "from __future__ import annotations"
    files = [path for path in SOLVER.rglob("*.py") if first in path.read_text(encoding="utf-8")]
    without = {path.relative_to(SOLVER).as_posix() for path in files if edited(path, first) == before}
    folders = tuple(name for name in version.WITHOUT_HISTORIES if name.endswith("/"))
    assert {name for name in without if not name.startswith(folders)} == set(version.WITHOUT_HISTORIES) - set(folders)
    inside = {path.relative_to(SOLVER).as_posix() for path in files}
    assert {name for name in without if name.startswith(folders)} == {n for n in inside if n.startswith(folders)}


def test_what_does_not_count_is_read_by_nothing_that_computes() -> None:
    """Only a case's own files and the words about a finished run import it."""
    files = {path.relative_to(SOLVER).as_posix(): path for path in SOLVER.rglob("*.py")}
    left_out = {name for name in files if not version.counts(name)}
    silent = {f"birdstrike.solver.{name.removesuffix('.py').replace('/', '.')}" for name in left_out}
    readers = {name for name, path in files.items() if name not in left_out and silent & imported(path)}
    assert {name for name in readers if not name.startswith("case/")} == {"checks.py"}


def imported(path: Path) -> set[str]:
    """Modules that a file imports from."""
    nodes = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
    return {node.module for node in nodes if isinstance(node, ast.ImportFrom) and node.module}


def test_a_layer_s_code_is_its_own_and_that_below_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for layer in version.LAYERS:
        (tmp_path / layer).mkdir()
        (tmp_path / layer / "made.py").write_text("x = 1\n")
    monkeypatch.setattr(version, "HERE", tmp_path / "solver")
    of = version.code_of.__wrapped__
    before = {layer: of(layer) for layer in version.LAYERS}
    assert len({*before.values()}) == len(version.LAYERS)
    for i, layer in enumerate(version.LAYERS):
        (tmp_path / layer / "made.py").write_text("x = 2\n")
        assert [other for other in version.LAYERS if of(other) != before[other]] == [*version.LAYERS[i:]]
        (tmp_path / layer / "made.py").write_text("x = 1\n")
    monkeypatch.setattr(version, "SOLVER_VERSION", "another")
    assert all(of(layer) != before[layer] for layer in version.LAYERS)
