"""Rubbing: Coulomb friction of the bird on the shell's surface, and its heat."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from solver.body import BirdBody
from solver.kernels.friction import friction_forces
from solver.kernels.sums import work_of_forces
from solver.rigid_plate import Target

if TYPE_CHECKING:
    from solver.contact import Contact

STICKING = 0.5  # of k m' under the root below


class Rubbing:
    """|F| = mu N against the slip; below the slip mu N/c it is c times the slip, so that sticking is a slow creep.

    c = sqrt(k m')/2, of the contact spring k and the mass m' of a particle against its share of a node: a quarter of
    the spring's critical damping. It is the largest resistance that cannot turn the slip round within a stable step,
    2/omega of the same spring; particles that Coulomb would halt within about two steps creep instead. The friction
    acts at the particle, and the shell gets the couple about its mid-surface (`kernels.friction`).
    """

    def __init__(self, friction: float, contact: Contact, bird: BirdBody, plate: Target) -> None:
        self.friction = friction
        self.resistance = STICKING * float(np.sqrt(contact.stiffness * contact.reduced_mass(bird, plate)))
        self.on_bird, self.on_plate = np.zeros_like(contact.on_bird), np.zeros_like(contact.on_plate)
        self.on_bird_before, self.on_plate_before = self.on_bird.copy(), self.on_plate.copy()
        self.room = np.zeros((7, 3))

    def update_forces(self, contact: Contact, bird: BirdBody, plate: Target) -> None:
        """Friction of the present normal forces, added to the contact's own."""
        self.on_bird_before, self.on_bird = self.on_bird, self.on_bird_before
        self.on_plate_before, self.on_plate = self.on_plate, self.on_plate_before
        law = (self.friction, contact.stiffness, self.resistance)
        where = (contact.quads, contact.watched, bird.active, contact.facet, contact.foot)
        moving = (bird.v, plate.x, plate.v)
        friction_forces(bird.n, law, contact.gap, *moving, *where, self.room, self.on_bird, self.on_plate)
        contact.on_bird += self.on_bird
        contact.on_plate += self.on_plate

    def work(self, bird: BirdBody, plate: Target, dt: float) -> float:
        """Heat [J] of the step that ended, trapezoidal in the forces."""
        on_bird = work_of_forces(self.on_bird_before, self.on_bird, bird.v, bird.n)
        on_plate = work_of_forces(self.on_plate_before, self.on_plate, plate.v, len(plate.v))
        return -dt * (on_bird + on_plate)
