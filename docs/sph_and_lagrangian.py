"""The same impact with an SPH and a Lagrangian bird: their figures side by side, and docs/sph_and_lagrangian.png.

python docs/sph_and_lagrangian.py [--case reference_strike] [--out docs/sph_and_lagrangian.png]

Front views (x-z), one column a bird: particles as balls, hexahedra by their outer faces.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import EllipseCollection, PolyCollection
from matplotlib.colors import LinearSegmentedColormap, Normalize
from matplotlib.figure import Figure
from numpy.typing import NDArray

from birdstrike.data.histories import Array, Histories, Snapshot
from birdstrike.reports.figures.quantities import milliseconds, quantity, shown
from birdstrike.reports.figures.style import GREY, png, styled
from birdstrike.reports.figures.views import mid_line
from birdstrike.solver.case.case import Case, load_case
from birdstrike.solver.simulate import simulate

METHODS = {"SPH": "sph", "Lagrangian hexahedra": "hexahedra"}
INSTANTS = "['0.5 ms', '1 ms', '1.5 ms', '2 ms']"
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
    """An arrow along the velocity of the bird's tail, which the impact has not yet reached, with its speed."""
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


def simulated(name: str, method: str) -> tuple[Case, Histories, float]:
    """The case with a bird of this method, its histories and the processor time that they took [s]."""
    case = load_case(name, {"bird.method": method, "time.snapshots": INSTANTS})
    started = time.process_time()
    histories = simulate(case, threads=1)
    return case, histories, time.process_time() - started


def note(histories: Histories) -> str:
    """Pieces, peak, impulse and eroded mass of a simulation in one line."""
    summary, force = histories.summary, histories.channels["contact_force"]
    pieces = f"{summary['particles']} {'elements' if 'nodes' in summary else 'particles'}"
    peak = summary["peak"]["displacement_centre"]
    impulse = float(np.trapezoid(force, histories.time))
    eroded = summary["eroded_mass_fraction"]
    return (
        f"{pieces}; plate's centre {quantity(peak['value'], 'm')} at {quantity(peak['time'], 's')}; "
        f"impulse {impulse:.1f} N s; {f'{eroded:.1%} of the mass' if eroded else 'nothing'} eroded"
    )


def main(arguments: list[str] | None = None) -> None:
    """Run both simulations, print their figures and write the picture."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--case", default="reference_strike")
    parser.add_argument("--out", type=Path, default=Path("docs/sph_and_lagrangian.png"))
    chosen = parser.parse_args(arguments)
    runs = {title: simulated(chosen.case, method) for title, method in METHODS.items()}
    for title, (_, histories, cost) in runs.items():
        sys.stdout.write(f"{title}: {note(histories)}; {histories.summary['steps']} steps, {cost:.0f} s of one core\n")
    case, particles, _ = runs["SPH"]
    spacing = (case.bird.volume / particles.summary["particles"]) ** (1.0 / 3.0)
    snapshots = {title: histories.snapshots for title, (_, histories, _) in runs.items()}
    notes = {title: note(histories) for title, (_, histories, _) in runs.items()}
    figure = bird_surfaces_figure(snapshots, notes, case.plate.thickness, spacing)
    chosen.out.write_bytes(png(figure))


if __name__ == "__main__":
    main()
