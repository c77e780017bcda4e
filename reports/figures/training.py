"""The network's convergence over the epochs, with the goal; and its cross-validated error over its hidden neurons."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from birdstrike.data.histories import Array
from birdstrike.reports.figures.style import BLACK, BLUE, VERMILION, legend_above, styled


@styled
def training_figure(epoch: Array, training: Array, held_out: Array | None, goal: float | None) -> Figure:
    """`epoch`, `training`, `held_out`: (e,) mean square errors of the parameters scaled to 0..1."""
    figure = Figure(figsize=(7.0, 3.1), layout="constrained")
    axes = figure.subplots()
    marker = "o" if epoch.size < 30 else ""
    axes.semilogy(epoch, training, color=BLUE, marker=marker, markersize=3, label="training runs")
    if held_out is not None and np.isfinite(held_out).any():
        label = "held-out runs"
        axes.semilogy(epoch, held_out, color=VERMILION, linestyle=(0, (5, 2)), marker=marker, markersize=3, label=label)
    if goal is not None:
        axes.axhline(goal, color=BLACK, linewidth=1.0, linestyle=":", label=f"goal {goal:g}")
    axes.set_xlabel("Epoch")
    axes.set_ylabel("Mean square error [–]")
    axes.margins(x=0.02, y=0.08)
    legend_above(axes)
    return figure


@styled
def hidden_size_figure(sizes: Mapping[int, tuple[float, float]]) -> Figure:
    """`sizes`: hidden neurons -> mean error and its standard deviation over the starts, shares of the ranges."""
    figure = Figure(figsize=(7.0, 2.6), layout="constrained")
    axes = figure.subplots()
    mean, spread = (100.0 * np.array(column) for column in zip(*sizes.values(), strict=True))
    axes.errorbar(list(sizes), mean, spread, fmt="o-", color=BLUE, markersize=4, capsize=3)
    axes.set_xlabel("Hidden neurons [–]")
    axes.set_ylabel("Cross-validated error [% of range]")
    axes.margins(x=0.05)
    axes.set_ylim(bottom=0.0)
    return figure
