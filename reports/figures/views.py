"""Bird and plate as they are looked at: from the front (x to the right, impact from above) and from the top."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import AutoLocator, NullLocator
from numpy.typing import NDArray

from birdstrike.data.histories import Array, Snapshot
from birdstrike.reports.figures.cut import Sheets, cut, strips
from birdstrike.reports.figures.quantities import shown, words
from birdstrike.reports.figures.style import GREY
from birdstrike.reports.figures.target import PART_COLOURS

LEFT, RIGHT, TOP, BETWEEN, BOTTOM, BAR = 0.65, 0.15, 0.32, 0.12, 0.55, 0.6
"""Margins of a grid of views, gap between its columns, room below it for the x axis and for each colour bar [in]."""

ENDS: Mapping[str, Any] = {"extend": "both", "extendfrac": 0.02}
"""A colour bar beyond whose ends there are values."""

PLATE_FACE = "#9FB4C4"


HALF_A_NUMBER = 0.15  # in


class InnerTicks(AutoLocator):
    """Ticks whose numbers don't reach into the next column: none within `margin` of the ends, a share of the axis."""

    def __init__(self, margin: float) -> None:
        super().__init__()
        self.margin = margin

    def __call__(self) -> Array:
        """Places on the axis, (n,)."""
        assert self.axis is not None, "set on an axis"
        low, high = sorted(self.axis.get_view_interval())
        spared, ticks = self.margin * (high - low), np.asarray(super().__call__())
        return ticks[(ticks >= low + spared) & (ticks <= high - spared)]


def push_direction(snapshots: Sequence[Snapshot]) -> float:
    """+1 or -1: the sense of z in which the bird first flies, so that pictures show it coming from above."""
    return float(np.sign(snapshots[0].velocity[:, 2].mean()) or -1.0)


def nearest(snapshots: Sequence[Snapshot], time: float) -> Snapshot:
    """The snapshot nearest an instant [s]."""
    return min(snapshots, key=lambda snapshot: abs(snapshot.time - time))


def mid_line(resting: Array) -> NDArray[np.intp]:
    """Numbers of the nodes on the plate's long mid line (the row nearest its middle), in order of x."""
    across = resting[:, 1]
    middle = across[np.argmin(np.abs(across - 0.5 * (across.min() + across.max())))]
    row = np.flatnonzero(np.isclose(resting[:, 1], middle, rtol=0.0, atol=1e-6))
    return row[np.argsort(resting[row, 0])]


def window(snapshots: Sequence[Snapshot], scene: Scene) -> tuple[Array, Array]:
    """x and height limits [mm] around plate and bird; pieces that fly far off don't shrink the rest."""
    resting, up = scene.resting, scene.up
    pieces = np.concatenate([s.particles[~s.eroded] for s in snapshots])
    left, right = float(resting[:, 0].min()), float(resting[:, 0].max())
    beyond = 0.25 * (right - left)
    low, high = np.percentile(pieces[:, 0], (0.5, 99.5)) if len(pieces) else (left, right)
    x = np.array([max(min(low, left), left - beyond) - 0.01, min(max(high, right), right + beyond) + 0.01])
    top = float((up * resting[:, 2]).max())
    top = max(top, float(np.percentile(up * pieces[:, 2], 99.5))) if len(pieces) else top
    bottom = min(float((up * s.nodes[:, 2]).min()) for s in snapshots)
    return x * 1e3, np.array([min(bottom, 0.0) - 0.02, max(top, 0.02) + 0.015]) * 1e3


@dataclass(frozen=True)
class Scene:
    """What all views of one simulation share.

    resting: (m, 3) [m], the plate's nodes before the impact; thickness: of the plate [m]; spacing: of the bird's pieces
    [m], at which they are drawn; up: +1 or -1, the sense of z that is drawn upwards, so that the bird comes from above;
    sheets: the target's facets; middle: y [m] of the plane in which the target is cut; push (3,): unit vector along
    which displacements count.
    """

    resting: Array
    thickness: float
    spacing: float
    up: float
    sheets: Sheets
    middle: float = 0.0
    push: tuple[float, float, float] = (0.0, 0.0, -1.0)


def column_width(columns: int, width: float) -> float:
    """Width [in] of each of so many columns in a figure of `width` inches."""
    return (width - LEFT - RIGHT - BETWEEN * (columns - 1)) / columns


