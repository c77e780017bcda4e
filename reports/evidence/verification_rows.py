"""Rows of the verification page that bear on a case: those whose subject and range contain it, and what none covers."""

from __future__ import annotations

import html
import re
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from birdstrike.solver.case.case import Case

EOS_NAMES = {
    "grueneisen": "Grueneisen",
    "linear_polynomial": "linear polynomial",
    "murnaghan": "Murnaghan",
    "polynomial_k": "polynomial from k",
    "table": "table",
    "porous": "porous",
}
JUDGED = ("within", "beyond")
_SPEED = re.compile(r"([\d.]+) m/s")
_CODE = re.compile(r"\bsolver ([0-9a-f]{12})\b")


@dataclass(frozen=True)
class VerificationRow:
    """One row of the page, its cells as text."""

    family: str
    name: str
    truth: str
    ours: str
    error: str
    tolerance: str
    verdict: str


@dataclass(frozen=True)
class Aspect:
    """Something that the case asks of the solver; rows: that check it; missing: why none does, empty where some do."""

    name: str
    rows: tuple[VerificationRow, ...]
    missing: str = ""

    def figures(self) -> dict[str, Any]:
        """For JSON."""
        return {"aspect": self.name, "rows": [asdict(row) for row in self.rows], "missing": self.missing or None}


def read_rows(page: Path) -> tuple[list[VerificationRow], tuple[str, ...]]:
    """Rows of VERIFICATION.md, and the digests of the solvers that made them."""
    text = page.read_text(encoding="utf-8")
    rows, family = [], ""
    for line in text.splitlines():
        if line.startswith("## "):
            family = line[3:].strip()
        cells = line.strip().strip("|").split("|") if line.startswith("|") else []
        if len(cells) >= 7 and cells[5].strip(" *") in (*JUDGED, "–", "shown"):
            rows.append(_row(family, cells))
    return rows, tuple(dict.fromkeys(_CODE.findall(text)))


def _row(family: str, raw: list[str]) -> VerificationRow:
    cells = [html.unescape(cell.strip()) for cell in raw]
    name = re.sub(r"<br>.*", "", cells[0])
    linked = re.match(r"\[(.*)\]\([^)]*\)$", name.strip())
    truth, ours, error, tolerance, verdict = cells[1:6]
    return VerificationRow(family, linked[1] if linked else name, truth, ours, error, tolerance, verdict.strip("*"))


def aspects(case: Case, rows: list[VerificationRow]) -> tuple[Aspect, ...]:
    """What the case asks of the solver, each with the rows that bear on it."""
    return tuple(_with_rows(case, rows))


def _with_rows(case: Case, rows: list[VerificationRow]) -> Iterator[Aspect]:
    yield _shock(case, rows)
    yield (
        _family(rows, "bird's particles", "SPH")
        if case.bird.method == "sph"
        else _family(rows, "bird's hexahedra", "Lagrangian against SPH")
    )
    if case.bird.material.model != "null":
        model = case.bird.material.model.replace("_", " ")
        checked = [row for row in rows if row.verdict in JUDGED]  # a figure that is only shown checks nothing
        named = tuple(row for row in checked if model in row.name.lower() and "bird" in row.name.lower())
        missing = "" if named else f"no row checks the strength of a bird of model {case.bird.material.model}"
        yield Aspect("strength of the bird", named, missing)
    yield from _target(case, rows)
    if case.impact.friction:
        named = tuple(row for row in rows if "friction" in row.name.lower())
        yield Aspect("friction", named, "" if named else "no row checks friction between bird and target")
    yield _family(rows, "energy and momentum of a whole impact", "Energy balance")
    yield _family(rows, "a whole impact against another code", "The OpenRadioss strike")


def _shock(case: Case, rows: list[VerificationRow]) -> Aspect:
    """Planar impacts with the case's law at speeds that enclose its normal one."""
    law, speed = case.bird.material.law, case.normal_speed
    if law is None:
        return Aspect("shock in the bird", (), "the bird's material has no equation of state of its own")
    kind = EOS_NAMES.get(law.kind, law.kind)
    fitting = [row for row in rows if row.family == "Planar impact" and f": {kind}" in row.name]
    speeds = [float(found[1]) for row in fitting if (found := _SPEED.search(row.name))]
    name = f"shock in the bird, {kind}, {speed:.4g} m/s normal"
    if not speeds:
        return Aspect(name, (), f"no planar impact of a {kind} bird among the rows")
    if not 0.99 * min(speeds) <= speed <= 1.01 * max(speeds):
        span = f"the rows go from {min(speeds):g} to {max(speeds):g} m/s, and the case has {speed:.4g} m/s"
        return Aspect(name, tuple(fitting), f"outside the range: {span}")
    return Aspect(name, tuple(fitting))


def _target(case: Case, rows: list[VerificationRow]) -> Iterator[Aspect]:
    if case.target is not None:
        yield _family(rows, "target of several parts", "Assembl", "Stiffened", "Targets of several parts")
        return
    plate = case.plate
    if plate.rigid:
        yield _family(rows, "rigid target", "Target")
        return
    if plate.radius is not None:
        yield _family(rows, "curved panel", "Curved shells")
    held = plate.edges if isinstance(plate.edges, str) else "on springs"
    if held == "clamped":
        yield _family(rows, "clamped plate", "Clamped plate")
    if held != "clamped" or any(plate.preload) or plate.damping:
        yield _family(rows, f"edges ({held}), preload and damping", "Edges, preload and damping")
    yield _family(rows, "plasticity of the plate", "Plasticity and objectivity", "Ductile plate")


def _family(rows: list[VerificationRow], name: str, *beginnings: str) -> Aspect:
    found = tuple(row for row in rows if row.family.startswith(beginnings))
    return Aspect(name, found, "" if found else f"no row of the page is about it ({', '.join(beginnings)})")
