"""Balance of energy and momentum of a simulation: every energy from its own rate, momenta with what left them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.solver.bird.body import BirdBody
from birdstrike.solver.contact import Contact
from birdstrike.solver.kernels.sums import column_sums, moment_of
from birdstrike.solver.target.assembly import Target


class BodyEnergies(Protocol):
    """A body that integrates its own energies."""

    @property
    def energies(self) -> Mapping[str, float]: ...


class Balance:
    """The bodies' energies [J] together, kinetic energies, momenta, and the impulse given to the frame [N s].

    Each body integrates its own: bird_pressure: p dV work; bird_viscous: MU; bird_shock: artificial viscosity;
    bird_stress: work of strength; bird_hourglass: of the hexahedra's hourglass control;
    plate_internal: stress work (elastic and plastic); plate_hourglass; plate_edges: in the edge's springs;
    plate_damping; rivets: what they took, those that broke included; plate_eroded: what eroded shells had taken in;
    contact: in the penalty springs; friction: its heat, where there is friction; eroded: what the eroded particles held
    as pressure and by strength, and springs whose particle or facet is gone; bird_kinetic, plate_kinetic.
    """

    def __init__(self, bird: BirdBody, bodies: Sequence[BodyEnergies], normal_energy: float) -> None:
        self.bodies = bodies
        self.worst = 0.0
        self.normal_energy = normal_energy
        self.frame_impulse, self.contact_moment = np.zeros(3), np.zeros(3)
        self.initial = bird.kinetic_energy()
        self.momentum, self.angular = self.bird_momenta(bird)
        self.kinetic = {"bird_kinetic": self.initial, "plate_kinetic": 0.0}
        self.vector = np.zeros(3)

    @property
    def energy(self) -> dict[str, float]:
        """Energies [J] by name, summed over the bodies."""
        together: dict[str, float] = {}
        for body in self.bodies:
            for name, value in body.energies.items():
                together[name] = together.get(name, 0.0) + value
        return together

    @staticmethod
    def bird_momenta(bird: BirdBody) -> tuple[Array, Array]:
        """Linear [N s] and angular momentum about the plate's centre [N m s] of the half-step velocities."""
        linear, angular = np.zeros(3), np.zeros(3)
        momentum = bird.masses[:, None] * bird.v[: bird.n]
        column_sums(momentum, bird.n, linear)
        moment_of(bird.x, momentum, bird.n, angular)
        return linear, angular

    def add_impulse(self, plate: Target, contact: Contact, reaction: Array, kick: float) -> None:
        """Impulse of the coming kick on the frame, and the contact's moment on the plate about its centre."""
        self.frame_impulse += kick * reaction
        moment_of(plate.x, contact.on_plate, len(plate.x), self.vector)
        self.contact_moment += kick * self.vector

    def energy_error(self) -> float:
        """Energy gained (+) or lost, of the initial kinetic energy normal to the plate."""
        now = sum(self.energy.values()) + sum(self.kinetic.values())
        return (now - self.initial) / self.normal_energy

    def contact_created(self, contact: Contact) -> float:
        """Energy that contact gave without having taken it, of the initial normal kinetic energy; 0 when sound.

        The work of contact against the energy in its springs: a force that appears at depth would show here alone.
        """
        return max(contact.stored - self.energy["contact"], 0.0) / self.normal_energy

    def friction_created(self, contact: Contact) -> float:
        """Energy that friction gave where it should have taken, of the initial normal kinetic energy; 0 when sound."""
        return 0.0 if contact.friction is None else contact.friction.created / self.normal_energy

    def momentum_error(self, bird: BirdBody, plate: Target) -> float:
        """|bird + plate + frame + what damping gave the air - initial| of the initial momentum."""
        now = self.bird_momenta(bird)[0] + plate.mass @ plate.v + self.frame_impulse + plate.air_impulse
        return float(np.linalg.norm(now - self.momentum) / np.linalg.norm(self.momentum))

    def angular_momentum_error(self, bird: BirdBody, half_length: float) -> float:
        """|bird + what contact gave the plate - initial| of momentum times the bird's half length."""
        now = self.bird_momenta(bird)[1] + self.contact_moment
        return float(np.linalg.norm(now - self.angular) / (np.linalg.norm(self.momentum) * half_length))
