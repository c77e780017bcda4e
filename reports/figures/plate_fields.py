"""The plate seen from above at one instant: displacement in the direction of the push, and von Mises stress."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

from data.histories import Array, Snapshot
from reports.figures.quantities import shown
from reports.figures.style import WIDE, styled


@styled
def plate_figure(snapshot: Snapshot, resting: Array, push: float) -> Figure:
    """`resting` (m, 3) [m]: the nodes before the strike; `push` +-1: the sense of z in which the bird pushes."""
    deflection = push * (snapshot.nodes[:, 2] - resting[:, 2])
    fields = {
        "Simulated displacement [mm]": shown(deflection, "m")[0][snapshot.quads].mean(axis=1),
        "Simulated von Mises stress, largest through the thickness [MPa]": shown(snapshot.plate_stress, "Pa")[0],
    }
    slim = float(np.ptp(resting[:, 1]) / np.ptp(resting[:, 0]))
    figure = Figure(figsize=(WIDE, (WIDE - 1.0) / 2 * slim + 1.05), layout="constrained")
    grid = figure.subplots(1, 2, sharex=True, sharey=True)
    for axes, (label, values) in zip(grid, fields.items(), strict=True):
        _field(figure, axes, snapshot, resting, values, label)
    grid[0].set_ylabel("y along the plate's width [mm]")
    return figure


def _field(figure: Figure, axes: Axes, snapshot: Snapshot, resting: Array, values: Array, label: str) -> None:
    """One value a shell element in colour, the bird's particles above as faint dots, a colour bar of the same width."""
    corners = shown(resting[snapshot.quads][:, :, :2], "m")[0]
    patches = PolyCollection(list(corners), array=values, cmap="cividis", edgecolors="face", linewidths=0.3)
    axes.add_collection(patches)
    where = shown(snapshot.particles[~snapshot.eroded], "m")[0]
    axes.scatter(where[:, 0], where[:, 1], s=0.8, color="white", alpha=0.45, linewidths=0)
    axes.set_aspect("equal")
    axes.set_xlim(corners[..., 0].min(), corners[..., 0].max())
    axes.set_ylim(corners[..., 1].min(), corners[..., 1].max())
    axes.set_xlabel("x along the plate's length [mm]")
    axes.grid(False)
    bar = figure.colorbar(patches, ax=axes, location="top", aspect=35, pad=0.02)
    bar.set_label(label, fontsize=8.5)
