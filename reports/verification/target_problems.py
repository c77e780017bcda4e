"""Problems of the target: Wilbeck's pressures on a rigid plate, the impulse of a stop, friction, a pressure gauge."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from data.histories import Histories
from solver.bird import Bird, NullMaterial
from solver.body import BirdBody
from solver.case import Case, load_case
from solver.case_sensors import Sensor
from solver.contact import Contact
from solver.eos import grueneisen
from solver.gauges import disc
from solver.kernels.sums import column_sums
from solver.rigid_plate import RigidPlate
from solver.shell_mesh import plate_mesh
from solver.simulate import simulate
from solver.strike import Strike
from solver.wilbeck import duration, hugoniot_pressure, peak, stagnation_pressure, steady_mean

DENSITY, C, S1 = 938.0, 1670.0, 2.48
DIAMETER = 0.1  # m
GAUGE = 0.1  # of the diameter: the gauge's radius
STILL = 1e-3  # of the peak: the force below which an impact is over


@dataclass(frozen=True)
class Compared:
    """A computed value and its reference, both SI, and what else was seen."""

    computed: float
    reference: float
    unit: str
    seen: dict[str, float]

    @property
    def error(self) -> float:
        """Relative to the reference."""
        return self.computed / self.reference - 1.0


def rigid_case(spacing: float, length: float, speed: float, end: float, **changes: str) -> Case:
    """A flat cylinder of DIAMETER, particles `spacing` [m] apart, end on against a rigid plate; no cutoff, no MU."""
    particles = round(0.25 * np.pi * DIAMETER**2 * length / spacing**3)
    table = {
        "plate.rigid": "true",
        "plate.length": "600 mm",
        "plate.width": "600 mm",
        "plate.elements": "[30, 30]",
        "bird.shape": "cylinder",
        "bird.diameter": f"{DIAMETER} m",
        "bird.length": f"{length} m",
        "bird.density": f"{DENSITY} kg/m^3",
        "bird.particles": f"{particles}",
        "bird.material.pressure_cutoff": "0 MPa",
        "bird.material.viscosity": "0 Pa s",
        "bird.material.compression_erosion": "0.0",
        "impact.speed": f"{speed} m/s",
        "impact.angle": "90 deg",
        "impact.standoff": "0 mm",
        "time.end": f"{end} s",
        "time.output_interval": "2 us",
        "time.snapshots": "[]",
        "sensors.centre.kind": "pressure",
        "sensors.centre.radius": f"{GAUGE * DIAMETER} m",
    }
    return load_case("reference_strike", table | {key.replace("__", "."): text for key, text in changes.items()})


def stagnation(speed: float = 200.0, spacings: float = 3.0, slenderness: float = 3.0) -> Compared:
    """Mean gauge pressure over t_D/3 .. 2 t_D/3 against rho u0^2/2; the gauge's radius is so many spacings.

    Seen: the peak and its share of the Hugoniot pressure, the particles, and the pressure's scatter about the mean.
    """
    run = against_rigid(speed, spacings, slenderness)
    return steady_pressure(run, speed, slenderness)


def against_rigid(speed: float, spacings: float, slenderness: float) -> Histories:
    """The run of `stagnation`, until the steady phase's end at 2 t_D/3."""
    length = slenderness * DIAMETER
    case = rigid_case(GAUGE * DIAMETER / spacings, length, speed, 2.01 * duration(length, speed) / 3.0)
    return simulate(case, threads=1)


def steady_pressure(run: Histories, speed: float, slenderness: float) -> Compared:
    """What `stagnation` says of its run."""
    whole = duration(slenderness * DIAMETER, speed)
    curve = run.channels["centre"]
    steady = (run.time > whole / 3.0) & (run.time < 2.0 * whole / 3.0)
    top, when = peak(run.time, curve)
    seen = {
        "peak": top,
        "peak_time": when,
        "peak_over_hugoniot": top / hugoniot_pressure(DENSITY, C, S1, speed),
        "scatter": float(curve[steady].std()),
        "particles": float(run.summary["particles"]),
    }
    return Compared(steady_mean(run.time, curve, 0.0, whole), stagnation_pressure(DENSITY, speed), "Pa", seen)


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
    strike = Strike(rigid_case(spacing, length, speed, 4.0 * duration(length, speed), **(reference | changes)))
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