def grid_of_views(
    columns: int, cell: float, heights: Sequence[float], gaps: Sequence[float], bars: int, head: float = 0.0
) -> tuple[Figure, NDArray[np.object_], list[Axes]]:
    """Axes of fixed size, and below them axes for colour bars: no layout has to be searched for.

    Only the first column and the rows with room below them have ticks, all views of a row or column having one scale.

    cell: width of a column; heights: of the rows; gaps: below each row but the last; head: room above the titles, all
    in inches.
    """
    width = LEFT + RIGHT + columns * cell + BETWEEN * (columns - 1)
    height = head + TOP + sum(heights) + sum(gaps) + BOTTOM + BAR * bars
    figure, top = Figure(figsize=(width, height)), height - head - TOP
    grid = np.empty((len(heights), columns), dtype=object)
    for row, (tall, gap) in enumerate(zip(heights, (*gaps, 0.0), strict=True)):
        for column in range(columns):
            left = LEFT + column * (cell + BETWEEN)
            grid[row, column] = figure.add_axes((left / width, (top - tall) / height, cell / width, tall / height))
            if column > 0:
                grid[row, column].yaxis.set_major_locator(NullLocator())
            grid[row, column].xaxis.set_major_locator(InnerTicks(HALF_A_NUMBER / cell))
            if gap == BETWEEN:
                grid[row, column].xaxis.set_major_locator(NullLocator())
        top -= tall + gap
    across = 1.0 - (LEFT + RIGHT) / width
    places = [0.47 + BAR * number for number in reversed(range(bars))]
    return figure, grid, [figure.add_axes((LEFT / width, at / height, across, 0.09 / height)) for at in places]


def dot_area(spacing: float, inches: float, limits: Array) -> float:
    """Area [points^2] of a dot as wide as `spacing` [m] where `limits` [mm] take so many inches."""
    return (1e3 * spacing * 72.0 * inches / float(np.ptp(limits))) ** 2


def draw_bird(
    axes: Axes,
    snapshot: Snapshot,
    plane: tuple[int, float],
    paint: Mapping[str, Any],
    values: Array,
    middle: float = 0.0,
) -> None:
    """Pieces as dots by `values` (n,), those nearest the viewer (or the plane y = `middle`) last; eroded ones grey.

    plane: the coordinate drawn upwards (1: top view, 2: front view) and the sense of z that is up.
    """
    upward, up = plane
    sign = up if upward == 2 else 1.0
    depth = np.abs(snapshot.particles[:, 1] - middle) if upward == 2 else -up * snapshot.particles[:, 2]
    order = np.argsort(depth)[::-1]
    where, alive = shown(snapshot.particles[order], "m")[0], ~snapshot.eroded[order]
    axes.scatter(where[~alive, 0], sign * where[~alive, upward], s=1.5, color=GREY, linewidths=0)
    axes.scatter(where[alive, 0], sign * where[alive, upward], c=values[order][alive], linewidths=0, **paint)


def section_outlines(snapshot: Snapshot, scene: Scene) -> tuple[Array, NDArray[np.intp], NDArray[np.int64]]:
    """Outlines (k, 4, 2) [mm] of the facets that the plane cuts, the place of each in snapshot and sheets."""
    segments, live = cut(snapshot.nodes, snapshot.quads, scene.middle)
    facet = scene.sheets.numbers(snapshot.quads[live])
    outlines = strips(segments, scene.sheets.thickness[facet]) * (1.0, scene.up)
    return shown(outlines, "m")[0], live, facet


def draw_section(axes: Axes, snapshot: Snapshot, scene: Scene) -> None:
    """The target as the plane cuts it, to scale: every sheet that is crossed, in its part's colour, torn ones not."""
    outlines, _, facet = section_outlines(snapshot, scene)
    colours = part_colours(scene.sheets.names)[scene.sheets.part[facet]]
    lines = {"facecolors": colours, "edgecolors": 0.72 * colours, "linewidths": 0.7, "zorder": 3}
    axes.add_collection(PolyCollection(list(outlines), **lines))


def part_colours(names: Sequence[str]) -> Array:
    """Red, green, blue (p, 3) of every part, as in the picture of the set-up; of a plate alone, that of plates."""
    if len(names) == 1:
        return np.array([to_rgb(PLATE_FACE)])
    return np.array([to_rgb(PART_COLOURS[number % len(PART_COLOURS)]) for number in range(len(names))])


def part_legend(figure: Figure, names: Sequence[str]) -> None:
    """The parts' colours along the upper edge, where there are several."""
    if len(names) > 1:
        pairs = zip(part_colours(names), names, strict=True)
        patches = [Patch(facecolor=tuple(c), edgecolor=GREY, label=words(name)) for c, name in pairs]
        figure.legend(handles=patches, loc="upper center", ncols=min(len(names), 6), handlelength=1.4)


def head_of(names: Sequence[str]) -> float:
    """Room [in] that `part_legend` takes."""
    return 0.26 * -(-len(names) // 6) if len(names) > 1 else 0.0
