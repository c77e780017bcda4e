"""Mesh convergence: the curve on each mesh with the numerical uncertainty, and its scalars against spacing."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from birdstrike.inversion.mesh_convergence.convergence import MeshConvergence
from birdstrike.inversion.mesh_convergence.grid_convergence import GridConvergence
from birdstrike.inversion.mesh_convergence.scalars import Scalar
from birdstrike.reports.figures.quantities import labelled, milliseconds, shown_readings, significant, words
from birdstrike.reports.figures.style import (
    BLACK,
    BLUE,
    GREEN,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    WIDE,
    legend_above,
    styled,
)

_COLOURS = (BLUE, ORANGE, GREEN, PURPLE, VERMILION, BLACK)


@styled
def convergence_figure(found: MeshConvergence) -> Figure:
    """One row of curves a sensor, then a row of scalars against the bird's spacing."""
    names, numbers = list(found.curves), list(found.scalars.values())
    rows = len(names) + -(-len(numbers) // 2)
    figure = Figure(figsize=(WIDE, 2.5 * rows), layout="constrained")
    grid = figure.add_gridspec(rows, 2)
    curves = [figure.add_subplot(grid[row, :]) for row in range(len(names))]
    for axes, name in zip(curves, names, strict=True):
        _curve(axes, found, name)
    for i, (scalar, entry, values) in enumerate(numbers):
        _scalar(figure.add_subplot(grid[len(names) + i // 2, i % 2]), found, scalar, entry, values)
    legend_above(curves[0], columns=2)
    return figure


def _curve(axes: Axes, found: MeshConvergence, name: str) -> None:
    own = found.histories[found.user]
    time, band = milliseconds(own.time), found.curves[name].bands[found.own]
    low, high = (shown_readings(own.channels[name] + side * band, own.units[name])[0] for side in (-1.0, 1.0))
    axes.fill_between(time, low, high, color=SKY, alpha=0.35, linewidth=0, label="numerical uncertainty of your mesh")
    for i, (mesh, histories) in enumerate(zip(found.meshes, found.histories, strict=True)):
        label = f"{mesh.particles} particles, {mesh.elements[0]} × {mesh.elements[1]} shells"
        values, unit = shown_readings(histories.channels[name], own.units[name])
        yours = " (your mesh)" if i == found.user else ""
        axes.plot(time, values, color=_COLOURS[i], linewidth=1.6 if yours else 1.1, label=label + yours)
        axes.set_ylabel(labelled(name, unit))
    axes.set_xlim(time[0], time[-1])
    axes.set_xlabel("Time [ms]")


def _scalar(
    axes: Axes, found: MeshConvergence, scalar: Scalar, entry: GridConvergence, values: tuple[float, ...]
) -> None:
    spacings = 1e3 * np.array([mesh.bird_spacing for mesh in found.meshes])
    numbers, unit = shown_readings(np.array(values), scalar.unit)
    axes.plot(spacings, numbers, "o", color=BLACK, markersize=5, mfc="white", zorder=3)
    error = shown_readings(np.array([entry.uncertainties[found.own]]), scalar.unit)[0]
    own = slice(found.user, found.user + 1)
    axes.errorbar(spacings[own], numbers[own], yerr=error, color=BLUE, fmt="o", markersize=5, capsize=3)
    if entry.extrapolated is not None and entry.order_used is not None:
        exact = float(shown_readings(np.array([entry.extrapolated]), scalar.unit)[0][0])
        h = np.linspace(0.0, spacings[-1], 60)
        slope = (numbers[found.used[0]] - exact) / spacings[found.used[0]] ** entry.order_used
        axes.plot(h, exact + slope * h**entry.order_used, color=VERMILION, linewidth=1.0, linestyle="--")
        axes.plot(0.0, exact, "D", color=VERMILION, markersize=5)
        axes.annotate(f"{significant(exact, 4)} {unit}", (0.0, exact), (6, 4), textcoords="offset points", fontsize=8)
    axes.set_title(f"{words(scalar.name)}\n{entry.behaviour}{order_words(entry)}", fontsize=8.5)
    axes.set_xlim(-0.04 * spacings[-1], 1.06 * spacings[-1])
    axes.margins(y=0.2)
    axes.set_xlabel("Bird's particle spacing [mm]")
    axes.set_ylabel(f"[{unit}]")


def order_words(entry: GridConvergence) -> str:
    """The order that was observed and, where it is another, the one of the curve that is drawn; "" without one."""
    if entry.order is None or entry.order_used is None:
        return ""
    used = "" if f"{entry.order_used:.2f}" == f"{entry.order:.2f}" else f"; curve: order {entry.order_used:.3g}"
    return f", observed order {entry.order:.2f}{used}"
