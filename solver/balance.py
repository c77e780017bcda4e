"""The books of a strike: every energy integrated from its own rate, linear and angular momentum with what left them."""

from __future__ import annotations

import numpy as np

from data.histories import Array
from solver.bird import Bird
from solver.contact import Contact
from solver.kernels.sums import column_sums, moment_of, total
from solver.plate import Plate

ACCOUNTS = (
    "bird_pressure",
    "bird_viscous",
    "bird_shock",
    "plate_internal",
    "plate_hourglass",
    "contact",
    "eroded",
)


class Balance:
    """Energies [J] by name and the impulses given to the frame [N s] since the start.

    bird_pressure: p dV work; bird_viscous: MU; bird_shock: artificial viscosity; plate_internal: stress work (elastic
    and plastic); plate_hourglass; contact: in the penalty springs; eroded: what the eroded particles held as pressure
    and in their springs when they eroded; bird_kinetic, plate_kinetic.
    """

    def __init__(self, bird: Bird, normal_energy: float) -> None:
        self.energy = dict.fromkeys(ACCOUNTS, 0.0)
        self.worst = 0.0
        self.unit_dissipation = 0.0
        self.normal_energy = normal_energy
        self.frame_impulse, self.contact_moment = np.zeros(3), np.zeros(3)
        self.initial = bird.kinetic_energy()
        self.momentum, self.angular = self.bird_momenta(bird)
        self.kinetic = {"bird_kinetic": self.initial, "plate_kinetic": 0.0}
        self.vector = np.zeros(3)

    @staticmethod
    def bird_momenta(bird: Bird) -> tuple[Array, Array]:
        """Linear [N s] and angular momentum about the plate's centre [N m s] of the half-step velocities."""
        linear, angular = np.zeros(3), np.zeros(3)
        column_sums(bird.v, bird.n, linear)
        moment_of(bird.x, bird.v, bird.n, angular)
        return bird.mass * linear, bird.mass * angular

    def add_step(self, bird: Bird, plate: Plate, contact: Contact, dt: float) -> None:
        """Works of the step that ended; the dissipated powers of its end stand for the step around it."""
        self.energy["bird_pressure"] += bird.volume * total(bird.work)
        unit = total(bird.dissipation[:, 0])
        self.unit_dissipation += dt * unit
        self.energy["bird_viscous"] += dt * bird.material.viscosity * unit
        self.energy["bird_shock"] += dt * total(bird.dissipation[:, 1])
        self.energy["plate_internal"] += total(plate.work)
        self.energy["plate_hourglass"] += total(plate.hourglass_work)
        self.energy["contact"] += contact.work(bird, plate, dt)
        if bird.eroded_now.any():
            self.freeze(bird, contact)

    def freeze(self, bird: Bird, contact: Contact) -> None:
        """Move what the newly eroded particles hold to its own account."""
        for particle in np.flatnonzero(bird.eroded_now[: bird.n]):
            pressure, spring = bird.volume * float(bird.stored[particle]), contact.stored_before(int(particle))
            self.energy["bird_pressure"] -= pressure
            self.energy["contact"] -= spring
            self.energy["eroded"] += pressure + spring

    def add_impulse(self, plate: Plate, contact: Contact, reaction: Array, kick: float) -> None:
        """Impulse of the coming kick on the frame, and the contact's moment on the plate about its centre."""
        self.frame_impulse += kick * reaction
        moment_of(plate.x, contact.on_plate, len(plate.x), self.vector)
        self.contact_moment += kick * self.vector

    def energy_error(self) -> float:
        """Energy that went astray, of the initial kinetic energy normal to the plate."""
        now = sum(self.energy.values()) + sum(self.kinetic.values())
        return (now - self.initial) / self.normal_energy

    def contact_created(self, contact: Contact) -> float:
        """Energy that contact gave without having taken it, of the initial normal kinetic energy; 0 when sound.

        The book of contact against the energy in its springs: a force that appears at depth would show here alone.
        """
        return max(contact.stored - self.energy["contact"], 0.0) / self.normal_energy

    def momentum_error(self, bird: Bird, plate: Plate) -> float:
        """|bird + plate + frame - initial| of the initial momentum."""
        now = self.bird_momenta(bird)[0] + plate.mass @ plate.v + self.frame_impulse
        return float(np.linalg.norm(now - self.momentum) / np.linalg.norm(self.momentum))

    def angular_momentum_error(self, bird: Bird, half_length: float) -> float:
        """|bird + what contact gave the plate - initial| of momentum times the bird's half length."""
        now = self.bird_momenta(bird)[1] + self.contact_moment
        return float(np.linalg.norm(now - self.angular) / (np.linalg.norm(self.momentum) * half_length))

    def equivalent_viscosity(self) -> float:
        """Shear viscosity [Pa s] that would have dissipated as much in this flow as the shock viscosity did."""
        return self.energy["bird_shock"] / self.unit_dissipation if self.unit_dissipation > 0.0 else 0.0
