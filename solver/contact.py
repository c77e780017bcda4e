"""Contact of the bird with the plate: the facet under each particle, penalty forces and Coulomb friction."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from birdstrike.data.errors import RunFailed, UserError
from birdstrike.data.histories import Array
from birdstrike.solver.bird.body import BirdBody
from birdstrike.solver.kernels.contact import contact_forces, follow_facets
from birdstrike.solver.kernels.friction import friction_forces
from birdstrike.solver.kernels.motion import push_particles
from birdstrike.solver.kernels.neighbours import largest_displacement_squared
from birdstrike.solver.kernels.sums import work_of_forces
from birdstrike.solver.plate.rigid import Target

STICKING = 0.5  # of k m' under the root below
BAND = 1.0  # a particle is watched within this many particle spacings above first contact
OVERLAP_AT_START = 1e-6  # of the gap: rounding of a bird that starts at first contact
MOST_SQUEEZED = 0.02  # share of the bird squeezed through a tear's edge, beyond which the run fails
STILL = np.zeros(3)


class Contact:
    """Penalty contact of particles or of a mesh's nodes, with Coulomb friction where the coefficient is above 0.

    It begins at half the plate's thickness, and before it by the bird's skin: half a spacing from a particle's centre
    to its surface, nothing from a node. Inner nodes come into play when erosion has laid them bare.

    The stiffness is that of one layer of bird, one spacing d thick: bulk modulus times particle face over spacing,
    k = rho0 C^2 d^2/d = rho0 C^2 d [N/m]. A stiffer spring would not make the first layer stiffer than the bird behind
    it; a softer one would make it softer. At the Hugoniot pressure p the overlap is p/(rho0 C^2) d, about 3 % of d.

    The impact side is the one that the bird starts on; `side` is 1 where the shell's normals point there, else -1, and
    quads and across are then those of the shell seen from there. Facets that have torn touch nothing.
    """

    def __init__(self, bird: BirdBody, plate: Target, friction: float = 0.0) -> None:
        self.spacing = bird.spacing
        self.gap = 0.5 * plate.thickness + bird.skin
        self.deepest_allowed = 0.5 * (plate.thickness + self.spacing)
        self.stiffness = bird.bulk_modulus * self.spacing
        self.side, self.quads, self.across = seen_from(bird, plate)
        self.facet, self.foot = np.zeros(bird.n, np.int64), np.zeros((bird.n, 6))
        self.watched, self.past_rim = np.zeros(bird.n, np.bool_), np.zeros(bird.n, np.bool_)
        self.on_bird, self.on_plate = np.zeros((bird.n, 3)), np.zeros((len(plate.x), 3))
        self.on_bird_before, self.on_plate_before = self.on_bird.copy(), self.on_plate.copy()
        self.searched_at: Array = np.full((bird.n, 3), np.inf)
        self.alive_at_search = -1
        self.touching, self.deepest, self.stored, self.squeezed = 0, 0.0, 0.0, 0
        self.energies = {"contact": 0.0, "eroded": 0.0}
        self.friction = None
        if friction > 0.0:
            step_mass = (self.stiffness, self.reduced_mass(bird, plate))
            self.friction = Friction(friction, *step_mass, bird.n, len(plate.x))
            self.energies["friction"] = 0.0

    def refuse_overlap(self, bird: BirdBody, plate: Target) -> None:
        """Raise UserError when the bird starts inside the plate."""
        self.search(bird, plate)
        overlap = float((self.gap - self.foot[:, 2]).max())
        if overlap > OVERLAP_AT_START * self.gap:
            inside = int(np.count_nonzero(self.foot[:, 2] < (1.0 - OVERLAP_AT_START) * self.gap))
            raise UserError(
                f"the bird starts inside the plate: {inside} particles, up to {1e3 * overlap:.3g} mm deep; raise "
                "impact.standoff, or make bird.diameter smaller against the plate's curvature"
            )

    def search(self, bird: BirdBody, plate: Target) -> None:
        """Nearest facet of every particle near the plate, and which particles may touch before the next search."""
        reach = self.gap + BAND * self.spacing
        x, low, high = bird.x[: bird.n], plate.x.min(axis=0) - reach, plate.x.max(axis=0) + reach
        near = np.all((x > low) & (x < high), axis=1)
        alive = np.flatnonzero(plate.alive)
        if len(alive):
            centres = plate.x[self.quads[alive]].mean(axis=1)
            self.facet[near] = alive[KDTree(centres).query(x[near])[1]]
        self.foot[:, :2], self.foot[~near, 2] = 0.0, np.inf
        self.follow(bird, plate, near)
        self.watched = bird.active[: bird.n] & (self.foot[:, 2] < reach)
        self.searched_at, self.alive_at_search = x.copy(), len(alive)

    def follow(self, bird: BirdBody, plate: Target, watched: NDArray[np.bool_]) -> None:
        """Feet of the watched particles on the plate as it is now."""
        surface = (plate.x, self.quads, self.across, plate.alive, self.gap)
        follow_facets(bird.n, bird.x, *surface, watched, self.facet, self.foot, self.past_rim)

    def update_forces(self, bird: BirdBody, plate: Target) -> None:
        """Forces of the present positions on particles and nodes."""
        moved = largest_displacement_squared(bird.x[: bird.n], self.searched_at, STILL)
        torn = np.count_nonzero(plate.alive) != self.alive_at_search
        if torn:
            self.release(~plate.alive[self.facet], self.normal_forces())
        if torn or not moved < (0.5 * BAND * self.spacing) ** 2:
            self.search(bird, plate)
        self.follow(bird, plate, self.watched)
        self.on_bird_before, self.on_bird = self.on_bird, self.on_bird_before
        self.on_plate_before, self.on_plate = self.on_plate, self.on_plate_before
        self.press(bird)
        if self.deepest > self.deepest_allowed:
            self.release_penetrating(bird, plate)
        if self.friction:
            self.friction.update_forces(self, bird, plate)

    def press(self, bird: BirdBody) -> None:
        """Penalty forces at the present feet."""
        where = (self.quads, self.watched, bird.active, self.facet, self.foot)
        self.touching, self.deepest, self.stored = contact_forces(
            bird.n, self.gap, self.stiffness, *where, self.on_bird, self.on_plate
        )

    def release_penetrating(self, bird: BirdBody, plate: Target) -> None:
        """Particles too deep in the plate. Of one that has torn they are on their way through; else the run fails.

        They touch nothing until they are clear of the surface, and what their springs held is frozen. One that nothing
        pushed a step ago came from behind a folded petal, and was not squeezed.
        """
        deep = self.watched & bird.active[: bird.n] & (self.foot[:, 2] < self.gap - self.deepest_allowed)
        self.squeezed += int(np.count_nonzero(deep & self.on_bird_before.any(axis=1)))
        if plate.alive.all() or self.squeezed > MOST_SQUEEZED * bird.n:
            raise RunFailed(
                "the bird has passed the plate's mid-surface", "lower solver.courant or refine bird.particles"
            )
        before = self.on_bird_before - self.friction.on_bird if self.friction else self.on_bird_before
        self.release(deep, before)
        self.past_rim |= deep
        self.foot[deep, 2] = np.inf
        self.press(bird)

    def predict_kick(self, bird: BirdBody, half: float) -> None:
        """What the coming kick will have added to the bird's velocities by the whole step, half [s] from now."""
        np.divide(half * self.on_bird, bird.masses[:, None], out=bird.push[: bird.n])

    def kick(self, bird: BirdBody, dt: float, past: float) -> None:
        """Contact forces act on the bird for dt [s] when the share `past` of its own step is over."""
        push_particles(bird.n, dt, past, bird.masses, self.on_bird, bird.v, bird.lag)

    def normal_forces(self) -> Array:
        """The springs' part of `on_bird`, (n, 3) [N]."""
        return self.on_bird - self.friction.on_bird if self.friction else self.on_bird

    def release(self, gone: NDArray[np.bool_], pushed: Array) -> None:
        """What the springs of these particles held, f^2/(2k), is frozen: their facet or they themselves are gone."""
        frozen = float((pushed[gone] ** 2).sum()) / (2.0 * self.stiffness)
        self.energies["contact"] -= frozen
        self.energies["eroded"] += frozen

    def work(self, bird: BirdBody, plate: Target, dt: float) -> float:
        """Energy [J] that contact took over the step that ended, trapezoidal in the forces."""
        on_bird = work_of_forces(self.on_bird_before, self.on_bird, bird.v, bird.n)
        on_plate = work_of_forces(self.on_plate_before, self.on_plate, plate.v, len(plate.v))
        return -dt * (on_bird + on_plate)

    def update_energies(self, bird: BirdBody, plate: Target, dt: float) -> None:
        """Work of the step that ended, friction's apart; what springs of newly eroded particles held is frozen."""
        self.energies["contact"] += self.work(bird, plate, dt)
        if self.friction:
            heat = self.friction.work(bird, plate, dt)
            self.energies["contact"] -= heat
            self.energies["friction"] += heat
        eroded = bird.eroded_now[: bird.n]
        if eroded.any():
            before = self.on_bird_before - self.friction.on_bird_before if self.friction else self.on_bird_before
            self.release(eroded, before)

    def stable_step(self, bird: BirdBody, plate: Target) -> float:
        """2/omega of a particle on its spring against the lightest node, as many particles on it as fit [s]."""
        return 2.0 / np.sqrt(self.stiffness / self.reduced_mass(bird, plate))

    def reduced_mass(self, bird: BirdBody, plate: Target) -> float:
        """Of a particle against its share of the lightest node [kg]; the particle's own on a plate that cannot move."""
        inverse = 1.0 / bird.masses.min()
        if not plate.fixed.all():
            per_node = max(facet_areas(plate).max() / self.spacing**2, 1.0)
            inverse += per_node / plate.mass.min()
        return float(1.0 / inverse)


