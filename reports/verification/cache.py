"""What the verification keeps between runs: simulations by their key, and each problem's rows and pictures."""

from __future__ import annotations

import ast
import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

from birdstrike.data.paths import CASES, REFERENCE
from birdstrike.data.storage.files import whole_file, write_json
from birdstrike.data.storage.store import RunStore
from birdstrike.reports.figures.style import png
from birdstrike.reports.verification.made import ROOT, Made, made_now
from birdstrike.reports.verification.problem import Problem, Reason, Row, Solution
from birdstrike.solver.version import SOLVER_VERSION

OWN = ("birdstrike.reports.", "birdstrike.solver.reference.")
"""Modules that make rows and pictures; what computes a history is in the solver's version."""
DOTS_PER_INCH = 130


@dataclass(frozen=True)
class Drawn:
    """A picture on disk."""

    name: str
    path: Path
    caption: str


@dataclass(frozen=True)
class Result:
    """A solved problem as the page reads it.

    seconds: CPU time of its own solving, its simulations apart; made: the code that solved it; digest: of all that it
    rests on.
    """

    problem: Problem
    rows: tuple[Row, ...]
    pictures: tuple[Drawn, ...]
    reasons: dict[str, Reason]
    seconds: float
    made: Made = field(default_factory=Made)
    digest: str = ""


def fingerprint(problem: Problem) -> str:
    """Digest of all that its rows and pictures depend on.

    The solver's version; the sources that the problem's own module imports, directly or not, among those that make rows
    and pictures; shipped cases and reference data; the simulations that it is given.
    """
    whole = hashlib.sha256(SOLVER_VERSION.encode())
    sources = imported(getattr(problem.solve, "func", problem.solve).__module__)
    for path in sorted([*sources, *CASES.glob("*.toml"), *REFERENCE.glob("*.csv")]):
        whole.update(path.name.encode() + path.read_bytes())
    for spec in problem.runs:
        whole.update(spec.key().encode())
    return whole.hexdigest()[:16]


@cache
def imported(module: str) -> frozenset[Path]:
    """Files of a module and of all in OWN that it imports, directly or not, read from the sources."""
    waiting, found = [module], dict[str, Path]()
    while waiting:
        name = waiting.pop()
        if name in found or not (name == module or name.startswith(OWN)):
            continue
        path = ROOT.joinpath(*name.split(".")[1:]).with_suffix(".py")
        if not path.is_file():
            continue
        found[name] = path
        for node in ast.walk(ast.parse(path.read_bytes())):
            if isinstance(node, ast.ImportFrom) and node.module:
                waiting += [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
            elif isinstance(node, ast.Import):
                waiting += [alias.name for alias in node.names]
    return frozenset(found.values())


class Cache:
    """A folder with `runs/` and one folder for each solved problem."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.runs = RunStore(folder / "runs")

    def place(self, problem: Problem) -> Path:
        """Folder of the problem under the present code."""
        return self.folder / "problems" / f"{problem.name}-{fingerprint(problem)}"

    def keep(self, problem: Problem, outcome: Solution, seconds: float) -> None:
        """Pictures first, then the rows: a folder with rows is whole."""
        place = self.place(problem)
        for picture in outcome.pictures:
            with whole_file(place / f"{picture.name}.png") as temporary:
                temporary.write_bytes(png(picture.figure, DOTS_PER_INCH))
        pictures = tuple(Drawn(p.name, place / f"{p.name}.png", p.caption) for p in outcome.pictures)
        reasons = dict(outcome.reasons)
        kept = Result(problem, outcome.rows, pictures, reasons, seconds, made_now(), fingerprint(problem))
        write_json(place / "rows.json", as_table(kept))

    def recall(self, problem: Problem) -> Result | None:
        """The solved problem, None where it is not solved under the present code."""
        place = self.place(problem)
        try:
            kept: dict[str, Any] = json.loads((place / "rows.json").read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return None
        return result_of(problem, {"digest": fingerprint(problem), **kept}, place)


def as_table(result: Result) -> dict[str, Any]:
    """A solved problem for JSON; its pictures lie beside."""
    return {
        "rows": [vars(row) for row in result.rows],
        "pictures": [{"name": picture.name, "caption": picture.caption} for picture in result.pictures],
        "reasons": {name: vars(reason) for name, reason in result.reasons.items()},
        "seconds": result.seconds,
        "made": vars(result.made),
        "digest": result.digest,
    }


def result_of(problem: Problem, table: Mapping[str, Any], folder: Path) -> Result:
    """The solved problem in a table that `as_table` made, its pictures in a folder."""
    rows = tuple(Row(**{**row, "error": _number(row["error"]), "ours": _number(row["ours"])}) for row in table["rows"])
    drawn = tuple(Drawn(p["name"], folder / f"{p['name']}.png", p["caption"]) for p in table["pictures"])
    reasons = {name: Reason(**reason) for name, reason in table["reasons"].items()}
    made = Made(**table.get("made", {}))
    return Result(problem, rows, drawn, reasons, table["seconds"], made, table["digest"])


def _number(value: float | None) -> float:
    """JSON's null was a figure that is not finite."""
    return float("nan") if value is None else value
