"""Rows of the target: the impulse of a stop on a rigid plate, friction, a gauge, a torn plate."""

from __future__ import annotations

from reports.verification.problem import Outcome, Problem, Strikes
from reports.verification.rows import Row, below, matches, shown
from reports.verification.shots import Shot
from reports.verification.target_problems import gauge_under_a_layer, sliding_layer, stopped

STOPS = (8e-3, 6e-3)  # m between particles
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


def solve_stop(_: Strikes) -> Outcome:
    """Impulse of a normal stop at two resolutions, the rebound beside it."""
    rows: list[Row] = []
    for spacing in STOPS:
        found = stopped(spacing=spacing)
        seen = found.seen
        label = f"{seen['particles']:.0f} particles"
        rebound = 100.0 * seen["rebound"] / found.reference
        note = f"until the force has faded, {1e3 * seen['faded']:.1f} ms; {seen['after_it']:.2f} N s after it"
        rows += [
            matches(f"impulse of a normal stop, {label}", found.computed, found.reference, "N s", 2.0, "m u0", note),
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


STOP = (
    "A flat cylinder of 100 mm, L/D 2, end on against a rigid plate at 100 m/s, with the reference strike's viscosity "
    "and cutoff, until the force has faded to 0.1 % of its peak. What exceeds the bird's momentum flies back."
)
PROBLEMS = (
    Problem("normal_stop", "Target", STOP, solve_stop),
    Problem("friction", "Target", "", solve_friction),
    Problem("pressure_gauge", "Target", "", solve_gauge),
    Problem("torn_plate", "Target", "", solve_torn, (TORN,)),
)
