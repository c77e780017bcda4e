"""Bird shapes over time: one column a model, one row an instant, all on one scale."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib import colormaps
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LinearSegmentedColormap, Normalize
from matplotlib.figure import Figure

from birdstrike.data.histories import Snapshot
from birdstrike.reports.figures.quantities import milliseconds, shown
from birdstrike.reports.figures.style import WIDE, styled
from birdstrike.reports.figures.views import (
    BETWEEN,
    ENDS,
    Scene,
    column_width,
    dot_area,
    draw_bird,
    draw_section,
    grid_of_views,
    head_of,
    nearest,
    part_legend,
    window,
)

# Even steps of lightness, dark is high: safe for all kinds of colour vision and in a black-and-white print.
PRESSURE_COLOURS = LinearSegmentedColormap.from_list("pressure", colormaps["magma_r"](np.linspace(0.12, 0.95, 128)))


def pressure_scale(snapshots: Sequence[Snapshot]) -> Normalize:
    """From 0 to the 99th percentile of the pieces still alive: single spikes don't wash out the rest."""
    pressure = np.concatenate([s.pressure[~s.eroded] for s in snapshots])
    top = float(np.percentile(pressure, 99)) if pressure.size else 0.0
    return Normalize(0.0, max(float(shown(np.asarray(top), "Pa")[0]), 1e-3))


@styled
def shapes_figure(models: Mapping[str, Sequence[Snapshot]], instants: Sequence[float], scene: Scene) -> Figure:
    """models: title -> snapshots; instants: [s], the nearest snapshot is shown."""
    chosen = {title: [nearest(snapshots, t) for t in instants] for title, snapshots in models.items()}
    every = [snapshot for snapshots in chosen.values() for snapshot in snapshots]
    norm = pressure_scale(every)
    x_limits, z_limits = window(every, scene)
    columns, rows, names = len(models), len(instants), scene.sheets.names
    cell = column_width(columns, WIDE if columns > 1 else WIDE / 2 + 0.8)
    paint = {"s": dot_area(scene.spacing, cell, x_limits), "cmap": PRESSURE_COLOURS, "norm": norm}
    heights = [cell * float(np.ptp(z_limits) / np.ptp(x_limits))] * rows
    figure, grid, (below,) = grid_of_views(columns, cell, heights, [BETWEEN] * (rows - 1), 1, head_of(names))
    part_legend(figure, names)
    for column, (title, snapshots) in enumerate(chosen.items()):
        grid[0, column].set_title(title[:1].upper() + title[1:], fontsize=8.5)
        for row, snapshot in enumerate(snapshots):
            axes = grid[row, column]
            draw_section(axes, snapshot, scene)
            draw_bird(axes, snapshot, (2, scene.up), paint, shown(snapshot.pressure, "Pa")[0], scene.middle)
            axes.set(xlim=x_limits, ylim=z_limits, aspect="equal")
            axes.grid(False)
            time = float(milliseconds(np.asarray(snapshot.time)))
            axes.text(0.98, 0.96, f"{time:.2f} ms", transform=axes.transAxes, ha="right", va="top", fontsize=8)
        grid[-1, column].set_xlabel("x [mm]")
    figure.supylabel("Height above the plate [mm]", x=0.08 / figure.get_figwidth(), ha="left", fontsize=9.0)
    bar = figure.colorbar(ScalarMappable(norm, PRESSURE_COLOURS), below, orientation="horizontal", **ENDS)
    bar.set_label("Simulated pressure in the bird [MPa]")
    return figure
