"""The inverted parameters on their ranges: value and 95 % interval where identified, the whole range where not."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from birdstrike.data.dataset import fraction
from birdstrike.reports.figures.quantities import bound, parameter_label
from birdstrike.reports.figures.style import METHOD_MARKERS, WIDE, legend_above, styled
from birdstrike.reports.figures.switches import COLOURS


@dataclass(frozen=True)
class Mark:
    """What to draw of one answer, SI; `value` and `interval` are None where the parameter is not identified."""

    value: float | None
    interval: tuple[float, float] | None


@dataclass(frozen=True)
class ParameterRow:
    """A parameter with its range (SI) and whether that is one of the logarithm, and method -> mark."""

    name: str
    unit: str
    low: float
    high: float
    estimates: Mapping[str, Mark]
    logarithmic: bool = False

    def share(self, value: float) -> float:
        """Place of an SI value on the range in its scale, 0..1."""
        return fraction(value, self.low, self.high, self.logarithmic)


@styled
def parameters_figure(rows: Sequence[ParameterRow]) -> Figure:
    """One bar a parameter, from its range's low end to its high end."""
    figure = Figure(figsize=(WIDE, 0.5 * len(rows) + 0.5), layout="constrained")
    axes = figure.subplots()
    for place, row in enumerate(rows):
        _bar(axes, place, row)
        offsets = {method: 0.16 * (2 * i - len(row.estimates) + 1) for i, method in enumerate(row.estimates)}
        for method, estimate in row.estimates.items():
            _estimate(axes, place + offsets[method], row, method, estimate)
    _frame(axes, rows)
    return figure


def _bar(axes: Axes, place: int, row: ParameterRow) -> None:
    """The range; hatched where no method identifies the parameter."""
    known = any(estimate.value is not None for estimate in row.estimates.values())
    axes.barh(place, 1.0, 0.62, color="#ECECEC", edgecolor="#BBBBBB", linewidth=0.6, hatch=None if known else "///")
    ends = {"va": "center", "fontsize": 8}
    axes.text(-0.012, place, bound(row.low, row.unit), ha="right", **ends)
    axes.text(1.012, place, bound(row.high, row.unit), ha="left", **ends)
    if not known:
        box = {"facecolor": "white", "edgecolor": "none", "pad": 2.0}
        axes.text(0.5, place, "not identified: anywhere in this range", ha="center", bbox=box, **ends)


def _estimate(axes: Axes, height: float, row: ParameterRow, method: str, estimate: Mark) -> None:
    if estimate.value is None:
        return
    colour = COLOURS[method]
    if estimate.interval is not None:
        ends = [row.share(end) for end in estimate.interval]
        axes.plot(ends, [height, height], color=colour, linewidth=2.2, solid_capstyle="butt")
    axes.plot(row.share(estimate.value), height, METHOD_MARKERS[method], color=colour, markersize=6)


def _frame(axes: Axes, rows: Sequence[ParameterRow]) -> None:
    names = [row.name for row in rows]
    axes.set_yticks(range(len(rows)), [parameter_label(row.name, names) for row in rows])
    axes.invert_yaxis()
    axes.set_xlim(-0.17, 1.17)
    axes.set_xticks([])
    axes.grid(False)
    axes.spines[["left", "bottom"]].set_visible(False)
    axes.tick_params(length=0)
    for method in rows[0].estimates:
        colour, marker = COLOURS[method], METHOD_MARKERS[method]
        axes.plot([], [], marker=marker, color=colour, linewidth=2.2, label=f"{method}: value and 95 % interval")
    if any(estimate.value is not None for row in rows for estimate in row.estimates.values()):
        legend_above(axes)
