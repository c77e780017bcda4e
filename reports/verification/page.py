"""VERIFICATION.md: a table for each family of problems, the figures with their captions, and the reasons."""

from __future__ import annotations

import math
import os
import platform
import shutil
from collections.abc import Sequence
from datetime import UTC, datetime
from importlib.metadata import version
from itertools import groupby
from pathlib import Path

from birdstrike.data.storage.files import whole_file, write_atomically
from birdstrike.reports.verification.cache import Drawn, Result
from birdstrike.reports.verification.ledger import FIGURES, record
from birdstrike.reports.verification.made import Made, made_now
from birdstrike.reports.verification.problem import Reason, Row
from birdstrike.reports.verification.registry import problems


def machine() -> str:
    """Its class: cores, processor family, and the libraries that decide the bits."""
    libraries = ", ".join(f"{name} {version(name)}" for name in ("numpy", "numba", "scipy"))
    return f"{os.cpu_count()} cores, {platform.machine()}, Python {platform.python_version()}, {libraries}"


most_reasons = 3
SIGNS = {"within": "within", "beyond": "**beyond**", "shown": "–"}


def write_page(out: Path, results: Sequence[Result], wall_s: float) -> None:
    """The page, and beside it, under docs/verification/, the figures and what the page holds."""
    for picture in (picture for result in results for picture in result.pictures):
        target = out.parent / FIGURES / f"{picture.name}.png"
        if target.exists() and target.samefile(picture.path):
            continue
        with whole_file(target) as temporary:
            shutil.copyfile(picture.path, temporary)
    write_atomically(out, page(results, wall_s))
    record(out, results)


def page(results: Sequence[Result], wall_s: float) -> str:
    """Markdown of the whole."""
    rows = [row for result in results for row in result.rows]
    reasons = {name: reason for result in results for name, reason in result.reasons.items()}
    families = [(name, list(group)) for name, group in groupby(results, lambda result: result.problem.family)]
    several = len({result.made.short for result in results}) > 1
    parts = [head(rows, results, wall_s), contents(families), left_out(results), standing(rows, reasons)]
    parts += [family(name, members, several) for name, members in families]
    return "\n\n".join(part for part in parts if part) + "\n"


def head(rows: Sequence[Row], results: Sequence[Result], wall_s: float) -> str:
    """Title, version, and the count of the verdicts."""
    count = {verdict: sum(row.verdict == verdict for row in rows) for verdict in SIGNS}
    today, told = datetime.now(UTC).strftime("%Y-%m-%d"), origins(results)
    spent = f"; this run took {wall_s / 60.0:.1f} min (what an earlier run of the same code had solved is kept)"
    spent = spent if wall_s >= 1.0 else ""
    return (
        "# Verification\n\n"
        "Each row is a truth, its source, our figure and the tolerance. Made by `birdstrike verify`; do not edit.\n\n"
        f"- Page: {today}{told or f'; code: {made_now()}'}\n"
        f"- Machine: {machine()}{spent}\n"
        f"- **{count['within']} rows within** their tolerance, **{count['beyond']} beyond**; {count['shown']} shown "
        "without one"
    )


def origins(results: Sequence[Result]) -> str:
    """At which states of the code the rows were made; nothing where all are of the present one."""
    now, rows = made_now(), dict[Made, int]()
    for result in results:
        rows[result.made] = rows.get(result.made, 0) + len(result.rows)
    if all(made.short == now.short for made in rows):
        return ""
    lines = [f"  - {made.short}: {made}{f', {made.date}' if made.date else ''}: {n} rows" for made, n in rows.items()]
    return "\n".join(["\n- Rows were made at these states of the code (column *made at*):", *lines])


def contents(families: Sequence[tuple[str, Sequence[Result]]]) -> str:
    """Links to the families with their verdicts."""
    lines = []
    for name, members in families:
        judged = [row for result in members for row in result.rows if row.tolerance is not None]
        good = sum(row.verdict == "within" for row in judged)
        tally = f"{good} of {len(judged)} within" if judged else "shown"
        lines.append(f"- [{name}](#{anchor(name)}): {tally}")
    return "\n".join(lines)


