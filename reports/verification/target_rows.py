"""Rows of the target: Wilbeck's pressures on a rigid plate, the impulse of a stop, friction, a gauge, a torn plate."""

from __future__ import annotations

from reports.verification.draw import Curve, Panel, draw
from reports.verification.problem import Outcome, Picture, Problem, Strikes
from reports.verification.rows import Row, below, matches, shown
from reports.verification.shots import Shot
from reports.verification.target_problems import (
    DENSITY,
    against_rigid,
    gauge_under_a_layer,
    sliding_layer,
    steady_pressure,
    stopped,
)
from solver.wilbeck import stagnation_pressure

SPEED, SLENDERNESS = 200.0, 2.0  # m/s; length over diameter
SPACINGS = (2.0, 3.0)  # particles along the gauge's radius; the finest is judged
STOPS = (10e-3, 8e-3)  # m between particles
STEADY = "rho u0^2/2, mean from t_D/3 to 2 t_D/3: J. S. Wilbeck, AFML-TR-77-134 (1978)"
HUGONIOT = "p_H = rho0 (c0 + k u0) u0: J. S. Wilbeck, AFML-TR-77-134 (1978)"
TORN = Shot(
    "reference_strike_156mm",
    (
        ("bird.particles", "500"),
        ("plate.elements", "[20, 16]"),
        ("plate.thickness", "3 mm"),
        ("plate.material.yield_stress", "350 MPa"),
        ("plate.material.tangent_modulus", "700 MPa"),
        ("plate.material.failure_strain", "0.12"),
        ("time.end", "1 ms"),
        ("time.snapshots", "[]"),
        ("impact.standoff", "2 mm"),
        ("impact.angle", "90 deg"),
        ("impact.speed", "250 m/s"),
    ),
)


def solve_stagnation(_: Strikes) -> Outcome:
    """Gauge in the middle of the rigid plate at two resolutions."""
    figure = "stagnation"
    rows: list[Row] = []
    curves = []
    for spacings in SPACINGS:
        run = against_rigid(SPEED, spacings, SLENDERNESS)
        found = steady_pressure(run, SPEED, SLENDERNESS)
        seen = found.seen
        gate = 5.0 if spacings == SPACINGS[-1] else None
        label = f"{spacings:g} particles a gauge radius"
        note = f"{seen['particles']:.0f} particles; scatter about the mean {1e-6 * seen['scatter']:.2f} MPa"
        ours, truth, share = 1e-6 * found.computed, 1e-6 * found.reference, seen["peak_over_hugoniot"]
        rows += [
            matches(f"stagnation pressure, {label}", ours, truth, "MPa", gate, STEADY, note, figure),
            shown(f"peak over Hugoniot's pressure, {label}", share, "", HUGONIOT, "", figure),
        ]
        curves.append(Curve(label, 1e3 * run.time, 1e-6 * run.channels["centre"]))
    late = 1e3 * run.time[-1]
    level = 1e-6 * stagnation_pressure(DENSITY, SPEED)
    curves.append(Curve("stagnation pressure", [0.0, late], [level, level], truth=True))
    panels = [Panel("time [ms]", "gauge pressure [MPa]", curves, "whole history")]
    cut = [Curve(c.label, c.x, [min(float(y), 4.0 * level) for y in c.y], c.truth) for c in curves]
    panels.append(Panel("time [ms]", "gauge pressure, cut at 4 p_s [MPa]", cut, "steady phase", legend=False))
    off = " and ".join(f"{row.error:+.1f} %" for row in rows if row.truth is not None)
    caption = (
        f"A flat cylinder, L/D {SLENDERNESS:g}, at {SPEED:g} m/s against a rigid plate: mean pressure of the steady "
        f"phase {off} off rho u²/2 with {' and '.join(f'{s:g}' for s in SPACINGS)} particles a gauge radius."
    )
    return Outcome(tuple(rows), (Picture(figure, draw(*panels), caption),))


def solve_stop(_: Strikes) -> Outcome:
    """Impulse of a normal stop at two resolutions, the rebound beside it."""
    rows: list[Row] = []
    for spacing in STOPS:
        found = stopped(spacing=spacing)
        seen = found.seen
        label = f"{seen['particles']:.0f} particles"
        rebound = 100.0 * seen["rebound"] / found.reference
        rows += [
            matches(f"impulse of a normal stop, {label}", found.computed, found.reference, "N s", 2.0, "m u0"),
            shown(f"momentum that flies back, {label}", rebound, "%", "of the bird's; its excess over m u0"),
            below(f"impulse against the bird's change, {label}", seen["momentum_error"], 1e-10, "", "conservation"),
        ]
    return Outcome(tuple(rows))


def solve_friction(_: Strikes) -> Outcome:
    """Deceleration and heat of loose particles that slide under a known push."""
    slowed, heat = sliding_layer()
    return Outcome(
        (
            matches("friction: deceleration", slowed.computed, slowed.reference, slowed.unit, 0.1, "mu N/m"),
            matches("friction: heat", 1e6 * heat.computed, 1e6 * heat.reference, "uJ", 0.1, "mu N s"),
        )
    )


def solve_gauge(_: Strikes) -> Outcome:
    """Gauges of two radii, one of them off the particles' rhythm."""
    rows = []
    for radius, spacing in ((0.02, 5e-3), (0.031, 4e-3)):
        found = gauge_under_a_layer(radius=radius, spacing=spacing)
        name = f"gauge of radius {1e3 * radius:g} mm under particles of {1e3 * spacing:g} mm"
        rows.append(matches(name, 1e-6 * found.computed, 1e-6 * found.reference, "MPa", 1.0, "force over area"))
    return Outcome(tuple(rows))


def solve_torn(strikes: Strikes) -> Outcome:
    """Books of a strike that tears a thin plate."""
    s = strikes[TORN].summary
    books = "energies, each from its own rate"
    return Outcome(
        (
            shown("torn plate: shells lost", float(s["eroded_shells"]), "", "our run", "of 320"),
            shown("torn plate: linear momentum", s["momentum_error"], "", "conservation", "of the bird's"),
            shown("torn plate: energy, worst instant", 100.0 * s["worst_energy_error"], "%", books),
            shown("torn plate: energy that left with the shells", s["energies_J"]["plate_eroded"], "J", books),
        )
    )


ABOUT = (
    "A flat cylinder of 100 mm end on against a rigid plate, gauge of radius 10 mm in the middle; no viscosity and no "
    "tension for the pressures, the reference strike's for the stop (L/D 2, 100 m/s)."
)
PROBLEMS = (
    Problem("stagnation", "Target", ABOUT, solve_stagnation),
    Problem("normal_stop", "Target", "", solve_stop),
    Problem("friction", "Target", "", solve_friction),
    Problem("pressure_gauge", "Target", "", solve_gauge),
    Problem("torn_plate", "Target", "", solve_torn, (TORN,)),
)
