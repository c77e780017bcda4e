"""One sensor in two codes: both curves, and their difference below."""

from __future__ import annotations

from matplotlib.figure import Figure

from birdstrike.reports.comparison.other_code import CurvePair
from birdstrike.reports.figures.quantities import milliseconds, shown
from birdstrike.reports.figures.style import BLUE, GREY, VERMILION, WIDE, legend_above, styled


@styled
def two_codes_figure(pair: CurvePair, theirs: str) -> Figure:
    """theirs: what the other curves are called."""
    figure = Figure(figsize=(WIDE, 4.2), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(2.6, 1))
    at = milliseconds(pair.time)
    (own, unit), (other, _) = shown(pair.ours, pair.unit), shown(pair.theirs, pair.unit)
    above.plot(at, other, color=VERMILION, label=theirs)
    above.plot(at, own, color=BLUE, linestyle="--", label="birdstrike")
    above.set_ylabel(f"{pair.name.replace('_', ' ')} [{unit}]" if unit else pair.name.replace("_", " "))
    below.axhline(0.0, color=GREY, linewidth=0.8)
    below.plot(at, own - other, color=BLUE, linewidth=1.0)
    below.set_ylabel(f"difference [{unit}]" if unit else "difference")
    below.set_xlabel("time [ms]")
    legend_above(above)
    return figure
