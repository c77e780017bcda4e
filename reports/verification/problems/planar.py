"""Planar impact against each equation of state's own Rankine-Hugoniot solution, 45 to 300 m/s."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.histories import Array
from birdstrike.reports.verification.columns import SEED, advance, periodic_bird
from birdstrike.reports.verification.draw import Curve, Panel, draw
from birdstrike.reports.verification.problem import Computed, Picture, Problem, Row, Solution, matches
from birdstrike.solver.bird.eos.grueneisen import grueneisen
from birdstrike.solver.bird.eos.linear_polynomial import linear_polynomial
from birdstrike.solver.bird.eos.murnaghan import murnaghan
from birdstrike.solver.bird.eos.polynomial_k import polynomial_k
from birdstrike.solver.bird.eos.porous import porous_density, porous_wood
from birdstrike.solver.bird.eos.table import table
from birdstrike.solver.bird.materials.fluid import Fluid
from birdstrike.solver.reference.hugoniot import Jump, jump, pressure_of


@dataclass(frozen=True)
class Impact:
    """At the end: distance (n,) [m] of the particles from the plane of impact, their pressures [Pa], their least and
    largest speeds; front: where theory puts the shock [m]; shock: its speed through the bird [m/s]; pressure, ripple:
    mean and standard deviation over the plateau [Pa]; energy_error: energy lost or made, of the initial.
    """

    distance: Array
    pressures: Array
    front: float
    shock: float
    pressure: float
    ripple: float
    energy_error: float


PLATEAU = (0.2, 0.8)  # of the way to the front: past the wall heating at the plane, short of the front's own width


def planar_impact(
    u: float,
    shock: float,
    material: Fluid = SEED,
    kind: str = "fcc",
    length: int = 120,
    side: int = 3,
    spacing: float = 5e-3,
) -> Impact:
    """Halves at +-u [m/s] in a column of `length` lattice cells; shock: the expected speed through the bird [m/s].

    The measured speed is the rate at which half the plateau's pressure passes from one lattice plane to the next, in
    the planes' places before the impact: a straight line fitted over the last two thirds of the time.
    """
    bird, box = periodic_bird((length, side, side), spacing, (1, 2), material, kind=kind)
    bird.x[:, 0] -= 0.5 * box[0]
    bird.v[:, 0] = np.where(bird.x[:, 0] < 0.0, u, -u)
    dt = 0.8 * bird.stable_step(material.fastest_wave(u))
    steps = int(0.65 * 0.5 * box[0] / (shock - u) / dt)
    start, stored = bird.kinetic_energy(), 0.0
    plane, place = planes(np.abs(bird.x[: bird.n, 0]))
    reached = np.zeros(steps)
    for step in range(steps):
        advance(bird, dt, first=step == 0)
        stored += bird.volume * bird.work[: bird.n].sum() + (dt if step else 0.0) * bird.dissipation[: bird.n, 1].sum()
        reached[step] = crossing(place, mean_over(plane, bird.p[: bird.n]), 0.5 * material.rho0 * shock * u)
    front = (shock - u) * steps * dt
    distance, pressures = np.abs(bird.x[: bird.n, 0]), bird.p[: bird.n].copy()
    plateau = pressures[(distance > PLATEAU[0] * front) & (distance < PLATEAU[1] * front)]
    late = np.arange(steps) >= steps // 3
    speed = float(np.polyfit(dt * np.arange(steps)[late], reached[late], 1)[0])
    energy_error = (bird.kinetic_energy() + stored - start) / start
    return Impact(distance, pressures, front, speed, float(plateau.mean()), float(plateau.std()), energy_error)


def planes(distance: Array) -> tuple[NDArray[np.int64], Array]:
    """Lattice plane of each particle, counted from the plane of impact, and the planes' distances from it [m]."""
    place, plane = np.unique(np.round(distance, 9), return_inverse=True)
    return plane.ravel(), place


