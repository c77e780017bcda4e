"""The page of an audit: gates, confusion matrix, power in physical units, robustness, every experiment."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from data.errors import UserError
from data.files import write_atomically
from reports.audit_tables import tables, words
from reports.blocks import Block, Paragraph, Section, drawing
from reports.figures.audit import confusion_figure, power_figure
from reports.render import rendered


def write_audit_page(folder: str | Path) -> Path:
    """Write `audit.html` beside audit.json; its path. Raises UserError where there is no audit."""
    place = Path(folder)
    path = place / "audit.json"
    if not path.is_file():
        raise UserError(f"no audit.json in {place}; make it with: birdstrike audit --out {place}")
    content = json.loads(path.read_text(encoding="utf-8"))
    write_atomically(place / "audit.html", page(content))
    return place / "audit.html"


def page(content: Mapping[str, Any]) -> str:
    """The page as HTML text; nothing in it points outside."""
    return rendered(
        title="Audit of the diagnosis",
        subtitle=f"Planted experiments, simulated on finer meshes than the diagnosed ones. {words(content)}",
        sections=[
            section(i, name, entry, content["alpha"]) for i, (name, entry) in enumerate(content["tables"].items())
        ],
    )


def section(number: int, name: str, entry: Mapping[str, Any], alpha: float) -> Section:
    """All of one number of channels."""
    intro = (
        f"{entry['curves']} curves. Rates are means over curves of the share of noise draws. Two intervals, both over "
        "curves: by bootstrap, which is too narrow over a handful of them, and Clopper and Pearson's of the nearest "
        "whole number of curves, which is wide; a gate on an interval takes the wider. Missed gates are shown."
    )
    found = tables(entry)
    confusion = drawing(
        f"confusion-{number}", confusion_figure(entry["confusion"]), "What was planted and what was answered."
    )
    blocks: list[Block] = [Paragraph(intro), found.pop("gates"), confusion]
    if entry["power"]:
        caption = (
            "Power against the size of the effect that makes the signal at the stated noise, one panel an effect; "
            "dots: signals of 2 to 6, reached by scaling the noise; the upright line: the size that was planted."
        )
        blocks.append(drawing(f"power-{number}", power_figure(entry["power"], alpha), caption))
    return Section(f"table-{number}", f"Records of {name}", (*blocks, *found.values()))
