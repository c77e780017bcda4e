"""The text of a case from the template of `birdstrike new`, with answers in the places of its values."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from birdstrike.data.paths import TEMPLATES
from birdstrike.data.units import to_si
from birdstrike.questions.answers import literal
from birdstrike.questions.shot import ShotAnswers

STANDOFF = "10 mm"
"""Flown before the first touch: the record's clock is moved so that both agree."""

LATER = 2e-4
"""[s] By which the simulation outlasts what is used of the record, so that the record's clock may be estimated."""

_TABLE = re.compile(r"\[(?P<name>[^\]]+)\]\s*(#.*)?")
_ENTRY = re.compile(r"(?P<key>[A-Za-z_]+) = (?P<value>.*?)(?P<comment>\s+#.*)?")
_SENSORS = "# A sensor for every column"
_SOUGHT = "# What is sought"
COMMENT_AT = 32  # column of the comments


def case_text(shot: ShotAnswers) -> str:
    """A commented case that says every answer."""
    template = (TEMPLATES / "case.toml").read_text(encoding="utf-8")
    body = template[template.index("[plate]") :]
    above, below = body[: body.index(_SENSORS)], body[body.index(_SOUGHT) :]
    values = {**shot.values, "impact.standoff": STANDOFF, "time.end": _end(shot)}
    nuisance = {"inversion.nuisance.time_offset": shot.sigma or None}
    head = (
        f"# {shot.name}: one shot, to be calibrated. Written by birdstrike start from answers.toml. Make a change\n"
        "# there and start again, or here and call birdstrike close-the-loop. All keys: docs/cases.md.\n\n"
    )
    return head + with_values(above, values) + _sensors(shot) + with_values(below, {**values, **nuisance})


def _end(shot: ShotAnswers) -> str:
    """Contact and what is used of the response."""
    contact = to_si(STANDOFF, "m") / to_si(str(shot.values["impact.speed"]), "m/s")
    return f"{1e3 * (contact + to_si(shot.until, 's') + LATER):.2f} ms"


def with_values(text: str, values: Mapping[str, Any]) -> str:
    """The text with values under dotted keys in place of its own; None takes a line away, a new key ends its table."""
    lines, table, left = list[str](), "", dict(values)
    for line in text.splitlines():
        if (found := _TABLE.fullmatch(line.strip())) is not None:
            lines, table = [*_ended(lines, table, left), line], found["name"]
            continue
        entry = _ENTRY.fullmatch(line)
        key = f"{table}.{entry['key']}" if entry else ""
        if entry is None or key not in left:
            lines.append(line)
        elif (value := left.pop(key)) is not None:
            lines.append(_line(f"{entry['key']} = {literal(value)}", (entry["comment"] or "").strip()))
    return "\n".join(line.rstrip() for line in _ended(lines, table, left)) + "\n"


def _line(text: str, comment: str) -> str:
    """A line of the case with its comment in the column of comments."""
    return f"{text.ljust(COMMENT_AT - 1)} {comment}" if comment else text


def _ended(lines: list[str], table: str, left: dict[str, Any]) -> list[str]:
    """The lines with the values that the table did not hold, above the empty lines that end it."""
    own = [key for key in left if table and key.rpartition(".")[0] == table]
    new = [f"{key.rpartition('.')[2]} = {literal(left[key])}" for key in own if left[key] is not None]
    for key in own:
        left.pop(key)
    last = len(lines)
    while new and last > 0 and (not lines[last - 1].strip() or lines[last - 1].startswith("#")):
        last -= 1
    return [*lines[:last], *new, *lines[last:]]


def _sensors(shot: ShotAnswers) -> str:
    """The sensors of the record with the columns that they stand for, then the forces, which the report shows too."""
    found = ["# A sensor for every column of the record; at: from the plate's centre along length and width."]
    for name, column in shot.columns.items():
        found += [_line(f"[sensors.{name}]", f'# column "{column.name}" of {shot.record.name}')]
        found += [f"{key} = {literal(value)}" for key, value in column.sensor.items()] + [""]
    kinds = {column.sensor["kind"] for column in shot.columns.values()}
    for kind in ("contact_force", "reaction_force"):
        if kind not in kinds and kind not in shot.columns:
            found += [_line(f"[sensors.{kind}]", "# not measured"), f'kind = "{kind}"', ""]
    return "\n".join(found) + "\n"
