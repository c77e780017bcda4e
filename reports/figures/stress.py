"""Von Mises stress of bird and plate at one instant, by each bird model, from the front and from the top."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colors import LinearSegmentedColormap, LogNorm, Normalize
from matplotlib.figure import Figure

from birdstrike.data.histories import Array, Snapshot
from birdstrike.reports.figures.quantities import shown
from birdstrike.reports.figures.style import WIDE, styled
from birdstrike.reports.figures.views import (
    BETWEEN,
    ENDS,
    Scene,
    column_width,
    dot_area,
    draw_bird,
    grid_of_views,
    section_outlines,
    window,
)

BIRD_COLOURS = LinearSegmentedColormap.from_list("bird", colormaps["magma_r"](np.linspace(0.12, 0.95, 128)))
PLATE_COLOURS = colormaps["cividis"]
LOWEST, DECADES = 1e-3, 4.0  # MPa; the bird's scale spans at most so many decades below its top


@dataclass(frozen=True)
class Scales:
    """One scale of stress [MPa] for all birds, and one for all plates."""

    bird: LogNorm
    plate: Normalize

    def paint(self, dots: float) -> dict[str, Any]:
        """How the bird's pieces are drawn."""
        return {"s": dots, "cmap": BIRD_COLOURS, "norm": self.bird}


def stress_scales(snapshots: Sequence[Snapshot]) -> Scales:
    """The bird's up to the 99.5th percentile, by decades, because models differ by decades; the plate's from 0."""
    bird = shown(np.concatenate([s.bird_stress[~s.eroded] for s in snapshots]), "Pa")[0]
    bird = bird[bird > LOWEST]
    top = float(np.percentile(bird, 99.5)) if bird.size else 1.0
    low = max(float(np.percentile(bird, 2)) if bird.size else 0.1, top / 10.0**DECADES, LOWEST)
    plate = max((float(shown(s.plate_stress, "Pa")[0].max()) for s in snapshots if len(s.plate_stress)), default=1.0)
    return Scales(LogNorm(min(low, 0.5 * top), top, clip=True), Normalize(0.0, max(plate, 1e-3)))


@styled
def stress_figure(models: Mapping[str, Snapshot], scene: Scene) -> Figure:
    """models: title -> snapshot at the same instant; two models side by side, each in front and top view."""
    snapshots = list(models.values())
    scales = stress_scales(snapshots)
    x_limits, z_limits = window(snapshots, scene)
    y_limits = 1e3 * np.array([-1.04, 1.04]) * np.abs(scene.resting[:, 1]).max()
    columns, bands = min(2, len(models)), -(-len(models) // 2)
    cell, width = column_width(2, WIDE), float(np.ptp(x_limits))
    heights = [cell * float(np.ptp(z_limits)) / width, cell * float(np.ptp(y_limits)) / width] * bands
    gaps = [BETWEEN if row % 2 == 0 else 0.8 for row in range(2 * bands - 1)]
    dots = dot_area(scene.spacing, cell, x_limits)
    figure, grid, below = grid_of_views(columns, cell, heights, gaps, 2)
    for place, (title, snapshot) in enumerate(models.items()):
        row, column = 2 * (place // 2), place % 2
        _front(grid[row, column], snapshot, scene, scales, dots)
        _top(grid[row + 1, column], snapshot, scene, scales, dots)
        grid[row, column].set_title(title[:1].upper() + title[1:])
        grid[row, column].set(xlim=x_limits, ylim=z_limits, aspect="equal")
        grid[row + 1, column].set(
            xlim=x_limits, ylim=y_limits, aspect="equal", xlabel="x along the plate's length [mm]"
        )
    for spare in range(len(models), columns * bands):
        for row in (0, 1):
            grid[2 * (spare // 2) + row, spare % 2].remove()
    for row in range(2 * bands):
        grid[row, 0].set_ylabel("y [mm]" if row % 2 else "Height [mm]")
        grid[row, 0].yaxis.set_label_coords(-0.5 / cell, 0.5)
    _bars(figure, below, scales)
    return figure


def _front(axes: Axes, snapshot: Snapshot, scene: Scene, scales: Scales, dots: float) -> None:
    """Bird by its stress; the target as the plane cuts it by the stress of its shells."""
    up = scene.up
    strips, live, _ = section_outlines(snapshot, scene)
    values = shown(snapshot.plate_stress[live], "Pa")[0]
    if len(strips):
        paint = {"cmap": PLATE_COLOURS, "norm": scales.plate, "edgecolors": "face", "linewidths": 0.7, "zorder": 3}
        axes.add_collection(PolyCollection(list(strips), array=values, **paint))
    draw_bird(axes, snapshot, (2, up), scales.paint(dots), _stress(snapshot, scales), scene.middle)
    axes.grid(False)


def _top(axes: Axes, snapshot: Snapshot, scene: Scene, scales: Scales, dots: float) -> None:
    """Shells by their largest stress through the thickness, upper sheets last, and above them the bird by its own."""
    order = np.argsort(scene.up * scene.resting[snapshot.quads][:, :, 2].mean(axis=1), kind="stable")
    corners = shown(scene.resting[snapshot.quads[order]][:, :, :2], "m")[0]
    values = shown(snapshot.plate_stress[order], "Pa")[0]
    paint = {"cmap": PLATE_COLOURS, "norm": scales.plate, "edgecolors": "face", "linewidths": 0.3}
    axes.add_collection(PolyCollection(list(corners), array=values, **paint))
    draw_bird(axes, snapshot, (1, scene.up), scales.paint(dots), _stress(snapshot, scales))
    axes.grid(False)


def _stress(snapshot: Snapshot, scales: Scales) -> Array:
    """The bird's stress [MPa], what lies below the scale at its low end."""
    return np.maximum(shown(snapshot.bird_stress, "Pa")[0], float(scales.bird.vmin or LOWEST))


def _bars(figure: Figure, below: Sequence[Axes], scales: Scales) -> None:
    plate = figure.colorbar(ScalarMappable(scales.plate, PLATE_COLOURS), below[0], orientation="horizontal")
    plate.set_label("Simulated von Mises stress in the plate, largest of the layers [MPa]")
    bird = figure.colorbar(ScalarMappable(scales.bird, BIRD_COLOURS), below[1], orientation="horizontal", **ENDS)
    bird.ax.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    bird.set_label("Simulated von Mises stress in the bird [MPa]")
