"""Rows of the target: the impulse of a stop on a rigid plate, friction, a gauge, a torn plate."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np

from birdstrike.reports.verification.problem import Computed, Problem, Row, Solution, below, matches, shown
from birdstrike.reports.verification.problems.stagnation import DENSITY, DIAMETER, S1, C, Compared, rigid_run
from birdstrike.reports.verification.runs import RunSpec
from birdstrike.solver.bird.body import BirdBody
from birdstrike.solver.bird.eos.grueneisen import grueneisen
from birdstrike.solver.bird.materials.fluid import Fluid
from birdstrike.solver.bird.sph import Bird
from birdstrike.solver.contact import Contact
from birdstrike.solver.coupling import Coupling
from birdstrike.solver.kernels.sums import column_sums
from birdstrike.solver.reference.wilbeck import duration
from birdstrike.solver.sensors.pressure import Pressure, disc
from birdstrike.solver.sensors.sensor import Run
from birdstrike.solver.target.mesh import plate_mesh
from birdstrike.solver.target.rectangle import rigid_plate_of

STILL = 1e-3  # of the peak: the force below which an impact is over


def stopped(speed: float = 100.0, spacing: float = 6e-3, slenderness: float = 2.0, **changes: str) -> Compared:
    """Impulse of a normal impact until the force stays below 0.1 % of its peak, against the bird's momentum.

    The bird is the reference strike's (MU 641 Pa s, PC -0.3705 MPa) unless `changes` say otherwise, as
    bird__material__viscosity. Seen: the rebound, momentum that flies back [N s]; the error of the momentum balance;
    when the force had faded [s]. Impulse = momentum + rebound by conservation: what exceeds the momentum is the
    rebound. Without MU the end of the bird splashes off a sheet thinner than a particle, and the rebound is the
    resolution's: 14 % of the momentum with 1000 particles, 7 % with 4000 (80 x 160 mm, 100 m/s).
    """
    length = slenderness * DIAMETER
    reference = {"bird__material__viscosity": "641 Pa s", "bird__material__pressure_cutoff": "-0.3705 MPa"}
    coupling = Coupling(
        rigid_run(spacing, length, speed, 4.0 * duration(length, speed), **(reference | changes)).load()
    )
    force, before = np.zeros(coupling.steps), normal_momentum(coupling.bird)
    for step in range(coupling.steps):
        coupling.advance()
        force[step] = coupling.push
        coupling.move()
    loud = np.flatnonzero(force >= STILL * force.max())
    if loud[-1] >= coupling.steps - 2:
        raise RuntimeError("the force has not faded to 0.1 % of its peak: lengthen the run")
    until = loud[-1] + 1
    impulse = (force[:until].sum() - 0.5 * force[0]) * coupling.dt
    whole = (force.sum() - 0.5 * force[0]) * coupling.dt
    bird = coupling.bird
    flying = bird.masses * bird.v[: bird.n, 2]
    seen = {
        "rebound": float(flying[flying > 0.0].sum()),
        "faded": float(loud[-1] * coupling.dt),
        "after_it": float(whole - impulse),
        "momentum_error": abs((normal_momentum(bird) - before) - whole) / abs(before),
        "particles": float(bird.n),
    }
    return Compared(float(impulse), abs(before), "N s", seen)


def normal_momentum(bird: BirdBody) -> float:
    """Along z [N s]."""
    result = np.zeros(3)
    column_sums(bird.masses[:, None] * bird.v[: bird.n], bird.n, result)
    return float(result[2])


MATERIAL = Fluid(grueneisen(DENSITY, C, S1))


def layer(side: int, spacing: float, pitch: float, overlap: float, velocity: tuple[float, float, float]) -> Bird:
    """side x side particles, `pitch` apart, each `overlap` [m] deep in a plate 10 mm thick."""
    row = (np.arange(side) - 0.5 * (side - 1)) * pitch
    x, y = (a.ravel() for a in np.meshgrid(row, row))
    points = np.column_stack([x, y, np.full(len(x), 0.5 * (0.01 + spacing) - overlap)])
    return Bird(points, np.tile(velocity, (len(x), 1)), DENSITY * spacing**3, 1.2 * spacing, MATERIAL, (1.0, 2.0))


def sliding_layer(mu: float = 0.2, push: float = 1.0, steps: int = 150) -> tuple[Compared, Compared]:
    """Loose particles pressed with `push` [N] each, sliding from 1 m/s: deceleration mu N/m, heat mu N s.

    Each particle is alone (30 mm apart): no bird, only contact. The heat is compared over the whole way.
    """
    spacing = 5e-3
    plate = rigid_plate_of(plate_mesh(0.4, 0.4, (10, 10)), 0.01)
    bird = layer(5, spacing, 0.03, push / (MATERIAL.bulk_modulus * spacing), (1.0, 0.0, 0.0))
    start, speed = bird.x[: bird.n, 0].copy(), np.zeros(steps)
    contact = Contact(bird, plate, mu)
    dt = 0.5 * contact.stable_step(bird, plate)
    for step in range(steps):
        speed[step] = bird.v[: bird.n, 0].mean()
        since = dt if step else 0.0
        bird.acceleration[:] = 0.0
        contact.update_forces(bird, plate)
        contact.update_energies(bird, plate, since)
        bird.acceleration[: bird.n, 2] -= push / bird.mass
        kick = since or 0.5 * dt
        bird.kick(kick)
        contact.kick(bird, kick, 0.0)
        bird.drift(dt)
    slope = float(np.polyfit(np.arange(1, steps) * dt, speed[1:], 1)[0])
    way = float((bird.x[: bird.n, 0] - start).mean()) - 1.0 * dt * speed[-1]
    heat = contact.energies["friction"] / bird.n
    return (
        Compared(-slope, mu * push / bird.mass, "m/s^2", {"speed_left": float(speed[-1])}),
        Compared(heat, mu * push * way, "J", {"way": way}),
    )


def gauge_under_a_layer(applied: float = 3e6, radius: float = 0.02, spacing: float = 5e-3) -> Compared:
    """A gauge under particles that each push with applied d^2, one on every square of edge d."""
    mesh = plate_mesh(0.3, 0.3, (12, 12))
    plate, count = rigid_plate_of(mesh, 0.01), 2 * int(radius / spacing) + 9
    bird = layer(count, spacing, spacing, applied * spacing / MATERIAL.bulk_modulus, (0.0, 0.0, 0.0))
    contact = Contact(bird, plate)
    contact.update_forces(bird, plate)
    sensor = Pressure.model_validate({"kind": "pressure", "radius": f"{radius} m"})
    running = cast(Run, SimpleNamespace(plate=plate, contact=contact))
    reading = disc(sensor, running).pressure(bird, contact)
    return Compared(reading, applied, "Pa", {"touching": float(contact.touching)})


STOPS = (8e-3, 6e-3)  # m between particles
TORN = RunSpec(
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


def solve_stop(_: Computed) -> Solution:
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
    return Solution(tuple(rows))


def solve_friction(_: Computed) -> Solution:
    """Deceleration and heat of loose particles that slide under a known push."""
    slowed, heat = sliding_layer()
    return Solution(
        (
            matches("friction: deceleration", slowed.computed, slowed.reference, slowed.unit, 0.1, "mu N/m"),
            matches("friction: heat", 1e6 * heat.computed, 1e6 * heat.reference, "uJ", 0.1, "mu N s"),
        )
    )


def solve_gauge(_: Computed) -> Solution:
    """Gauges of two radii, one of them off the particles' rhythm."""
    rows = []
    for radius, spacing in ((0.02, 5e-3), (0.031, 4e-3)):
        found = gauge_under_a_layer(radius=radius, spacing=spacing)
        name = f"gauge of radius {1e3 * radius:g} mm under particles of {1e3 * spacing:g} mm"
        rows.append(matches(name, 1e-6 * found.computed, 1e-6 * found.reference, "MPa", 1.0, "force over area"))
    return Solution(tuple(rows))


def solve_torn(computed: Computed) -> Solution:
    """Energy balance of an impact that tears a thin plate."""
    s = computed[TORN].summary
    balance = "energies, each from its own rate"
    return Solution(
        (
            shown("torn plate: shells lost", float(s["eroded_shells"]), "", "our run", "of 320"),
            shown("torn plate: linear momentum", s["momentum_error"], "", "conservation", "of the bird's"),
            shown("torn plate: energy, worst instant", 100.0 * s["worst_energy_error"], "%", balance),
            shown("torn plate: energy that left with the shells", s["energies_J"]["plate_eroded"], "J", balance),
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