def anchor(heading: str) -> str:
    """As GitHub names a heading."""
    return "".join(c for c in heading.lower().replace(" ", "-") if c.isalnum() or c in "-_")


def left_out(results: Sequence[Result]) -> str:
    """Names of the problems that this page does not hold, so that no page looks more whole than it is."""
    missing = [name for name in problems() if name not in {result.problem.name for result in results}]
    return f"Not solved for this page: {', '.join(missing)}." if missing else ""


def standing(rows: Sequence[Row], reasons: dict[str, Reason]) -> str:
    """Rows beyond their tolerance, with the experiment that shows why, or where the experiments stand."""
    beyond = [row for row in rows if row.verdict == "beyond"]
    lines = [
        "## Rows beyond their tolerance",
        f"With the experiment that shows its reason, where one is recorded; at most {most_reasons} may stand here.",
    ]
    if not beyond:
        return f"{lines[0]}\n\nNone."
    for row in beyond:
        reason = reasons.get(row.name)
        said = f"{row.name}: {error(row)}, tolerance {tolerance(row)}."
        why = (
            f"{reason.text} ![{row.name}]({FIGURES.as_posix()}/{reason.figure}.png)"
            if reason
            else "No figure is recorded with it; what was tried: [limits](docs/limits.md)."
        )
        lines.append(f"- **{said}** {why}")
    return "\n\n".join(lines[:2]) + "\n\n" + "\n".join(lines[2:])


def family(name: str, members: Sequence[Result], several: bool) -> str:
    """What the problems are about, one table, then the figures; several: whether each row says where it was made."""
    parts = [f"## {name}"]
    parts += [member.problem.about for member in members if member.problem.about]
    made = [member.made.short for member in members for _ in member.rows]
    parts.append(table([row for member in members for row in member.rows], made if several else []))
    parts += [shown(picture) for member in members for picture in member.pictures]
    return "\n\n".join(parts)


def table(rows: Sequence[Row], made: Sequence[str]) -> str:
    """One line a row; sources as they stand in the row, notes behind the name; made: of each row, if said."""
    sources = list(dict.fromkeys(row.source for row in rows))
    more = ["made at"] if made else []
    titles = ["", "truth", "ours", "error", "tolerance", "verdict", "source", *more]
    lines = [f"| {' | '.join(titles)} |".replace("|  |", "| |"), "|" + "---|" * len(titles)]
    for i, row in enumerate(rows):
        name = f"[{row.name}]({FIGURES.as_posix()}/{row.figure}.png)" if row.figure else row.name
        note = f"<br><sub>{row.note}</sub>" if row.note else ""
        truth = "" if row.truth is None else quantity(row.truth, row.unit)
        cells = [name + note, truth, quantity(row.ours, row.unit), error(row), tolerance(row), SIGNS[row.verdict]]
        cells += [str(sources.index(row.source) + 1), *made[i : i + 1]]
        lines.append(f"| {' | '.join(cells)} |".replace("<1", "&lt;1"))
    named = "\n".join(f"{number}. {source}" for number, source in enumerate(sources, 1))
    return "\n".join(lines) + f"\n\nSources:\n\n{named}"


def shown(picture: Drawn) -> str:
    """The figure with its caption below."""
    title = picture.name.replace("_", " ")
    return f"![{title}]({FIGURES.as_posix()}/{picture.name}.png)\n\n*{picture.caption}*"


def quantity(value: float, unit: str) -> str:
    """Five figures, and the unit."""
    return f"{value:.5g} {unit}".rstrip()


def error(row: Row) -> str:
    """Signed where there is a truth; nothing for a row that is only shown."""
    if math.isnan(row.error):
        return "" if row.tolerance is None else "not a number"
    return f"{row.error:{'+' if row.truth is not None else ''}.3g} {row.error_unit}".rstrip()


def tolerance(row: Row) -> str:
    """As it is judged: in the error's unit."""
    return "" if row.tolerance is None else f"{row.tolerance:g} {row.error_unit}".rstrip()
