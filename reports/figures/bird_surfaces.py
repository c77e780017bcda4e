"""Front views (x-z) of strikes side by side, one column a bird: particles as balls, hexahedra by their outer faces."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import EllipseCollection, PolyCollection
from matplotlib.colors import LinearSegmentedColormap, Normalize
from matplotlib.figure import Figure
from numpy.typing import NDArray

from birdstrike.data.histories import Array, Snapshot
from birdstrike.reports.figures.quantities import milliseconds, shown
from birdstrike.reports.figures.style import GREY, styled
from birdstrike.reports.figures.views import mid_line

SPEED_COLOURS = LinearSegmentedColormap.from_list("speed", colormaps["magma"](np.linspace(0.15, 0.97, 256)))
FACES = np.array([[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [3, 7, 6, 2], [0, 4, 7, 3], [1, 2, 6, 5]])
"""Nodes of a hexahedron's six faces, normals outwards."""

LIGHT = np.array([-0.35, -0.75, 0.56])  # towards the lamp: above, in front, a little to the left
DEPTH_SHADE = 0.4  # darkest share of a ball's colour, on the far side of the bird
PLATE_FACE, PLATE_EDGE = "#B4C1CC", "#46535E"


def outer_faces(cells: NDArray[np.int64]) -> NDArray[np.int64]:
    """Faces (f, 4) that belong to one cell only, of cells (k, 8)."""
    faces = cells[:, FACES].reshape(-1, 4)
    _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    return faces[first[count == 1]]


@styled
def bird_surfaces_figure(
    birds: Mapping[str, Sequence[Snapshot]], notes: Mapping[str, str], thickness: float, spacing: float
) -> Figure:
    """One row an instant, one column a bird, all on one scale; coloured by speed, eroded pieces grey.

    birds: title -> snapshots at the same instants; notes: title -> line under the title; thickness: of the plate [m];
    spacing: diameter at which particles are drawn [m].
    """
    norm = Normalize(*_speeds(birds))
    rows = min(len(snapshots) for snapshots in birds.values())
    x_limits, z_limits = _window(birds)
    cell = 5.1
    height = rows * cell * float(np.ptp(z_limits) / np.ptp(x_limits)) + 1.35
    figure = Figure(figsize=(2 * cell + 0.9, height), layout="constrained")
    grid = figure.subplots(rows, len(birds), sharex=True, sharey=True, squeeze=False)
    for column, (title, snapshots) in enumerate(birds.items()):
        for row in range(rows):
            axes = grid[row, column]
            _plate(axes, snapshots[row], thickness)
            _bird(axes, snapshots[row], norm, spacing)
            time = float(milliseconds(np.asarray(snapshots[row].time)))
            axes.text(0.985, 0.94, f"{time:.1f} ms", transform=axes.transAxes, ha="right", va="top", weight="bold")
            axes.set(xlim=x_limits, ylim=z_limits, aspect="equal")
            axes.grid(False)
        grid[0, column].set_title(f"{title}\n")
        line = {"transform": grid[0, column].transAxes, "color": "#444444", "fontsize": 8.0}
        grid[0, column].text(0.0, 1.025, notes[title], **line).set_in_layout(False)
        grid[-1, column].set_xlabel("x along the plate's length [mm]")
        _flight(grid[0, column], snapshots[0])
    for axes in grid[:, 0]:
        axes.set_ylabel("z [mm]")
    shape = {"location": "bottom", "aspect": 60, "pad": 0.012, "fraction": 0.03, "extend": "both"}
    bar = figure.colorbar(ScalarMappable(norm, SPEED_COLOURS), ax=grid, **shape)
    bar.set_label("Simulated speed in the bird [m/s]")
    return figure


def _flight(axes: Axes, snapshot: Snapshot) -> None:
    """An arrow along the velocity of the bird's tail, which the strike has not yet reached, with its speed."""
    tail = snapshot.particles[:, 2] >= np.percentile(snapshot.particles[:, 2], 90.0)
    velocity, nose = snapshot.velocity[tail].mean(axis=0), snapshot.particles[:, 0].max()
    speed = float(np.linalg.norm(velocity))
    start = 1e3 * np.array([nose - 0.06, snapshot.particles[tail, 2].mean()])
    end = start + 60.0 * velocity[[0, 2]] / speed
    axes.annotate(
        "", xy=tuple(end), xytext=tuple(start), arrowprops={"arrowstyle": "-|>", "color": "#222222", "lw": 1.3}
    )
    axes.text(start[0] + 34.0, start[1] - 8.0, f"{speed:.1f} m/s", fontsize=8.5, color="#222222")


