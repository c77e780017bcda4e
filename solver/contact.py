"""Contact of the bird with the shell: which facet each particle is above, and the penalty forces between them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from data.errors import RunFailed
from data.histories import Array
from solver.body import BirdBody
from solver.kernels.contact import contact_forces, follow_facets
from solver.kernels.motion import add_contact
from solver.kernels.neighbours import largest_displacement_squared
from solver.kernels.sums import work_of_forces
from solver.plate import Plate

BAND = 1.0  # a particle is watched within this many particle spacings above first contact
STILL = np.zeros(3)


class Contact:
    """Penalty contact, frictionless, of particles or of a mesh's nodes.

    It begins at half the plate's thickness, and before it by the bird's skin: half a spacing from a particle's centre
    to its surface, nothing from a node. Inner nodes come into play when erosion has laid them bare.

    The stiffness is that of one layer of bird, one spacing d thick: bulk modulus times particle face over spacing,
    k = rho0 C^2 d^2/d = rho0 C^2 d [N/m]. A stiffer spring would not make the first layer stiffer than the bird behind
    it; a softer one would make it softer. At the Hugoniot pressure p the overlap is p/(rho0 C^2) d, about 3 % of d.
    """

    def __init__(self, bird: BirdBody, plate: Plate) -> None:
        self.spacing = bird.spacing
        self.gap = 0.5 * plate.thickness + bird.skin
        self.stiffness = bird.bulk_modulus * self.spacing
        self.facet, self.foot = np.zeros(bird.n, np.int64), np.zeros((bird.n, 6))
        self.watched, self.past_rim = np.zeros(bird.n, np.bool_), np.zeros(bird.n, np.bool_)
        self.everyone = np.ones(bird.n, np.bool_)
        self.on_bird, self.on_plate = np.zeros((bird.n, 3)), np.zeros((len(plate.x), 3))
        self.on_bird_before, self.on_plate_before = self.on_bird.copy(), self.on_plate.copy()
        self.searched_at: Array = np.full((bird.n, 3), np.inf)
        self.touching, self.deepest, self.stored = 0, 0.0, 0.0
        self.accounts = {"contact": 0.0, "eroded": 0.0}

    def search(self, bird: BirdBody, plate: Plate) -> None:
        """Nearest facet of every particle, and which particles may touch before the next search."""
        centres = plate.x[plate.quads].mean(axis=1)
        self.facet[:] = KDTree(centres).query(bird.x[: bird.n])[1]
        self.foot[:, :2] = 0.0
        self.follow(bird, plate, self.everyone)
        self.watched = bird.active[: bird.n] & (self.foot[:, 2] < self.gap + BAND * self.spacing)
        self.searched_at = bird.x[: bird.n].copy()

    def follow(self, bird: BirdBody, plate: Plate, watched: NDArray[np.bool_]) -> None:
        """Feet of the watched particles on the plate as it is now."""
        surface = (plate.x, plate.quads, plate.mesh.across, self.gap)
        follow_facets(bird.n, bird.x, *surface, watched, self.facet, self.foot, self.past_rim)

    def update_forces(self, bird: BirdBody, plate: Plate) -> None:
        """Forces of the present positions on particles and nodes."""
        moved = largest_displacement_squared(bird.x[: bird.n], self.searched_at, STILL)
        if not moved < (0.5 * BAND * self.spacing) ** 2:
            self.search(bird, plate)
        self.follow(bird, plate, self.watched)
        self.on_bird_before, self.on_bird = self.on_bird, self.on_bird_before
        self.on_plate_before, self.on_plate = self.on_plate, self.on_plate_before
        where = (plate.quads, self.watched, bird.active, self.facet, self.foot)
        self.touching, self.deepest, self.stored = contact_forces(
            bird.n, self.gap, self.stiffness, *where, self.on_bird, self.on_plate
        )
        if self.deepest > self.gap:
            raise RunFailed(
                "the bird has passed the plate's mid-surface", "lower solver.courant or refine bird.particles"
            )
        add_contact(bird.n, bird.masses, self.on_bird, bird.acceleration)

    def work(self, bird: BirdBody, plate: Plate, dt: float) -> float:
        """Energy [J] that the contact springs took over the step that ended, trapezoidal in the forces."""
        on_bird = work_of_forces(self.on_bird_before, self.on_bird, bird.v, bird.n)
        on_plate = work_of_forces(self.on_plate_before, self.on_plate, plate.v, len(plate.v))
        return -dt * (on_bird + on_plate)

    def keep_books(self, bird: BirdBody, plate: Plate, dt: float) -> None:
        """Work of the step that ended; what the springs of newly eroded particles held, f^2/(2k), is frozen."""
        self.accounts["contact"] += self.work(bird, plate, dt)
        eroded = bird.eroded_now[: bird.n]
        if eroded.any():
            frozen = float((self.on_bird_before[eroded] ** 2).sum()) / (2.0 * self.stiffness)
            self.accounts["contact"] -= frozen
            self.accounts["eroded"] += frozen

    def stable_step(self, bird: BirdBody, plate: Plate) -> float:
        """2/omega of a particle on its spring against the lightest node, as many particles on it as fit [s]."""
        per_node = max(plate.shape[:, 4].max() / self.spacing**2, 1.0)
        return 2.0 / np.sqrt(self.stiffness * (1.0 / bird.masses.min() + per_node / plate.mass.min()))
