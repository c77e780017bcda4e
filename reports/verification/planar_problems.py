"""Planar impact against each equation of state's own Rankine-Hugoniot solution, 45 to 300 m/s."""

from __future__ import annotations

import numpy as np

from reports.verification.columns import SEED
from reports.verification.draw import Curve, Panel, draw
from reports.verification.hugoniot import Jump, grueneisen_pressure, jump
from reports.verification.impact import Impact, planar_impact
from reports.verification.problem import Outcome, Picture, Problem, Strikes
from reports.verification.rows import Row, matches

SOURCE = "Rankine-Hugoniot jump of the equation of state, solved numerically"
SPEEDS = (45.55, 100.0, 150.0, 200.0, 300.0)
TOLERANCE = 1.0  # %
LENGTH = {"fcc": 360, "cubic": 570}  # lattice cells: the same length in metres


def collide(speeds: tuple[float, ...], kind: str) -> list[tuple[float, Jump, Impact]]:
    """Theory and column at each speed, the seed's Grueneisen bird."""
    pressure = grueneisen_pressure(SEED.eos)
    pairs = ((u, jump(pressure, SEED.rho0, u)) for u in speeds)
    side = 2 if kind == "fcc" else 3  # the narrowest columns that are wider than a particle's reach
    return [(u, truth, planar_impact(u, truth.shock, kind=kind, length=LENGTH[kind], side=side)) for u, truth in pairs]


def rows_of(results: list[tuple[float, Jump, Impact]], eos: str, tolerance: float | None, figure: str) -> list[Row]:
    """Plateau pressure and shock speed at each speed."""
    rows = []
    for u, truth, ours in results:
        where = f"{eos}, {u:g} m/s"
        mega = (1e-6 * ours.pressure, 1e-6 * truth.pressure, "MPa", tolerance, SOURCE, "", figure)
        rows.append(matches(f"plateau pressure: {where}", *mega))
        rows.append(matches(f"shock speed: {where}", ours.shock, truth.shock, "m/s", tolerance, SOURCE, "", figure))
    return rows


def solve_fcc(_: Strikes) -> Outcome:
    """The lattice that cases use by default."""
    results = collide(SPEEDS, "fcc")
    figure = "planar_impact"
    return Outcome(tuple(rows_of(results, "Grueneisen, FCC", TOLERANCE, figure)), (picture(results, figure, "FCC"),))


def solve_cubic(_: Strikes) -> Outcome:
    """The other lattice, at the ends of the range."""
    results = collide((45.55, 200.0), "cubic")
    figure = "planar_impact_cubic"
    return Outcome(
        tuple(rows_of(results, "Grueneisen, cubic", TOLERANCE, figure)), (picture(results, figure, "cubic"),)
    )


def picture(results: list[tuple[float, Jump, Impact]], name: str, lattice: str) -> Picture:
    """Pressure profiles over the distance behind the front, and the Hugoniot curve with our plateaus."""
    profiles = [_profile(u, truth, ours) for u, truth, ours in results]
    low, high = 0.99, 1.01
    pressure = grueneisen_pressure(SEED.eos)
    speeds = np.linspace(30.0, 310.0, 57)
    theory = Curve("theory", speeds, [1e-6 * jump(pressure, SEED.rho0, u).pressure for u in speeds], truth=True)
    ours = Curve("plateau mean", [r[0] for r in results], [1e-6 * r[2].pressure for r in results], dots=True)
    left = Panel(
        "distance from the plane of impact / front's", "pressure / Hugoniot pressure", profiles, band=(low, high)
    )
    right = Panel("particle velocity u [m/s]", "pressure [MPa]", (theory, ours))
    worst_p = max(abs(r[2].pressure / r[1].pressure - 1.0) for r in results)
    worst_u = max(abs(r[2].shock / r[1].shock - 1.0) for r in results)
    ripple = max(r[2].ripple / r[1].pressure for r in results)
    astray = max(abs(r[2].astray) for r in results)
    caption = (
        f"Two halves of a laterally periodic {lattice} column meet at ±u. Left: mean pressure of each lattice plane "
        f"at the "
        f"end, grey ±1 %. Right: the Hugoniot and the plateau means (20 to 80 % of the way to the front). Largest "
        f"miss: "
        f"pressure {worst_p:.2%}, shock speed {worst_u:.2%}; ripple of the plateau (standard deviation) at most "
        f"{ripple:.2%}; energy closes within {astray:.2%} of the kinetic energy."
    )
    return Picture(name, draw(left, right), caption)


def _profile(u: float, truth: Jump, ours: Impact) -> Curve:
    """Mean pressure in 120 equal slices up to 1.3 of the front's distance."""
    edges = np.linspace(0.0, 1.3 * ours.front, 121)
    count, _ = np.histogram(ours.distance, edges)
    summed, _ = np.histogram(ours.distance, edges, weights=ours.pressures)
    middle = 0.5 * (edges[1:] + edges[:-1])
    full = count > 0
    return Curve(f"{u:g} m/s", middle[full] / ours.front, summed[full] / count[full] / truth.pressure)


ABOUT = (
    "Pressure and shock speed behind a planar impact are theorems: mass, momentum and energy across the shock, with "
    "the "
    "equation of state at hand. A column that is short behind the front still carries the ringing of its start; "
    "these are "
    "long enough (about 570 spacings) for it to have decayed."
)
PROBLEMS = (
    Problem("planar_impact", "Planar impact", ABOUT, solve_fcc),
    Problem("planar_impact_cubic", "Planar impact", "", solve_cubic),
)
