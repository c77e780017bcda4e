"""Curves that the page can hide and read: which switch each belongs to, and where its values lie in the drawing."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from birdstrike.reports.figures.style import BLACK, BLUE, GREEN, ORANGE, PURPLE, SKY, VERMILION

MARK = "switch-"
MOST_POINTS, DIGITS = 700, 5

RECORD, CAMPAIGN = "record", "campaign"
CALIBRATED, PUBLISHED = "calibrated", "published"

COLOURS: Mapping[str, str] = {
    RECORD: BLACK,
    "elastic": ORANGE,
    "plastic_kinematic": PURPLE,
    "hydrodynamic": GREEN,
    "network": VERMILION,
    "emulator": BLUE,
    CAMPAIGN: SKY,
    CALIBRATED: BLACK,
    PUBLISHED: BLACK,
}
"""Switch -> its colour in every figure, in the order of the page's row of switches.

Of the page of calibrated models each bird model has a colour, and the two switches are told by their lines' widths.
"""

WIDTHS: Mapping[str, float] = {CALIBRATED: 2.2, PUBLISHED: 0.9}
"""Switch of several bird models -> width of its lines, which tells it, in points."""

DASHES: Mapping[str, Any] = {
    "elastic": (0, (1.2, 1.2)),
    "plastic_kinematic": (0, (6, 1.5, 1.2, 1.5)),
    "hydrodynamic": (0, (9, 2.5)),
    "network": "-",
    "emulator": (0, (5, 2)),
}
"""Switch -> its dashes: the curves stay apart in a black-and-white print."""


def switch(key: str, title: str) -> dict[str, str]:
    """A switch of the page's row: its title, and its line's colour, dashes as SVG has them, and width."""
    dashes = DASHES.get(key, "-")
    short = "none" if isinstance(dashes, str) else " ".join(f"{1.2 * length:.3g}" for length in dashes[1])
    width = f"{WIDTHS.get(key, 2.4)}"
    return {"key": key, "title": title, "colour": COLOURS[key], "dashes": short, "width": width}


def look(key: str) -> dict[str, Any]:
    """Colour, dashes and switch of a curve, for `plot`."""
    return {"color": COLOURS[key], "linestyle": DASHES.get(key, "-"), "gid": MARK + key}


def switch_of(artist: Artist) -> str | None:
    """The switch that shows and hides an artist; None for what always stays."""
    gid = artist.get_gid() or ""
    return gid.removeprefix(MARK) if gid.startswith(MARK) else None


def switches_in(figure: Figure) -> tuple[str, ...]:
    """Switches that act on a figure, in the page's order."""
    found = {switch_of(artist) for artist in figure.findobj()}
    return tuple(key for key in COLOURS if key in found)


def mark_legends(figure: Figure) -> None:
    """Give every entry of a legend the switch of the curve that it names, so that both go together."""
    named = {str(artist.get_label()): artist.get_gid() for axes in figure.axes for artist in axes.get_children()}
    for legend in figure.legends:
        for handle, text in zip(legend.legend_handles, legend.get_texts(), strict=True):
            for part in (handle, text):
                if part is not None:
                    part.set_gid(named.get(text.get_text()))


def with_switches(svg: str) -> str:
    """An SVG in which marked groups carry `data-switch` in place of an id that several share."""
    return re.sub(rf'\bid="[\w-]*?{MARK}([a-z_]+)"', r'data-switch="\1"', svg)


def readings(figure: Figure) -> list[dict[str, Any]]:
    """What the pointer can read, one entry an axes with marked curves.

    box: left, top, width, height in the drawing's points; span: values of x at its left and right; label: its y axis;
    curves: switch, x and y in the axes' units, gaps null; title and colour where a switch has several bird models.
    The figure must have been laid out.
    """
    return [entry for axes in figure.axes if (entry := _axes_readings(figure, axes))["curves"]]


def _axes_readings(figure: Figure, axes: Axes) -> dict[str, Any]:
    box, points = axes.get_window_extent(), 72.0 / figure.dpi
    top = figure.get_figheight() * 72.0 - box.y1 * points
    return {
        "box": [round(value, 2) for value in (box.x0 * points, top, box.width * points, box.height * points)],
        "span": [float(f"{value:.6g}") for value in axes.get_xlim()],
        "label": axes.get_ylabel(),
        "unit": _unit("".join(other.get_xlabel() for other in axes.get_shared_x_axes().get_siblings(axes))),
        "curves": list(_curves(axes)),
    }


def _unit(label: str) -> str:
    """What stands in square brackets: `Time [ms]` -> `ms`."""
    found = re.search(r"\[([^\]]*)\]", label)
    return found[1] if found else ""


def _curves(axes: Axes) -> Iterator[dict[str, Any]]:
    """Marked lines of more than one point, thinned to what a screen shows."""
    for line in axes.lines:
        key = switch_of(line)
        if key is not None and len(np.atleast_1d(line.get_xdata())) > 1:
            own = {"title": line.get_label(), "colour": to_hex(line.get_color())} if key in WIDTHS else {}
            yield {"switch": key, **own, **_points(line)}


def _points(line: Line2D) -> dict[str, list[float | None]]:
    x, y = (np.asarray(data, dtype=float) for data in (line.get_xdata(), line.get_ydata()))
    kept = np.unique(np.linspace(0, len(x) - 1, min(len(x), MOST_POINTS)).round().astype(int))
    return {"x": [_short(v) for v in x[kept]], "y": [_short(v) for v in y[kept]]}


def _short(value: float) -> float | None:
    return float(f"{value:.{DIGITS}g}") if np.isfinite(value) else None
