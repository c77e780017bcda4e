"""How a result shows itself: one line, and in a notebook a table with a picture. Nothing here needs a notebook."""

from __future__ import annotations

import base64
import html
from abc import abstractmethod
from collections.abc import Callable, Collection, Sequence
from io import BytesIO
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.errors import UserError
from birdstrike.data.units import display, of_reading, rounded

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

Array = NDArray[np.floating[Any]]

MOST_ROWS = 12  # of a table in a notebook
WIDTH, HEIGHT = 4.6, 2.6  # in, of one drawing in a notebook's picture


class Displayed:
    """A result with a short `repr`, and `_repr_html_` for notebooks."""

    @property
    @abstractmethod
    def headline(self) -> str:
        """One line: what it is, how large, what it found."""

    @abstractmethod
    def to_dataframe(self) -> pd.DataFrame:
        """Its figures as a table, SI."""

    @abstractmethod
    def draw(self) -> Sequence[Callable[[Axes], Any]]:
        """What its picture in a notebook is made of, a function for each drawing."""

    def brief(self) -> pd.DataFrame:
        """The table that a notebook shows."""
        return self.to_dataframe()

    def __repr__(self) -> str:
        return f"<{self.headline}>"

    def _repr_html_(self) -> str:
        table = self.brief()
        more = f"<p>{len(table) - MOST_ROWS} more rows: to_dataframe()</p>" if len(table) > MOST_ROWS else ""
        shown = table.head(MOST_ROWS).to_html(index=False, border=0, float_format=lambda x: rounded(x, 4), na_rep="–")
        return f"<p><b>{html.escape(self.headline)}</b></p>{shown}{more}{picture(self.draw())}"


def picture(drawings: Sequence[Callable[[Axes], Any]]) -> str:
    """An image with the drawings side by side, as HTML that stands alone; empty for none."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    if not drawings:
        return ""
    figure = Figure(figsize=(WIDTH * len(drawings), HEIGHT), layout="constrained", dpi=80)
    FigureCanvasAgg(figure)
    for draw, axes in zip(drawings, np.atleast_1d(figure.subplots(1, len(drawings))), strict=True):
        draw(axes)
    file = BytesIO()
    figure.savefig(file, format="png", metadata={"Software": None})
    data = base64.b64encode(file.getvalue()).decode("ascii")
    return f'<img alt="curves" style="max-width: 100%" src="data:image/png;base64,{data}">'


def own_axes(axes: Axes | None) -> Axes:
    """The axes given, or new ones in a figure of pyplot."""
    if axes is not None:
        return axes
    from matplotlib import pyplot as plt

    return plt.subplots(layout="constrained")[1]


def shown_channel(channel: str | None, there: Collection[str]) -> str:
    """The channel that is asked for, the first of those there where none is; raises UserError for another name."""
    if channel in there or (channel is None and there):
        return channel or next(iter(there))
    raise UserError(f'no channel "{channel or ""}"; the channels are: {", ".join(there) or "none"}')


def draw_curves(axes: Axes, time: Array, curves: Array, channel: str, si: str, **look: Any) -> Axes:
    """Readings (m,) or (n, m) SI over time [s], in the units in which engineers read them."""
    factor, unit = display(1.0, of_reading(si))
    axes.plot(1e3 * time, factor * np.atleast_2d(curves).T, **look)
    axes.set_xlabel("time [ms]")
    axes.set_ylabel(f"{channel.replace('_', ' ')} [{unit}]")
    return axes
