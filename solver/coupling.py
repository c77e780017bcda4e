"""Bird, plate and contact of a case, stepped together in time."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from birdstrike.data.errors import CaseError, RunFailed
from birdstrike.data.histories import Array, Snapshot
from birdstrike.solver.bird.body import BirdBody
from birdstrike.solver.build import build_bird, build_plate, outline_of
from birdstrike.solver.case.case import Case
from birdstrike.solver.case.struck import UP
from birdstrike.solver.contact import Contact
from birdstrike.solver.energy_balance import Balance

PLATE_SAFETY = 0.9  # of the plate's and the contact's stability limit
UNSTABLE = 0.2  # energy error at which a run has gone unstable, far beyond what is accepted


@dataclass
class Steps:
    """Stable steps [s] of the parts, before the safety factors: bird, plate, contact."""

    bird: float
    plate: float
    contact: float

    def counts(self, span: float, courant: float, factor: float = 1.0, subcycled: bool = True) -> tuple[int, int]:
        """Number of the bird's steps in `span` [s], and of the plate's in each of them.

        The Courant number acts on the bird, a fixed safety on the linear parts; factor scales all. The bird's forces
        act as impulses, one a step of the bird: it is kept clear of half a period of the contact spring, pi/omega,
        at which they would drive it. A body that is not subcycled takes the plate's step.
        """
        linear = factor * PLATE_SAFETY * min(self.plate, self.contact)
        coarse = factor * min(courant * self.bird, PLATE_SAFETY * 0.5 * math.pi * self.contact)
        if not subcycled:
            return math.ceil(span / min(coarse, linear)), 1
        steps = math.ceil(span / coarse)
        return steps, math.ceil(span / steps / linear)


def bird_and_step(case: Case) -> tuple[BirdBody, float, float]:
    """The bird, when it is there [s] (`build_bird`), and its stable step [s].

    Raises CaseError where its law has no sound speed at rest or behind the impact's shock, or its mesh no volume.
    """
    law = case.bird.material.law
    if law is not None and not law.build(case.bird.actual_density).sound_speed > 0.0:
        raise CaseError(
            "bird.material.eos has no sound speed at rest: its pressure must rise with density there; check its "
            "constants"
        )
    try:
        with np.errstate(invalid="ignore"):
            bird, begin = build_bird(case)
            step = bird.step_at_impact(case.normal_speed)
    except ValueError:
        bird, begin, step = None, 0.0, math.nan
    if bird is None or not 0.0 < step < math.inf:
        where = "bird.material" if law is None else "bird.material.eos"
        raise CaseError(
            f"{where} has no shock of {case.normal_speed:.4g} m/s, normal to the plate: its pressure must rise with "
            "density; check its constants, or lower impact.speed"
        )
    return bird, begin, step


class Coupling:
    """Bird, plate, contact and their energy balance; one step is `advance`, then `move` or `audit`, which moves too.

    A step is the plate's and the contact's; the bird's own forces act once every `stride` steps as one impulse, and it
    drifts in between under contact alone (multiple time steps: Tuckerman, Berne & Martyna, J. Chem. Phys. 97 (1992)
    1990). Contact forces act on both sides at the same instant, so that momentum and energy are conserved as with
    one step.
    """

    def __init__(self, case: Case, step_factor: float = 1.0) -> None:
        self.plate = build_plate(case)
        self.bird, begin, bird_step = bird_and_step(case)
        self.contact = Contact(self.bird, self.plate, case.impact.friction)
        self.contact.refuse_overlap(self.bird, self.plate)
        normal_speed, plane = case.normal_speed, case.struck_plane
        self.normal = UP if plane is None else plane.normal
        self.limits = Steps(
            bird_step,
            self.plate.stable_step(),
            self.contact.stable_step(self.bird, self.plate),
        )
        self.start(case, begin, step_factor)
        self.balance = Balance(
            self.bird, (self.bird, self.plate, self.contact), 0.5 * case.bird.actual_mass * normal_speed**2
        )
        self.first_touch_off_plate = self._touches_beside(case)
        self.half_length = 0.5 * case.bird.length
        self.reaction, self.push, self.deepest = np.zeros(3), 0.0, 0.0

    def start(self, case: Case, begin: float, step_factor: float = 1.0) -> None:
        """Set the clock to `begin` [s] and divide what is left until the case's end into stable steps."""
        span = case.time.end - begin
        coarse, self.stride = self.limits.counts(span, case.solver.courant, step_factor, self.bird.subcycled)
        self.steps = coarse * self.stride
        self.dt = span / self.steps
        self.step, self.begin, self.time = 0, begin, begin

    def _touches_beside(self, case: Case) -> bool:
        """Whether the first particle to reach the plate's plane is then beside the plate."""
        seen = outline_of(case)
        x = seen.seen(self.bird.x)
        lowest = x[np.argmin(x[:, 2])]
        way = seen.direction[:2] / -seen.direction[2]
        off = np.abs(lowest[:2] + (lowest[2] - self.contact.gap) * way - seen.middle)
        return bool(np.any(off > 0.5 * seen.sides))

    @property
    def at_bird(self) -> bool:
        """Whether the present step is one of the bird's."""
        return self.step % self.stride == 0

    def advance(self) -> None:
        """Forces at the present time, and the energies of the step that led here."""
        bird, plate, contact = self.bird, self.plate, self.contact
        since = self.dt if self.step else 0.0
        if self.at_bird:
            bird.update_density(self.stride * since)
        plate.update_forces(since)
        contact.update_forces(bird, plate)
        if self.at_bird:
            contact.predict_kick(bird, 0.5 * since)
            bird.update_forces(self.stride * since)
        plate.reaction(contact.on_plate, self.reaction)
        self.push = self.push_of(contact.on_plate)
        self.deepest = max(self.deepest, contact.deepest)
        if self.at_bird:
            bird.update_energies(self.stride * since)
        plate.update_energies()
        contact.update_energies(bird, plate, since)

    def push_of(self, forces: Array) -> float:
        """Resultant of forces on the nodes (m, 3) [N] against the normal of the plane that is struck."""
        if self.normal is UP:
            return -float(forces[:, 2].sum())
        return -float(forces.sum(axis=0) @ self.normal)

    def move(self) -> None:
        """Kick to the next half step, drift to the next whole step."""
        kick = self.dt if self.step else 0.5 * self.dt
        self.balance.add_impulse(self.plate, self.contact, self.reaction, kick)
        if self.at_bird:
            self.bird.kick(self.stride * kick)
        self.contact.kick(self.bird, kick, self.step % self.stride / self.stride)
        self.bird.drift(self.dt)
        self.plate.kick_and_drift(kick, self.dt, self.contact.on_plate)
        self.step += 1
        self.time = self.begin + self.step * self.dt

    def audit(self) -> None:
        """`move`, and the energy balance of the whole step that was left, one of the bird's.

        The kinetic energy of the whole step is the mean of those of the half steps around it. Raises RunFailed when
        the run has gone unstable.
        """
        before = (self.bird.kinetic_energy(), self.plate.kinetic_energy())
        self.move()
        after = (self.bird.kinetic_energy(), self.plate.kinetic_energy())
        self.balance.kinetic = {
            "bird_kinetic": 0.5 * (before[0] + after[0]),
            "plate_kinetic": 0.5 * (before[1] + after[1]),
        }
        error = self.balance.energy_error()
        self.balance.worst = max(self.balance.worst, abs(error))
        if not abs(error) < UNSTABLE:
            reason = f"the run went unstable at {1e3 * self.time:.3f} ms: the energy balance is off by {error:.0%}"
            raise RunFailed(reason, "lower solver.courant (or refine bird.particles)")

    def snapshot(self) -> Snapshot:
        """Positions and stresses as they are now."""
        bird, plate = self.bird, self.plate
        n = bird.n
        return Snapshot(
            self.time,
            bird.x[:n].copy(),
            bird.p[:n].copy(),
            bird.v[:n].copy(),
            ~bird.active[:n],
            bird.von_mises(),
            bird.cells,
            plate.x.copy(),
            plate.quads[plate.alive],
            plate.von_mises()[plate.alive],
        )