def mean_over(plane: NDArray[np.int64], values: Array) -> Array:
    """Mean of the particles' values in each plane."""
    return np.bincount(plane, values) / np.bincount(plane)


def crossing(place: Array, pressures: Array, level: float) -> float:
    """Outermost place at which the pressure falls through `level`, between planes linearly; 0 before there is one."""
    above = np.flatnonzero(pressures > level)
    if not len(above) or above[-1] == len(place) - 1:
        return 0.0
    i = above[-1]
    share = (pressures[i] - level) / (pressures[i] - pressures[i + 1])
    return float(place[i] + share * (place[i + 1] - place[i]))


SOURCE = "Rankine-Hugoniot jump of the equation of state, solved numerically"
SPEEDS = (45.55, 100.0, 150.0, 200.0, 300.0)
TOLERANCE, POROUS = 1.0, 3.0  # %
LENGTH = {"fcc": 360, "cubic": 570}  # lattice cells: the same length in metres
POROUS_LENGTH = 120  # a soft bird's start has rung out sooner; its steps are short and its shock slow
WATER = polynomial_k(1000.0, 1482.9, 2.0)
COMPRESSIONS = np.linspace(-0.2, 0.6, 161)
MATERIALS = {  # by the name of the law; the tolerance of its rows
    "Grueneisen": (SEED, TOLERANCE),
    "Grueneisen with energy": (Fluid(grueneisen(938.0, 1670.0, 2.48, g0=0.8, a=0.3), -1e5), TOLERANCE),
    "linear polynomial": (
        Fluid(linear_polynomial(938.0, [0.0, 2072e6, 6217e6, 10362e6, 0.0, 0.0, 0.0]), -1e5),
        TOLERANCE,
    ),
    "Murnaghan": (Fluid(murnaghan(938.0, 9.3e6 * 37.0, 7.14), -1e5), TOLERANCE),
    "polynomial from k": (Fluid(WATER, -1e5), TOLERANCE),
    "table": (Fluid(table(1000.0, COMPRESSIONS, [WATER.pressure(mu) for mu in COMPRESSIONS]), -1e5), TOLERANCE),
    "porous 10 %": (Fluid(porous_wood(porous_density(0.1, 1000.0), 0.1, 1482.9, 2.0, 1000.0), -1e4), POROUS),
    "porous 30 %": (Fluid(porous_wood(porous_density(0.3, 1000.0), 0.3, 1482.9, 2.0, 1000.0), -1e4), POROUS),
}
Collision = tuple[float, Jump, Impact]
LAWS = list(MATERIALS)[1:]  # beside the seed's own


def _file(name: str) -> str:
    """A law's name as part of a file's."""
    return name.lower().replace(" %", "").replace(" ", "_")


def collide(material: Fluid, speeds: tuple[float, ...], kind: str, length: int) -> list[Collision]:
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


def solve(name: str, kind: str, speeds: tuple[float, ...], _: Computed) -> Solution:
    """One equation of state on one lattice."""
    material, tolerance = MATERIALS[name]
    length = POROUS_LENGTH if name.startswith("porous") else LENGTH[kind]
    results, figure = collide(material, speeds, kind, length), f"planar_impact_{_file(name)}_{kind}"
    rows = rows_of(results, f"{name}, {kind}", tolerance, figure)
    return Solution(tuple(rows), (picture(results, material, figure, f"{name}, {kind}"),))


def picture(results: list[Collision], material: Fluid, name: str, lattice: str) -> Picture:
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
    energy_error = max(abs(r[2].energy_error) for r in results)
    caption = (
        f"Two halves of a laterally periodic column ({lattice}) meet at ±u. Left: mean pressure of each lattice plane "
        f"at the end, grey ±1 %. Right: the Hugoniot and the plateau means (20 to 80 % of the way to the front). "
        f"Largest error: pressure {worst_p:.2%}, shock speed {worst_u:.2%}; ripple of the plateau (standard deviation) "
        f"at most {ripple:.2%}; energy closes within {energy_error:.2%} of the kinetic energy."
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