class Friction:
    """|F| = mu N against the slip; below the slip mu N/c it is c times the slip, so that sticking is a slow creep.

    c = sqrt(k m')/2, of the contact spring k and the mass m' of a particle against its share of a node: a quarter of
    the spring's critical damping. It is the largest resistance that cannot turn the slip round within a stable step,
    2/omega of the same spring; particles that Coulomb would halt within about two steps creep instead. The friction
    acts at the particle, and the shell gets the couple about its mid-surface (`kernels.friction`).
    """

    def __init__(self, coefficient: float, stiffness: float, reduced_mass: float, particles: int, nodes: int) -> None:
        self.coefficient, self.stiffness = coefficient, stiffness
        self.resistance = STICKING * float(np.sqrt(stiffness * reduced_mass))
        self.on_bird, self.on_plate = np.zeros((particles, 3)), np.zeros((nodes, 3))
        self.on_bird_before, self.on_plate_before = self.on_bird.copy(), self.on_plate.copy()
        self.room = np.zeros((7, 3))

    def update_forces(self, contact: Contact, bird: BirdBody, plate: Target) -> None:
        """Friction of the present normal forces, added to the contact's own."""
        self.on_bird_before, self.on_bird = self.on_bird, self.on_bird_before
        self.on_plate_before, self.on_plate = self.on_plate, self.on_plate_before
        law = (self.coefficient, self.stiffness, self.resistance)
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


def facet_areas(plate: Target) -> Array:
    """Area of each facet, (e,) [m^2]."""
    i, j, k, m = (plate.x[plate.quads[:, corner]] for corner in range(4))
    return 0.5 * np.linalg.norm(np.cross(k - i, m - j), axis=1)


def seen_from(bird: BirdBody, plate: Target) -> tuple[int, NDArray[np.int64], NDArray[np.int64]]:
    """1 where the normal of the facet nearest the bird's centre points to it, else -1; quads and across from there.

    The shell's facets are wound alike. Seen from behind, corners run the other way, and so xi and eta change places.
    """
    corners, centre = plate.x[plate.quads], bird.x[: bird.n].mean(axis=0)
    middle = corners.mean(axis=1)
    nearest = int(np.argmin(((middle - centre) ** 2).sum(axis=1)))
    i, j, k, m = corners[nearest]
    if np.cross(k - i, m - j) @ (centre - middle[nearest]) >= 0.0:
        return 1, plate.quads, plate.mesh.across
    return -1, plate.quads[:, [0, 3, 2, 1]].copy(), plate.mesh.across[:, [2, 3, 0, 1]].copy()
