"""Kernels know arrays, numba and each other; the import contract cannot name what does not exist yet, this can."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

KERNELS = Path(__file__).resolve().parents[3] / "solver" / "kernels"
ALLOWED = ("__future__", "math", "typing", "numpy", "numba", "llvmlite", "birdstrike.solver.kernels")


def imported(path: Path) -> set[str]:
    """Modules that a file imports, by their full names."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        if isinstance(node, ast.ImportFrom):
            found.add(node.module or "." * node.level)
    return found


@pytest.mark.parametrize("path", sorted(KERNELS.rglob("*.py")), ids=lambda path: path.relative_to(KERNELS).as_posix())
def test_a_kernel_imports_arrays_numba_and_kernels_only(path: Path) -> None:
    foreign = {name for name in imported(path) if not any(name == a or name.startswith(f"{a}.") for a in ALLOWED)}
    assert foreign == set()
