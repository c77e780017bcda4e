"""Load cells of one simulation: the reaction of each set of supports against time, and their sum."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib import colormaps
from matplotlib.figure import Figure

from birdstrike.data.histories import Array
from birdstrike.reports.figures.quantities import milliseconds, shown, words
from birdstrike.reports.figures.style import BLACK, VERMILION, WIDE, styled

DASHES = ("-", "--", "-.", ":")


@styled
def load_cells_figure(time: Array, cells: Mapping[str, Array], total: Array | None) -> Figure:
    """Above every cell (n,) N, below their sum; total (n,) N: the whole reaction, where a sensor has it.

    What the sum lacks of the whole is carried by supports that no cell reads.
    """
    figure = Figure(figsize=(WIDE, 5.4), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(2.0, 1.2))
    at, colours = milliseconds(time), colormaps["viridis"](np.linspace(0.0, 0.9, len(cells)))
    for number, (name, force) in enumerate(cells.items()):
        dashes = DASHES[number % len(DASHES)]  # of a symmetric shot curves lie on each other: dashes show all of them
        above.plot(at, shown(force, "N")[0], dashes, color=colours[number], lw=1.3, label=words(name))
    summed = np.sum(list(cells.values()), axis=0)
    below.plot(at, shown(summed, "N")[0], color=BLACK, lw=1.4, label="sum of the cells")
    if total is not None:
        below.plot(at, shown(total, "N")[0], color=VERMILION, lw=1.2, ls="--", label="whole reaction")
    above.set_ylabel("Force of each load cell [kN]")
    below.set_ylabel("Sum [kN]")
    below.set_xlabel("Time on the simulation's clock [ms]")
    below.set_xlim(float(at[0]), float(at[-1]))
    handles = [line for axes in (above, below) for line in axes.lines]
    figure.legend(handles=handles, loc="outside upper left", ncols=5, handlelength=2.6, columnspacing=1.6)
    above.axhline(0.0, color=BLACK, lw=0.6)
    return figure
