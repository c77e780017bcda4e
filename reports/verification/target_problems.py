"""Problems of the target: the impulse of a stop on a rigid plate, friction, a pressure gauge."""

from __future__ import annotations

import numpy as np

from reports.verification.rigid_target import DENSITY, DIAMETER, S1, C, Compared, rigid_shot
from solver.bird import Bird, NullMaterial
from solver.body import BirdBody
from solver.case_sensors import Sensor
from solver.contact import Contact
from solver.eos import grueneisen
from solver.gauges import disc
from solver.kernels.sums import column_sums
from solver.rigid_plate import RigidPlate
from solver.shell_mesh import plate_mesh
from solver.strike import Strike
from solver.wilbeck import duration

STILL = 1e-3  # of the peak: the force below which an impact is over


def stopped(speed: float = 100.0, spacing: float = 6e-3, slenderness: float = 2.0, **changes: str) -> Compared:
    """Impulse of a normal strike until the force stays below 0.1 % of its peak, against the bird's momentum.

    The bird is the reference strike's (MU 641 Pa s, PC -0.3705 MPa) unless `changes` say otherwise, as
    bird__material__viscosity. Seen: the rebound, momentum that flies back [N s]; the impulse's own error in the books;
    when the force had faded [s]. Impulse = momentum + rebound by conservation: what exceeds the momentum is the
    rebound. Without MU the end of the bird splashes off a sheet thinner than a particle, and the rebound is the
    resolution's: 14 % of the momentum with 1000 particles, 7 % with 4000 (80 x 160 mm, 100 m/s).
    """
    length = slenderness * DIAMETER
    reference = {"bird__material__viscosity": "641 Pa s", "bird__material__pressure_cutoff": "-0.3705 MPa"}
    strike = Strike(rigid_shot(spacing, length, speed, 4.0 * duration(length, speed), **(reference | changes)).load())
    force, before = np.zeros(strike.steps), normal_momentum(strike.bird)
    for step in range(strike.steps):
        strike.advance()
        force[step] = strike.push
        strike.move()
    loud = np.flatnonzero(force >= STILL * force.max())
    if loud[-1] >= strike.steps - 2:
        raise RuntimeError("the force has not faded to 0.1 % of its peak: lengthen the run")
    until = loud[-1] + 1
    impulse = (force[:until].sum() - 0.5 * force[0]) * strike.dt
    whole = (force.sum() - 0.5 * force[0]) * strike.dt
    bird = strike.bird
    flying = bird.masses * bird.v[: bird.n, 2]
    seen = {
        "rebound": float(flying[flying > 0.0].sum()),
        "faded": float(loud[-1] * strike.dt),
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


MATERIAL = NullMaterial(grueneisen(DENSITY, C, S1))


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
    plate = RigidPlate(plate_mesh(0.4, 0.4, (10, 10)), 0.01)
    bird = layer(5, spacing, 0.03, push / (MATERIAL.bulk_modulus * spacing), (1.0, 0.0, 0.0))
    start, speed = bird.x[: bird.n, 0].copy(), np.zeros(steps)
    contact = Contact(bird, plate, mu)
    dt = 0.5 * contact.stable_step(bird, plate)
    for step in range(steps):
        speed[step] = bird.v[: bird.n, 0].mean()
        since = dt if step else 0.0
        bird.acceleration[:] = 0.0
        contact.update_forces(bird, plate)
        contact.keep_books(bird, plate, since)
        bird.acceleration[: bird.n, 2] -= push / bird.mass
        kick = since or 0.5 * dt
        bird.kick(kick)
        contact.kick(bird, kick, 0.0)
        bird.drift(dt)
    slope = float(np.polyfit(np.arange(1, steps) * dt, speed[1:], 1)[0])
    way = float((bird.x[: bird.n, 0] - start).mean()) - 1.0 * dt * speed[-1]
    heat = contact.accounts["friction"] / bird.n
    return (
        Compared(-slope, mu * push / bird.mass, "m/s^2", {"speed_left": float(speed[-1])}),
        Compared(heat, mu * push * way, "J", {"way": way}),
    )


def gauge_under_a_layer(applied: float = 3e6, radius: float = 0.02, spacing: float = 5e-3) -> Compared:
    """A gauge under particles that each push with applied d^2, one on every square of edge d."""
    mesh = plate_mesh(0.3, 0.3, (12, 12))
    plate, count = RigidPlate(mesh, 0.01), 2 * int(radius / spacing) + 9
    bird = layer(count, spacing, spacing, applied * spacing / MATERIAL.bulk_modulus, (0.0, 0.0, 0.0))
    contact = Contact(bird, plate)
    contact.update_forces(bird, plate)
    sensor = Sensor.model_validate({"kind": "pressure", "radius": f"{radius} m"})
    reading = disc(sensor, mesh, spacing).pressure(bird, contact)
    return Compared(reading, applied, "Pa", {"touching": float(contact.touching)})
