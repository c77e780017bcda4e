"""The look of every figure: one sober style, Okabe and Ito's colour-blind-safe colours, one colour per role."""

from __future__ import annotations

import re
from collections.abc import Callable
from contextlib import AbstractContextManager
from functools import wraps
from io import BytesIO, StringIO
from pathlib import Path
from typing import Any, ParamSpec

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

from birdstrike.data.storage.files import whole_file

P = ParamSpec("P")

# Okabe, M. and Ito, K., Color Universal Design (2008): told apart by every common kind of colour vision.
BLACK, ORANGE, SKY, GREEN = "#000000", "#E69F00", "#56B4E9", "#009E73"
BLUE, VERMILION, PURPLE, GREY = "#0072B2", "#D55E00", "#CC79A7", "#8C8C8C"

METHOD_MARKERS = {"network": "s", "emulator": "D"}

SVG_DOTS = 72.0  # per inch: the unit of length in matplotlib's SVG is the point
WIDE = 8.6  # in: the page's column at 96 dots per inch is a little wider, so text is never scaled down

RULES: dict[str, Any] = {
    "font.family": "DejaVu Sans",  # comes with matplotlib: the same figure on every machine
    "font.size": 9.0,
    "axes.titlesize": 9.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelsize": 9.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.7,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#DDDDDD",
    "grid.linewidth": 0.5,
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "xtick.labelsize": 8.5,
    "ytick.labelsize": 8.5,
    "lines.linewidth": 1.5,
    "hatch.linewidth": 0.6,
    "svg.fonttype": "path",  # outlines: no font is looked up where the page is read
    "svg.hashsalt": "birdstrike",  # the same data give the same bytes
}


def _rules() -> AbstractContextManager[None]:
    """Matplotlib's own defaults under the house style: what a user has set elsewhere changes no figure."""
    return mpl.rc_context({**dict(mpl.rcParamsDefault), **RULES})  # pyright: ignore[reportArgumentType]


def styled(draw: Callable[P, Figure]) -> Callable[P, Figure]:
    """Draws under the house style, whatever the caller's matplotlib settings are."""

    @wraps(draw)
    def drawn(*args: P.args, **kwargs: P.kwargs) -> Figure:
        with _rules():
            return draw(*args, **kwargs)

    return drawn


def legend_above(axes: Axes, columns: int = 4) -> None:
    """The axes' legend in a row of its own above the whole figure, where it can't cover data."""
    figure = axes.get_figure(root=True)
    assert isinstance(figure, Figure)
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper left", ncols=columns, handlelength=2.2, columnspacing=1.6)


def inline_svg(figure: Figure, prefix: str) -> str:
    """The figure as an SVG element for a page; `prefix` keeps its ids apart from other figures' ids."""
    buffer = StringIO()
    with _rules():
        canvas = FigureCanvasSVG(figure)
        _lay_out(figure, SVG_DOTS)
        canvas.print_svg(buffer, metadata={"Date": None, "Creator": None})
    return _embedded(buffer.getvalue(), prefix)


def pixels(figure: Figure) -> int:
    """Width at which the figure's text has the size that it was drawn for (96 CSS pixels an inch)."""
    return round(96 * figure.get_figwidth())


def png(figure: Figure, dots_per_inch: int = 160) -> bytes:
    """The figure as PNG bytes: for pictures of thousands of particles, where SVG would weigh megabytes."""
    buffer = BytesIO()
    with _rules():
        canvas = FigureCanvasAgg(figure)
        _lay_out(figure, dots_per_inch)
        canvas.print_png(buffer, metadata={"Software": None})
    return buffer.getvalue()


def write_figure(figure: Figure, path: Path) -> None:
    """The figure as a PNG, SVG or PDF file, by the ending of its name; raises OSError, KeyError for another ending."""
    kind = path.suffix.lower().lstrip(".")
    unnamed = {"png": "Software", "svg": "Date", "pdf": "CreationDate"}[kind]  # the same figure, the same bytes
    with _rules(), whole_file(path) as temporary:
        figure.savefig(temporary, format=kind, dpi=160, metadata={unnamed: None})


def _lay_out(figure: Figure, dots_per_inch: float) -> None:
    """Place axes and labels once, for the canvas that the figure has; `savefig` would draw the whole figure twice."""
    figure.dpi = dots_per_inch
    engine = figure.get_layout_engine()
    if engine is not None:
        engine.execute(figure)
        figure.set_layout_engine("none")


def _embedded(svg: str, prefix: str) -> str:
    """Drops the XML head, metadata and fixed size, and makes every id unique to the page."""
    body = svg[svg.index("<svg") :]
    body = re.sub(r"<metadata>.*?</metadata>", "", body, flags=re.DOTALL)
    head = r'<svg xmlns="http://www.w3.org/2000/svg" role="img" \1>'
    body = re.sub(r'<svg [^>]*?(viewBox="[^"]*")[^>]*>', head, body, count=1)
    body = re.sub(r'\bid="', f'id="{prefix}-', body)
    body = re.sub(r'xlink:href="#', f'href="#{prefix}-', body)
    return body.replace("url(#", f"url(#{prefix}-")
