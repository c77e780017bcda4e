"""What the verification keeps between runs: strikes by their key, and each problem's rows and pictures."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from birdstrike.data.files import whole_file, write_json
from birdstrike.data.paths import CASES, REFERENCE
from birdstrike.data.store import RunStore
from birdstrike.reports.figures.style import png
from birdstrike.reports.verification.problem import Outcome, Problem, Reason
from birdstrike.reports.verification.rows import Row
from birdstrike.solver.version import SOLVER_VERSION

HERE = Path(__file__).resolve().parent
UNUSED = ("page.py", "cache.py", "verify.py", "registry.py")
"""Files that change no problem's rows or pictures."""
DOTS_PER_INCH = 130


@dataclass(frozen=True)
class Drawn:
    """A picture on disk."""

    name: str
    path: Path
    caption: str


@dataclass(frozen=True)
class Result:
    """A solved problem as the page reads it; seconds: CPU time of its own solving, its strikes apart."""

    problem: Problem
    rows: tuple[Row, ...]
    pictures: tuple[Drawn, ...]
    reasons: dict[str, Reason]
    seconds: float


def fingerprint(problem: Problem) -> str:
    """Digest of all that its rows depend on: solver, problem's own sources, cases, references, its strikes."""
    whole = hashlib.sha256(SOLVER_VERSION.encode())
    module = f"{getattr(problem.solve, 'func', problem.solve).__module__.rpartition('.')[2]}.py"
    shared = [p for p in HERE.glob("*.py") if not p.name.endswith("_problems.py") and p.name not in UNUSED]
    for path in sorted([HERE / module, *shared, *CASES.glob("*.toml"), *REFERENCE.glob("*.csv")]):
        whole.update(path.name.encode() + path.read_bytes())
    for shot in problem.shots:
        whole.update(shot.key().encode())
    return whole.hexdigest()[:16]


class Cache:
    """A folder with `strikes/` and one folder for each solved problem."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.strikes = RunStore(folder / "strikes")

    def place(self, problem: Problem) -> Path:
        """Folder of the problem under the present code."""
        return self.folder / "problems" / f"{problem.name}-{fingerprint(problem)}"

    def keep(self, problem: Problem, outcome: Outcome, seconds: float) -> None:
        """Pictures first, then the rows: a folder with rows is whole."""
        place = self.place(problem)
        for picture in outcome.pictures:
            with whole_file(place / f"{picture.name}.png") as temporary:
                temporary.write_bytes(png(picture.figure, DOTS_PER_INCH))
        captions = [{"name": picture.name, "caption": picture.caption} for picture in outcome.pictures]
        reasons = {name: vars(reason) for name, reason in outcome.reasons.items()}
        rows = [vars(row) for row in outcome.rows]
        write_json(place / "rows.json", {"rows": rows, "pictures": captions, "reasons": reasons, "seconds": seconds})

    def recall(self, problem: Problem) -> Result | None:
        """The solved problem, None where it is not solved under the present code."""
        place = self.place(problem)
        try:
            kept: dict[str, Any] = json.loads((place / "rows.json").read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return None
        rows = tuple(
            Row(**{**row, "error": _number(row["error"]), "ours": _number(row["ours"])}) for row in kept["rows"]
        )
        drawn = tuple(Drawn(p["name"], place / f"{p['name']}.png", p["caption"]) for p in kept["pictures"])
        reasons = {name: Reason(**reason) for name, reason in kept["reasons"].items()}
        return Result(problem, rows, drawn, reasons, kept["seconds"])


def _number(value: float | None) -> float:
    """JSON's null was a figure that is not finite."""
    return float("nan") if value is None else value