def _speeds(birds: Mapping[str, Sequence[Snapshot]]) -> tuple[float, float]:
    """Range of speeds to tens of m/s [m/s]; the few slowest and fastest pieces saturate."""
    speeds = [np.linalg.norm(s.velocity[~s.eroded], axis=1) for snapshots in birds.values() for s in snapshots]
    low, high = np.percentile(np.concatenate(speeds), (0.5, 99.5)) / 10.0
    return 10.0 * float(np.floor(low)), 10.0 * float(np.ceil(high))


def _window(birds: Mapping[str, Sequence[Snapshot]]) -> tuple[Array, Array]:
    """x and z limits [mm] that hold the plate and all but the last stray pieces of the birds."""
    pieces = np.concatenate([s.particles[~s.eroded] for snapshots in birds.values() for s in snapshots])
    nodes = np.concatenate([s.nodes for snapshots in birds.values() for s in snapshots])
    low, high = np.percentile(pieces, (0.1, 99.9), axis=0)
    x = np.array([min(low[0], nodes[:, 0].min()) - 0.012, max(high[0], nodes[:, 0].max()) + 0.012])
    z = np.array([min(nodes[:, 2].min(), 0.0) - 0.02, high[2] + 0.022])
    return 1e3 * x, 1e3 * z


def _plate(axes: Axes, snapshot: Snapshot, thickness: float) -> None:
    """Section of the plate along its long mid line, to scale, its edges held."""
    line = mid_line(snapshot.nodes)
    x, z = shown(snapshot.nodes[line, 0], "m")[0], shown(snapshot.nodes[line, 2], "m")[0]
    half = 0.5e3 * thickness
    axes.fill_between(x, z - half, z + half, color=PLATE_FACE, edgecolor=PLATE_EDGE, linewidth=0.7, zorder=1)
    for end, side in ((x[0], -1.0), (x[-1], 1.0)):
        axes.fill_between([end, end + 8.0 * side], -1.8 * half, 1.8 * half, color=PLATE_EDGE, linewidth=0.0, zorder=1)


def _bird(axes: Axes, snapshot: Snapshot, norm: Normalize, spacing: float) -> None:
    if len(snapshot.cells):
        _faces(axes, snapshot, norm)
    else:
        _balls(axes, snapshot, norm, spacing)


def _balls(axes: Axes, snapshot: Snapshot, norm: Normalize, spacing: float) -> None:
    """Particles at their true size, the nearest to the viewer last and brightest."""
    order = np.argsort(-snapshot.particles[:, 1], kind="stable")
    where, gone = snapshot.particles[order], snapshot.eroded[order]
    depth = (where[:, 1] - where[:, 1].min()) / max(float(np.ptp(where[:, 1])), 1e-9)
    colours = SPEED_COLOURS(norm(np.linalg.norm(snapshot.velocity[order], axis=1)))
    colours[gone] = (0.55, 0.55, 0.55, 1.0)
    colours[:, :3] *= (1.0 - DEPTH_SHADE * depth**0.8)[:, None]
    edges = colours.copy()
    edges[:, :3] *= 0.55
    size = np.full(len(where), 1e3 * spacing)
    place = {"units": "xy", "offsets": shown(where[:, [0, 2]], "m")[0], "offset_transform": axes.transData}
    paint = {"facecolors": colours, "edgecolors": edges, "linewidths": 0.25, "zorder": 2}
    axes.add_collection(EllipseCollection(size, size, np.zeros(len(where)), **place, **paint))


def _faces(axes: Axes, snapshot: Snapshot, norm: Normalize) -> None:
    """Outer faces that look at the viewer, lit, the nearest last; freed nodes as grey dots."""
    faces = outer_faces(snapshot.cells)
    points = snapshot.particles[faces]
    normal = np.cross(points[:, 2] - points[:, 0], points[:, 3] - points[:, 1])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
    speed = np.linalg.norm(snapshot.velocity, axis=1)[faces].mean(axis=1)
    towards = normal[:, 1] < 0.0
    order = np.flatnonzero(towards)[np.argsort(-points[towards][:, :, 1].mean(axis=1), kind="stable")]
    light = 0.62 + 0.45 * np.clip(normal[order] @ LIGHT, 0.0, 1.0)
    colours = SPEED_COLOURS(norm(speed[order]))
    colours[:, :3] = np.clip(colours[:, :3] * light[:, None], 0.0, 1.0)
    edges = colours.copy()
    edges[:, :3] *= 0.55
    outlines = shown(points[order][:, :, [0, 2]], "m")[0]
    axes.add_collection(PolyCollection(list(outlines), facecolors=colours, edgecolors=edges, linewidths=0.3, zorder=2))
    free = shown(snapshot.particles[snapshot.eroded], "m")[0]
    axes.scatter(free[:, 0], free[:, 2], s=1.5, color=GREY, linewidths=0, zorder=1.5)
