"""One sensor in two codes: both curves, and their difference below."""

from __future__ import annotations

from matplotlib.figure import Figure

from birdstrike.data.histories import Array
from birdstrike.reports.figures.quantities import milliseconds, shown_readings
from birdstrike.reports.figures.style import BLUE, GREY, VERMILION, WIDE, legend_above, styled


@styled
def two_codes_figure(
    name: str,
    unit: str,
    time: Array,
    ours: Array,
    theirs: Array,
    other_name: str,
) -> Figure:
    """other_name: what the other curves are called."""
    figure = Figure(figsize=(WIDE, 4.2), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(2.6, 1))
    at = milliseconds(time)
    (own, display), (other, _) = shown_readings(ours, unit), shown_readings(theirs, unit)
    above.plot(at, other, color=VERMILION, label=other_name)
    above.plot(at, own, color=BLUE, linestyle="--", label="birdstrike")
    label = name.replace("_", " ")
    above.set_ylabel(f"{label} [{display}]")
    below.axhline(0.0, color=GREY, linewidth=0.8)
    below.plot(at, own - other, color=BLUE, linewidth=1.0)
    below.set_ylabel(f"difference [{display}]")
    below.set_xlabel("time [ms]")
    legend_above(above)
    return figure
