"""Planar impact against each equation of state's own Rankine-Hugoniot solution, 45 to 300 m/s."""

from __future__ import annotations

from functools import partial

import numpy as np

from reports.verification.columns import SEED
from reports.verification.draw import Curve, Panel, draw
from reports.verification.hugoniot import Jump, jump, pressure_of
from reports.verification.impact import Impact, planar_impact
from reports.verification.problem import Outcome, Picture, Problem, Strikes
from reports.verification.rows import Row, matches
from solver.bird import NullMaterial
from solver.eos import (
    grueneisen,
    linear_polynomial,
    murnaghan,
    polynomial_k,
    porous_density,
    porous_wood,
    table,
)

SOURCE = "Rankine-Hugoniot jump of the equation of state, solved numerically"
SPEEDS = (45.55, 100.0, 150.0, 200.0, 300.0)
TOLERANCE, POROUS = 1.0, 3.0  # %
LENGTH = {"fcc": 360, "cubic": 570}  # lattice cells: the same length in metres
POROUS_LENGTH = 120  # a soft bird's start has rung out sooner; its steps are short and its shock slow
WATER = polynomial_k(1000.0, 1482.9, 2.0)
COMPRESSIONS = np.linspace(-0.2, 0.6, 161)
MATERIALS = {  # by the name of the law; the tolerance of its rows
    "Grueneisen": (SEED, TOLERANCE),
    "Grueneisen with energy": (NullMaterial(grueneisen(938.0, 1670.0, 2.48, g0=0.8, a=0.3), -1e5), TOLERANCE),
    "linear polynomial": (
        NullMaterial(linear_polynomial(938.0, [0.0, 2072e6, 6217e6, 10362e6, 0.0, 0.0, 0.0]), -1e5),
        TOLERANCE,
    ),
    "Murnaghan": (NullMaterial(murnaghan(938.0, 9.3e6 * 37.0, 7.14), -1e5), TOLERANCE),
    "polynomial from k": (NullMaterial(WATER, -1e5), TOLERANCE),
    "table": (NullMaterial(table(1000.0, COMPRESSIONS, [WATER.pressure(mu) for mu in COMPRESSIONS]), -1e5), TOLERANCE),
    "porous 10 %": (NullMaterial(porous_wood(porous_density(0.1, 1000.0), 0.1, 1482.9, 2.0, 1000.0), -1e4), POROUS),
    "porous 30 %": (NullMaterial(porous_wood(porous_density(0.3, 1000.0), 0.3, 1482.9, 2.0, 1000.0), -1e4), POROUS),
}
Collision = tuple[float, Jump, Impact]
LAWS = list(MATERIALS)[1:]  # beside the seed's own


def _file(name: str) -> str:
    """A law's name as part of a file's."""
    return name.lower().replace(" %", "").replace(" ", "_")


def collide(material: NullMaterial, speeds: tuple[float, ...], kind: str, length: int) -> list[Collision]:
    """Theory and column of so many lattice cells at each speed."""
    pressure = pressure_of(material.eos)
    pairs = ((u, jump(pressure, material.rho0, u)) for u in speeds)
    side = 2 if kind == "fcc" else 3  # the narrowest columns that are wider than a particle's reach
    columns = {"kind": kind, "length": length, "side": side}
    return [(u, truth, planar_impact(u, truth.shock, material, **columns)) for u, truth in pairs]


def rows_of(results: list[Collision], eos: str, tolerance: float | None, figure: str) -> list[Row]:
    """Plateau pressure and shock speed at each speed."""
    rows = []
    for u, truth, ours in results:
        where = f"{eos}, {u:g} m/s"
        mega = (1e-6 * ours.pressure, 1e-6 * truth.pressure, "MPa", tolerance, SOURCE, "", figure)
        rows.append(matches(f"plateau pressure: {where}", *mega))
        rows.append(matches(f"shock speed: {where}", ours.shock, truth.shock, "m/s", tolerance, SOURCE, "", figure))
    return rows


def solve(name: str, kind: str, speeds: tuple[float, ...], _: Strikes) -> Outcome:
    """One equation of state on one lattice."""
    material, tolerance = MATERIALS[name]
    length = POROUS_LENGTH if name.startswith("porous") else LENGTH[kind]
    results, figure = collide(material, speeds, kind, length), f"planar_impact_{_file(name)}_{kind}"
    rows = rows_of(results, f"{name}, {kind}", tolerance, figure)
    return Outcome(tuple(rows), (picture(results, material, figure, f"{name}, {kind}"),))


def picture(results: list[Collision], material: NullMaterial, name: str, lattice: str) -> Picture:
    """Pressure profiles over the distance behind the front, and the Hugoniot curve with our plateaus."""
    profiles = [_profile(u, truth, ours) for u, truth, ours in results]
    pressure = pressure_of(material.eos)
    speeds = np.linspace(30.0, 310.0, 57)
    theory = Curve("theory", speeds, [1e-6 * jump(pressure, material.rho0, u).pressure for u in speeds], truth=True)
    ours = Curve("plateau mean", [r[0] for r in results], [1e-6 * r[2].pressure for r in results], dots=True)
    left = Panel(
        "distance from the plane of impact / front's", "pressure / Hugoniot pressure", profiles, band=(0.99, 1.01)
    )
    right = Panel("particle velocity u [m/s]", "pressure [MPa]", (theory, ours))
    worst_p = max(abs(r[2].pressure / r[1].pressure - 1.0) for r in results)
    worst_u = max(abs(r[2].shock / r[1].shock - 1.0) for r in results)
    ripple = max(r[2].ripple / r[1].pressure for r in results)
    astray = max(abs(r[2].astray) for r in results)
    caption = (
        f"Two halves of a laterally periodic column ({lattice}) meet at ±u. Left: mean pressure of each lattice plane "
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
    "long enough (about 570 spacings; 190 for the porous birds) for it to have decayed."
)
PROBLEMS = tuple(
    Problem(f"planar_impact_{_file(name)}_{kind}", "Planar impact", about, partial(solve, name, kind, speeds))
    for name, kind, speeds, about in (
        ("Grueneisen", "fcc", SPEEDS, ABOUT),
        ("Grueneisen", "cubic", (45.55, 200.0), ""),
        *((name, "fcc", (45.55, 150.0, 300.0) if name.startswith("porous") else (100.0, 300.0), "") for name in LAWS),
    )
)
