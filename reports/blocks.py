"""What a page is made of: paragraphs, warnings, tables, pictures and the animation, gathered in sections."""

from __future__ import annotations

import base64
import json
import re
from dataclasses import dataclass
from html import escape
from typing import Literal

from matplotlib.figure import Figure

from birdstrike.reports.figures.style import inline_svg, pixels, png
from birdstrike.reports.figures.switches import mark_legends, readings, switches_in, with_switches


@dataclass(frozen=True)
class Paragraph:
    """Plain words."""

    text: str
    kind: Literal["paragraph"] = "paragraph"


@dataclass(frozen=True)
class Warnings:
    """What the reader must know before believing the rest."""

    lines: tuple[str, ...]
    kind: Literal["warnings"] = "warnings"


@dataclass(frozen=True)
class Lines:
    """A numbered list of sentences."""

    lines: tuple[str, ...]
    kind: Literal["lines"] = "lines"


@dataclass(frozen=True)
class Table:
    """Cells are text already in the engineer's units; `numeric` columns are set flush right."""

    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    caption: str
    numeric: frozenset[int] = frozenset()
    kind: Literal["table"] = "table"


@dataclass(frozen=True)
class Picture:
    """A figure as markup for the page, its natural width in CSS pixels, and a caption that says what to see.

    switches: models that the page can hide in it; readings: JSON of the values that the pointer reads, "" for none.
    """

    name: str
    markup: str
    caption: str
    width: int
    switches: tuple[str, ...] = ()
    readings: str = ""
    kind: Literal["picture"] = "picture"


@dataclass(frozen=True)
class Animation:
    """The impact in motion: JSON for the page's own player, its size in CSS pixels, and a caption."""

    name: str
    data: str
    caption: str
    width: int
    height: int
    kind: Literal["animation"] = "animation"


Block = Paragraph | Warnings | Lines | Table | Picture | Animation


@dataclass(frozen=True)
class Section:
    """One numbered part of the page."""

    name: str
    title: str
    blocks: tuple[Block, ...]


def drawing(name: str, figure: Figure, caption: str) -> Picture:
    """A figure of lines: SVG inside the page, named by its caption, its curves open to the page's switches and pointer.

    name: may hold what a user called a shot; as a name in the page it has no space or quote.
    """
    name = re.sub(r"[^\w.-]+", "_", name)
    mark_legends(figure)
    markup, found = with_switches(inline_svg(figure, name)), readings(figure)
    markup = markup.replace('role="img"', f'role="img" aria-labelledby="caption-{name}"', 1)
    values = embedded_json(found) if found else ""
    return Picture(name, markup, caption, pixels(figure), switches_in(figure), values)


def embedded_json(content: object) -> str:
    """JSON that may stand in a script element: no text in it can close that element."""
    return json.dumps(content, separators=(",", ":")).replace("<", "\\u003c")


def photograph(name: str, figure: Figure, caption: str, alternative: str) -> Picture:
    """A figure of thousands of marks: PNG inside the page; `alternative` says in words what it shows."""
    data = base64.b64encode(png(figure)).decode("ascii")
    markup = f'<img alt="{escape(alternative)}" src="data:image/png;base64,{data}">'
    return Picture(name, markup, caption, pixels(figure))
