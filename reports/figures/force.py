"""Force history of one strike: contact and reaction force, and the impulse against the bird's normal momentum."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure
from scipy.integrate import cumulative_trapezoid

from data.histories import Array
from reports.figures.quantities import milliseconds, shown
from reports.figures.style import BLACK, BLUE, ORANGE, WIDE, legend_above, styled

_COLOURS = {"contact_force": BLUE, "reaction_force": ORANGE}


@styled
def force_figure(time: Array, forces: Mapping[str, Array], normal_momentum: float) -> Figure:
    """`time` (n,) s; `forces`: sensor -> (n,) N, positive in the direction of the push; `normal_momentum` kg m/s."""
    figure = Figure(figsize=(WIDE, 5.0), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(1.6, 1))
    for name, force in forces.items():
        words, colour = name.replace("_", " "), _COLOURS.get(name, BLACK)
        above.plot(milliseconds(time), shown(force, "N")[0], color=colour, linewidth=1.2, label=f"simulated {words}")
        below.plot(milliseconds(time), impulse(time, force), color=colour, label=f"its impulse ({words})")
    above.set_ylabel("Force [kN]")
    below.axhline(normal_momentum, color=BLACK, linewidth=1.0, linestyle=":")
    below.annotate(
        f"bird's normal momentum {normal_momentum:.1f} N s",
        xy=(0.0, normal_momentum),
        xytext=(4, 3),
        textcoords="offset points",
        fontsize=8,
    )
    below.set_ylim(top=1.18 * max(normal_momentum, *(float(impulse(time, f).max()) for f in forces.values())))
    below.set_ylabel("Impulse [N s]")
    below.set_xlabel("Time of the simulation [ms]")
    below.set_xlim(0.0, milliseconds(time)[-1])
    legend_above(above)
    return figure


def impulse(time: Array, force: Array) -> Array:
    """Integral of `force` (n,) N over `time` (n,) s from the first sample by the trapezium rule, (n,) N s."""
    return np.asarray(cumulative_trapezoid(force, time, initial=0.0))
