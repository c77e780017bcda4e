"""Side views of the strike: bird and plate to scale, and below them the plate's displacement magnified."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LinearSegmentedColormap, Normalize
from matplotlib.figure import Figure
from numpy.typing import NDArray

from data.histories import Array, Snapshot
from reports.figures.quantities import milliseconds, shown
from reports.figures.style import BLUE, GREY, WIDE, styled

BELOW = -0.025  # m: height at which the magnified displacement is drawn, clear of the plate itself

# Even steps of lightness, dark is high: safe for all kinds of colour vision and in a black-and-white print.
PRESSURE_COLOURS = LinearSegmentedColormap.from_list("pressure", colormaps["magma_r"](np.linspace(0.12, 0.95, 128)))


def push_direction(snapshots: Sequence[Snapshot]) -> float:
    """+1 or -1: the sense of z in which the bird first flies, so that pictures show it coming from above."""
    return float(np.sign(snapshots[0].velocity[:, 2].mean()) or -1.0)


def magnification(snapshots: Sequence[Snapshot], resting: Array) -> int:
    """A round factor that draws the largest deflection at up to 45 mm of the picture's own scale."""
    largest = max(float(np.abs(s.nodes[:, 2] - resting[:, 2]).max()) for s in snapshots)
    return max((factor for factor in (1, 2, 5, 10, 20, 50, 100) if factor * largest <= 0.045), default=1)


def mid_line(resting: Array) -> NDArray[np.intp]:
    """Numbers of the nodes on the plate's long mid line (the row nearest y = 0), in order of x."""
    nearest = resting[np.argmin(np.abs(resting[:, 1])), 1]
    row = np.flatnonzero(np.isclose(resting[:, 1], nearest, rtol=0.0, atol=1e-6))
    return row[np.argsort(resting[row, 0])]


@styled
def strike_figure(snapshots: Sequence[Snapshot], resting: Array, thickness: float) -> Figure:
    """Side views at up to four instants on one scale; `resting` (m, 3) [m]: the plate's nodes before the strike."""
    chosen = list(snapshots)[:4]
    up, factor, norm = -push_direction(chosen), magnification(chosen, resting), pressure_scale(chosen)
    x_limits, z_limits = _limits(chosen, resting, up, factor)
    columns = min(2, len(chosen))
    rows = -(-len(chosen) // columns)
    cell = (WIDE - 1.5) / columns
    height = rows * (cell * float(np.ptp(z_limits) / np.ptp(x_limits)) + 0.42) + 0.3
    figure = Figure(figsize=(WIDE, height), layout="constrained")
    grid = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    for axes, snapshot in zip(grid.flat, chosen, strict=False):
        _bird(axes, snapshot, up, norm)
        _plate(axes, snapshot, resting, up, factor, thickness)
    grid[0, 0].set(xlim=x_limits, ylim=z_limits)
    for axes in grid.flat[len(chosen) :]:
        axes.set_axis_off()
    for axes in grid[-1]:
        axes.set_xlabel("x along the plate's length [mm]")
    for axes in grid[:, 0]:
        axes.set_ylabel("Height [mm]")
    bar = figure.colorbar(ScalarMappable(norm, PRESSURE_COLOURS), ax=grid, pad=0.015, aspect=30, extend="both")
    bar.set_label("Simulated pressure in the bird [MPa]")
    return figure


def pressure_scale(snapshots: Sequence[Snapshot]) -> Normalize:
    """From 0 to the 99th percentile of the particles still in one piece: single spikes don't wash out the rest."""
    pressure = np.concatenate([s.pressure[~s.eroded] for s in snapshots])
    top = float(np.percentile(pressure, 99)) if pressure.size else 0.0
    return Normalize(0.0, max(float(shown(np.asarray(top), "Pa")[0]), 1e-3))


def _limits(snapshots: Sequence[Snapshot], resting: Array, up: float, factor: int) -> tuple[Array, Array]:
    """x and height limits [mm] around plate and bird; particles that fly far off don't shrink the rest."""
    particles = np.concatenate([s.particles[~s.eroded] for s in snapshots])
    edge = float(np.abs(resting[:, 0]).max())
    low, high = np.percentile(particles[:, 0], (0.5, 99.5))
    x = np.array([max(min(low, -edge), -1.6 * edge) - 0.02, min(max(high, edge), 1.6 * edge) + 0.02])
    bend = np.concatenate([up * factor * (s.nodes[:, 2] - resting[:, 2]) for s in snapshots])
    top = float(np.percentile(up * particles[:, 2], 99.5))
    return x * 1e3, np.array([BELOW + min(bend.min(), 0.0) - 0.015, max(top, 0.0) + 0.02]) * 1e3


def _bird(axes: Axes, snapshot: Snapshot, up: float, norm: Normalize) -> None:
    """Particles by pressure, those of the middle plane last, so that one looks into the bird; eroded ones grey."""
    order = np.argsort(np.abs(snapshot.particles[:, 1]))[::-1]
    where, alive = shown(snapshot.particles[order], "m")[0], ~snapshot.eroded[order]
    pressure = shown(snapshot.pressure[order], "Pa")[0]
    axes.scatter(where[~alive, 0], up * where[~alive, 2], s=2.5, color=GREY, linewidths=0)
    dots = {"s": 5.0, "cmap": PRESSURE_COLOURS, "norm": norm, "linewidths": 0}
    axes.scatter(where[alive, 0], up * where[alive, 2], c=pressure[alive], **dots)
    axes.set_title(f"Simulated, {float(milliseconds(np.asarray(snapshot.time))):.2f} ms")
    axes.set_aspect("equal", adjustable="box")


def _plate(axes: Axes, snapshot: Snapshot, resting: Array, up: float, factor: int, thickness: float) -> None:
    """The plate's middle section to scale, and below it the displacement of its mid line, magnified."""
    line = mid_line(resting)
    rest, now = up * shown(resting[line, 2], "m")[0], up * shown(snapshot.nodes[line, 2], "m")[0]
    x, half = shown(snapshot.nodes[line, 0], "m")[0], float(shown(np.asarray(thickness / 2), "m")[0])
    axes.fill_between(x, now - half, now + half, color="#9FB4C4", linewidth=0.5, edgecolor="#4A5A66")
    below = float(shown(np.asarray(BELOW), "m")[0])
    axes.plot(x, np.full(x.size, below), color=GREY, linewidth=0.8, linestyle="--")
    axes.plot(x, below + factor * (now - rest), color=BLUE, linewidth=1.8)
    axes.text(0.02, 0.04, f"displacement × {factor}", color=BLUE, fontsize=8, transform=axes.transAxes)
