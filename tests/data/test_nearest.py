"""A mistyped name and the known one that it is most like."""

from __future__ import annotations

import ast
from pathlib import Path

import birdstrike
from birdstrike.data.nearest import did_you_mean, nearest


def test_the_nearest_name_is_proposed_and_none_that_is_unlike() -> None:
    known = ("plate.length", "plate.width")
    assert nearest("plate.lenght", known) == "plate.length"
    assert did_you_mean("plate.lenght", known) == "did you mean plate.length?"
    assert did_you_mean("plate.lenght", known, quote='"') == 'did you mean "plate.length"?'
    assert did_you_mean("speed", known, "known: all") == "known: all"
    assert did_you_mean("plate.lenght", known, "known: all", alike=0.99) == "known: all"


def test_only_one_module_compares_names() -> None:
    package = Path(birdstrike.__file__).parent
    parts = [package, *(package / name for name in ("data", "doe", "inversion", "reports", "solver", "surrogate"))]
    files = {path.resolve() for part in parts for path in (part / ".").rglob("*.py")}
    imports = {
        path.name
        for path in files
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if (isinstance(node, ast.Import) and any(one.name == "difflib" for one in node.names))
        or (isinstance(node, ast.ImportFrom) and node.module == "difflib")
    }
    assert imports == {"nearest.py"}
