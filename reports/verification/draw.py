"""Figures of the verification: a row of panels in the house style, one colour, dash and marker per curve."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from birdstrike.data.histories import Array
from birdstrike.reports.figures.style import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, VERMILION, WIDE, styled

COLOURS = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY, GREY)
PALE = "#A8A8A8"
DASHES = ("-", (0, (5, 2)), (0, (1, 1.2)), (0, (6, 2, 1, 2)), (0, (3, 1)), (0, (8, 3)), (0, (2, 2)))
MARKERS = ("o", "s", "^", "D", "v", "P", "X")


@dataclass(frozen=True)
class Curve:
    """x, y as they are shown. truth: below the others, a line broad and pale, so that one on it hides nothing.

    dots: markers instead of a line.
    """

    label: str
    x: Array | Sequence[float]
    y: Array | Sequence[float]
    truth: bool = False
    dots: bool = False


@dataclass(frozen=True)
class Panel:
    """One pair of axes; band: a grey stripe of tolerance (low, high) across it."""

    x: str
    y: str
    curves: Sequence[Curve]
    title: str = ""
    log: bool = False
    band: tuple[float, float] | None = None
    legend: bool = True


@styled
def draw(*panels: Panel, height: float = 3.3) -> Figure:
    """The panels side by side."""
    figure = Figure(figsize=(WIDE, height), layout="constrained")
    for axes, panel in zip(figure.subplots(1, len(panels), squeeze=False)[0], panels, strict=True):
        number = 0
        for curve in panel.curves:
            style = _style(curve, number)
            number += not curve.truth
            axes.plot(curve.x, curve.y, label=curve.label or None, **style)
        if panel.band is not None:
            axes.axhspan(*panel.band, color="#E8E8E8", linewidth=0, zorder=0)
        if panel.log:
            axes.set_xscale("log")
            axes.set_yscale("log")
        axes.set_xlabel(panel.x)
        axes.set_ylabel(panel.y)
        axes.set_title(panel.title)
        if panel.legend:
            axes.legend(handlelength=2.6)
    return figure


def _style(curve: Curve, number: int) -> dict[str, Any]:
    """Colour and dash of the curve; a sparse one shows its points."""
    if curve.truth:
        if curve.dots:
            return {"color": BLACK, "zorder": 1.5, "linestyle": "none", "marker": "o", "markerfacecolor": "white"}
        return {"color": PALE, "linewidth": 4.0, "zorder": 1.5, "solid_capstyle": "butt"}
    number %= len(COLOURS)
    mark = MARKERS[number] if curve.dots or len(np.asarray(curve.x)) < 12 else ""
    line = "none" if curve.dots else DASHES[number]
    return {"color": COLOURS[number], "linestyle": line, "marker": mark, "markersize": 4.5}


def slope_line(x: Sequence[float], start: float, order: float) -> Curve:
    """y = start (x/x0)^order from the first x: the order that theory promises."""
    at = np.asarray(x, dtype=float)
    return Curve(f"order {abs(order):g}", at, start * (at / at[0]) ** order, truth=True)
