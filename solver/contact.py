"""Contact of the bird with the plate: the facet under each particle, penalty forces and Coulomb friction."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.errors import RunFailed, UserError
from birdstrike.data.histories import Array
from birdstrike.solver.bird.body import BirdBody
from birdstrike.solver.kernels.bird.neighbours import largest_displacement_squared
from birdstrike.solver.kernels.contact.contact import contact_forces, follow_facets
from birdstrike.solver.kernels.contact.friction import friction_forces
from birdstrike.solver.kernels.contact.sheet_contact import NOTHING, find_feet, settle_feet
from birdstrike.solver.kernels.motion import predict_push, push_particles
from birdstrike.solver.kernels.sums import work_of_forces
from birdstrike.solver.target.assembly import Target
from birdstrike.solver.target.mesh import reach_of, vector_areas
from birdstrike.solver.target.sheets import Sheet, sheets_of, whole_sheet

STICKING = 0.5  # of k m' under the root below
BAND = 1.0  # a particle is watched within this many particle spacings above first contact
OVERLAP_AT_START = 1e-6  # of the gap: rounding of a bird that starts at first contact
MOST_SQUEEZED = 0.02  # share of the bird squeezed through a tear's edge, beyond which the run fails
STILL = np.zeros(3)


class SheetContact:
    """Feet of the bird's particles on one sheet of the target's surface.

    gap (e,): distance from a facet's mid-surface at which contact begins [m]; touch (n,): that at which a particle is
    touched, of the facet over which it was last clear, so that no spring jumps where it slides on to a thicker one; 0
    before it is known; room: how much larger than that the overlap is with which it has passed through [m]. On a sheet
    that is touched from one side, `past_rim` (n,) marks the particles that came in from beside; on one that is touched
    from both, what was over a facet when it tore; neither touches anything until it is clear. side (n,): that of the
    particle, 1 where the sheet's normals point; borders, touches (s, n): of each sheet the border that it is beyond and
    its `touch`, `number` being this one's; barred (n,): see `kernels.contact.sheet_contact`.
    """

    def __init__(
        self, sheet: Sheet, target: Target, bird: BirdBody, borders: NDArray[np.int64], touches: Array, number: int
    ) -> None:
        self.sheet, self.quads, self.across = sheet, sheet.quads, sheet.across
        self.borders, self.touches, self.number, self.touch = borders, touches, number, touches[number]
        self.gap = target.skin[sheet.facets] + bird.skin
        self.room = 0.5 * bird.spacing - bird.skin
        self.reach = float(self.gap.max()) + BAND * bird.spacing
        self.nodes = np.unique(sheet.quads)
        self.alive = target.alive[sheet.facets]
        self.facet, self.foot = np.zeros(bird.n, np.int64), np.zeros((bird.n, 6))
        self.watched, self.past_rim = np.zeros(bird.n, np.bool_), np.zeros(bird.n, np.bool_)
        self.side, self.distance = np.zeros(bird.n, np.int64), np.full(bird.n, np.inf)
        self.barred = np.zeros(bird.n, np.bool_)
        self.overlap, self.overlap_before = np.zeros(bird.n), np.zeros(bird.n)
        self.followed = np.empty(0, np.int64)

    def find(self, bird: BirdBody, target: Target) -> NDArray[np.int64]:
        """Nearest facet of every particle near the sheet, and which these are (k,)."""
        x, surface = bird.x[: bird.n], target.x[self.nodes]
        near = np.all((x > surface.min(axis=0) - self.reach) & (x < surface.max(axis=0) + self.reach), axis=1)
        if self.sheet.two_sided:
            self.keep_touching(x, near, target)
        else:
            self.begin(np.flatnonzero(near), self.nearest(x[near], target))
        self.foot[~near, 2] = np.inf
        self.borders[self.number, ~near] = NOTHING
        followed = np.flatnonzero(near)
        self.follow(bird, target, followed)
        return followed

    def watch(self, bird: BirdBody) -> None:
        """Which particles may touch before the next search."""
        height = self.distance if self.sheet.two_sided else self.foot[:, 2]
        self.watched = bird.active[: bird.n] & (height < self.reach)
        self.borders[self.number, ~self.watched] = NOTHING
        watched = np.flatnonzero(self.watched)
        self.followed = np.concatenate([watched[0::2], watched[1::2]])  # a hole's rim costs most: half of it a thread

    def keep_touching(self, x: Array, near: NDArray[np.bool_], target: Target) -> None:
        """On a sheet with two sides, those that touch stay where they are, the others begin at their nearest facet.

        In and out: near (n,), without those that cannot be watched. Those that are far have no side.
        """
        moved = np.flatnonzero(near & (~self.alive[self.facet] | (self.overlap == 0.0)))
        facet = self.nearest(x[moved], target, self.reach)
        near[moved[facet < 0]] = False
        self.begin(moved[facet >= 0], facet[facet >= 0])
        self.side[~near], self.past_rim[~near], self.barred[~near], self.distance[~near] = 0, False, False, np.inf
        self.touch[~near] = self.gap.min()

    def tear(self, alive: NDArray[np.bool_], bird: BirdBody, target: Target) -> None:
        """Facets have torn, alive (f,) of the target: what was over one begins at the nearest that is left.

        On a sheet with two sides; it touches nothing until it is clear.
        """
        self.alive = alive[self.sheet.facets]
        over = self.followed[~self.alive[self.facet[self.followed]]]
        if len(over):
            self.past_rim[over] = True
            self.begin(over, self.nearest(bird.x[over], target))

    def begin(self, particles: NDArray[np.int64], facet: NDArray[np.int64]) -> None:
        """Look for the feet of these particles (k,) from these facets (k,) on."""
        self.facet[particles], self.foot[particles, :2] = facet, 0.0

    def nearest(self, points: Array, target: Target, within: float = math.inf) -> NDArray[np.int64]:
        """The facet left whose centre is nearest to each point (k, 3); -1 where the sheet is farther than `within` [m].

        Where none is left, the first.
        """
        left = np.flatnonzero(self.alive)
        if not (len(points) and len(left)):
            return np.zeros(len(points), np.int64)
        from scipy.spatial import KDTree  # late: a tenth of a second that reading a case need not take

        quads = self.quads[left]
        centres = target.x[quads].mean(axis=1)
        within += float(reach_of(target.x, quads, centres).max())
        close = np.all((centres > points.min(axis=0) - within) & (centres < points.max(axis=0) + within), axis=1)
        if not close.any():
            return np.full(len(points), -1)
        found = KDTree(centres[close]).query(points, distance_upper_bound=within)[1]
        return np.append(left[close], -1)[found]

    def follow(self, bird: BirdBody, target: Target, followed: NDArray[np.int64]) -> None:
        """Feet of these particles (k,) on the sheet as it is now; of one with two sides they are settled later."""
        if not self.sheet.two_sided:
            surface = (target.x, self.quads, self.across, self.alive, self.gap)
            follow_facets(followed, bird.x, *surface, self.facet, self.foot, self.past_rim)
            self.touch[followed] = self.gap[self.facet[followed]]
            return
        sheet, state = (self.quads, self.across, self.alive), (self.facet, self.foot, self.borders[self.number])
        find_feet(followed, bird.x, target.x, sheet, *state, self.distance)

    def settle(self, alive: NDArray[np.bool_], followed: NDArray[np.int64]) -> None:
        """Which feet are touched, once those on all sheets are known; alive (f,): facets of the target."""
        if not self.sheet.two_sided:
            return
        meeting = (self.sheet.start, self.sheet.others, self.sheet.beside, self.sheet.first)
        of_all = (self.borders, self.touches, self.number)
        state = (self.facet, self.foot, self.past_rim, self.barred, self.side, self.distance)
        settle_feet(followed, meeting, alive, of_all, self.gap, *state)


class Contact:
    """Penalty contact of particles or of a mesh's nodes, with Coulomb friction where the coefficient is above 0.

    It begins at half a facet's thickness, and before it by the bird's skin: half a spacing from a particle's centre
    to its surface, nothing from a node. Inner nodes come into play when erosion has laid them bare.

    The stiffness is that of one layer of bird, one spacing d thick: bulk modulus times particle face over spacing,
    k = rho0 C^2 d^2/d = rho0 C^2 d [N/m]. A stiffer spring would not make the first layer stiffer than the bird behind
    it; a softer one would make it softer. At the Hugoniot pressure p the overlap is p/(rho0 C^2) d, about 3 % of d.

    The impact side is the one that the bird starts on; `side` is 1 where the shell's normals point there, else -1. A
    plate of one block is touched from there alone, with quads and across as seen from there; the sheets of any other
    target (`target.sheets`) from both sides and at their borders. Facets that have torn touch nothing.
    """

    def __init__(self, bird: BirdBody, plate: Target, friction: float = 0.0) -> None:
        self.spacing = bird.spacing
        self.stiffness = bird.bulk_modulus * self.spacing
        self.side, quads, across = seen_from(bird, plate)
        tied = {} if plate.ties is None else plate.ties.followed
        cut = [whole_sheet(quads, across)] if plate.one_sided else sheets_of(plate.x, plate.quads, tied)
        of_all = (np.full((len(cut), bird.n), NOTHING), np.zeros((len(cut), bird.n)))
        self.sheets = [SheetContact(sheet, plate, bird, *of_all, number) for number, sheet in enumerate(cut)]
        self.gap = float(max(sheet.gap.max() for sheet in self.sheets))
        self.on_bird, self.on_plate = np.zeros((bird.n, 3)), np.zeros((len(plate.x), 3))
        self.on_bird_before, self.on_plate_before = self.on_bird.copy(), self.on_plate.copy()
        self.searched_at: Array = np.full((bird.n, 3), np.inf)
        self.left = int(np.count_nonzero(plate.alive))
        self.touching, self.deepest, self.stored, self.passed, self.squeezed = 0, 0.0, 0.0, 0, 0
        self.energies = {"contact": 0.0, "eroded": 0.0}
        self.friction = None
        if friction > 0.0:
            step_mass = (self.stiffness, self.reduced_mass(bird, plate))
            self.friction = Friction(friction, *step_mass, len(self.sheets), bird.n, len(plate.x))
            self.energies["friction"] = 0.0

    def widen(self, by: float) -> None:
        """Let contact begin so much farther [m] from the surface, for studies of it."""
        self.gap += by
        for sheet in self.sheets:
            sheet.gap += by
            sheet.reach += by
            sheet.room -= by

    def refuse_overlap(self, bird: BirdBody, plate: Target) -> None:
        """Raise UserError when the bird starts inside the plate."""
        self.search(bird, plate)
        depth = np.max([sheet.gap[sheet.facet] - sheet.foot[:, 2] for sheet in self.sheets], axis=0)
        overlap = float(depth.max())
        if overlap > OVERLAP_AT_START * self.gap:
            inside = int(np.count_nonzero(depth > OVERLAP_AT_START * self.gap))
            where = "the plate" if not plate.mesh.parts else f"the target's part {self._deepest_part(plate)}"
            remedies = ", or put target.origin on the struck part, or turn the mesh: the bird comes from +z"
            origin = remedies if plate.mesh.parts else ""
            raise UserError(
                f"the bird starts inside {where}: {inside} particles, up to {1e3 * overlap:.3g} mm deep; raise "
                f"impact.standoff, or make bird.diameter smaller against the plate's curvature{origin}"
            )

    def _deepest_part(self, plate: Target) -> str:
        """The part that a particle is deepest in."""
        depth = [(sheet.gap[sheet.facet] - sheet.foot[:, 2]).max() for sheet in self.sheets]
        sheet = self.sheets[int(np.argmax(depth))]
        particle = int(np.argmax(sheet.gap[sheet.facet] - sheet.foot[:, 2]))
        facet = sheet.sheet.facets[sheet.facet[particle]]
        return plate.mesh.part_of(int(facet))

    def search(self, bird: BirdBody, plate: Target) -> None:
        """Nearest facets anew."""
        alive = plate.alive
        for sheet in self.sheets:
            sheet.alive = alive[sheet.sheet.facets]
        near = [sheet.find(bird, plate) for sheet in self.sheets]
        for sheet, those in zip(self.sheets, near, strict=True):
            sheet.settle(alive, those)
            sheet.watch(bird)
        self.searched_at = bird.x[: bird.n].copy()

    def keep_up(self, bird: BirdBody, plate: Target) -> None:
        """Release what was over facets that tore; search where the bird has moved far since the last search."""
        alive = plate.alive
        left = int(np.count_nonzero(alive))
        torn, self.left = left != self.left, left
        if torn:
            for sheet in self.sheets:
                self.release(~alive[sheet.sheet.facets[sheet.facet]], sheet.overlap)
                if sheet.sheet.two_sided:
                    sheet.tear(alive, bird, plate)
        moved = largest_displacement_squared(bird.x[: bird.n], self.searched_at, STILL)
        if not moved < (0.5 * BAND * self.spacing) ** 2 or (torn and plate.one_sided):
            self.search(bird, plate)

    def update_forces(self, bird: BirdBody, plate: Target) -> None:
        """Forces of the present positions on particles and nodes."""
        self.keep_up(bird, plate)
        alive = plate.alive
        for sheet in self.sheets:
            if len(sheet.followed):
                sheet.follow(bird, plate, sheet.followed)
        for sheet in self.sheets:
            if len(sheet.followed):
                sheet.settle(alive, sheet.followed)
            sheet.overlap_before, sheet.overlap = sheet.overlap, sheet.overlap_before
        self.on_bird_before, self.on_bird = self.on_bird, self.on_bird_before
        self.on_plate_before, self.on_plate = self.on_plate, self.on_plate_before
        self.press(bird)
        if self.passed:
            self.release_penetrating(bird, plate)
        if self.friction:
            self.friction.update_forces(self, bird, plate)

    def press(self, bird: BirdBody) -> None:
        """Penalty forces at the present feet."""
        self.on_bird[:], self.on_plate[:] = 0.0, 0.0
        self.touching, self.deepest, self.stored, self.passed = 0, 0.0, 0.0, 0
        for sheet in self.sheets:
            if not len(sheet.followed):
                sheet.overlap[:] = 0.0
                continue
            where = (sheet.quads, sheet.watched, bird.active, sheet.facet, sheet.touch, sheet.foot, sheet.overlap)
            touching, deepest, stored, passed = contact_forces(
                bird.n, sheet.room, self.stiffness, *where, self.on_bird, self.on_plate
            )
            self.touching += touching
            self.deepest = max(self.deepest, deepest)
            self.stored += stored
            self.passed += passed

    def release_penetrating(self, bird: BirdBody, plate: Target) -> None:
        """Particles too deep in the plate. Of one that has torn they are on their way through; else the run fails.

        They touch nothing until they are clear of the surface, and what their springs held is frozen. One that nothing
        pushed a step ago came from behind a folded petal, and was not squeezed.
        """
        for sheet in self.sheets:
            deep = sheet.overlap > sheet.touch + sheet.room
            self.squeezed += int(np.count_nonzero(deep & (sheet.overlap_before > 0.0)))
            self.release(deep, sheet.overlap_before)
            sheet.past_rim |= deep
            sheet.foot[deep, 2] = np.inf
        if plate.alive.all() or self.squeezed > MOST_SQUEEZED * bird.n:
            raise RunFailed(
                "the bird has passed the plate's mid-surface", "lower solver.courant or refine bird.particles"
            )
        self.press(bird)

    def predict_kick(self, bird: BirdBody, half: float) -> None:
        """What the coming kick will have added to the bird's velocities by the whole step, half [s] from now."""
        predict_push(bird.n, half, bird.masses, self.on_bird, bird.push)

    def kick(self, bird: BirdBody, dt: float, past: float) -> None:
        """Contact forces act on the bird for dt [s] when the share `past` of its own step is over."""
        push_particles(bird.n, dt, past, bird.masses, self.on_bird, bird.v, bird.lag)

    def release(self, gone: NDArray[np.bool_], overlap: Array) -> None:
        """What the springs of these particles held is frozen: their facet or they themselves are gone."""
        frozen = 0.5 * self.stiffness * float((overlap[gone] ** 2).sum())
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
            for sheet in self.sheets:
                self.release(eroded, sheet.overlap_before)

    def stable_step(self, bird: BirdBody, plate: Target) -> float:
        """2/omega of a particle on its spring against the lightest node, as many particles on it as fit [s]."""
        return 2.0 / np.sqrt(self.stiffness / self.reduced_mass(bird, plate))

    def reduced_mass(self, bird: BirdBody, plate: Target) -> float:
        """Of a particle against its share of the lightest node [kg]; the particle's own on a plate that cannot move.

        In a corner a particle hangs on two springs.
        """
        inverse = 1.0 / bird.masses.min()
        if not plate.fixed.all():
            areas = np.linalg.norm(vector_areas(plate.x, plate.quads), axis=1)
            per_node = max(areas.max() / self.spacing**2, 1.0)
            inverse += per_node / plate.mass[plate.mass > 0.0].min()
        return float(1.0 / inverse) / (1.0 if len(self.sheets) == 1 else 2.0)


class Friction:
    """|F| = mu N against the slip; below the slip mu N/c it is c times the slip, so that sticking is a slow creep.

    c = sqrt(k m')/2, of the contact spring k and the mass m' of a particle against its share of a node: a quarter of
    the spring's critical damping. It is the largest resistance that cannot turn the slip round within a stable step,
    2/omega of the same spring; particles that Coulomb would halt within about two steps creep instead. The friction
    acts at the particle, and the shell gets the couple about its mid-surface (`kernels.contact.friction`).

    `created` [J] is what friction gave where it should have taken, by particles, sheets and steps: those that took more
    do not hide it. 0 but for the rounding of a step in which a slip turns.
    """

    def __init__(
        self, coefficient: float, stiffness: float, reduced_mass: float, sheets: int, particles: int, nodes: int
    ) -> None:
        self.coefficient, self.stiffness = coefficient, stiffness
        self.resistance = STICKING * float(np.sqrt(stiffness * reduced_mass))
        self.on_bird, self.on_plate = np.zeros((particles, 3)), np.zeros((nodes, 3))
        self.on_bird_before, self.on_plate_before = self.on_bird.copy(), self.on_plate.copy()
        self.own, self.own_before = np.zeros((2, sheets, particles, 3))
        self.room = np.zeros((8, 3))
        self.given, self.created = 0.0, 0.0

    def update_forces(self, contact: Contact, bird: BirdBody, plate: Target) -> None:
        """Friction of the present normal forces, added to the contact's own."""
        self.on_bird_before, self.on_bird = self.on_bird, self.on_bird_before
        self.on_plate_before, self.on_plate = self.on_plate, self.on_plate_before
        self.own_before, self.own = self.own, self.own_before
        self.on_bird[:], self.on_plate[:], self.given = 0.0, 0.0, 0.0
        law = (self.coefficient, self.stiffness, self.resistance)
        moving = (bird.v, plate.x, plate.v)
        for sheet in contact.sheets:
            where = (sheet.quads, sheet.watched, bird.active, sheet.facet, sheet.touch, sheet.foot)
            own = (self.own_before[sheet.number], self.own[sheet.number])
            self.given += friction_forces(bird.n, law, *moving, *where, self.room, own, self.on_bird, self.on_plate)
        contact.on_bird += self.on_bird
        contact.on_plate += self.on_plate

    def work(self, bird: BirdBody, plate: Target, dt: float) -> float:
        """Heat [J] of the step that ended, trapezoidal in the forces."""
        on_bird = work_of_forces(self.on_bird_before, self.on_bird, bird.v, bird.n)
        on_plate = work_of_forces(self.on_plate_before, self.on_plate, plate.v, len(plate.v))
        self.created += dt * self.given
        return -dt * (on_bird + on_plate)


def seen_from(bird: BirdBody, plate: Target) -> tuple[int, NDArray[np.int64], NDArray[np.int64]]:
    """1 where the normal of the facet nearest the bird's centre points to it, else -1; quads and across from there.

    The shell's facets are wound alike. Seen from behind, corners run the other way, and so xi and eta change places.
    """
    centre, middle = bird.x[: bird.n].mean(axis=0), plate.x[plate.quads].mean(axis=1)
    nearest = int(np.argmin(((middle - centre) ** 2).sum(axis=1)))
    if vector_areas(plate.x, plate.quads[nearest]) @ (centre - middle[nearest]) >= 0.0:
        return 1, plate.quads, plate.mesh.across
    return -1, plate.quads[:, [0, 3, 2, 1]].copy(), plate.mesh.across[:, [2, 3, 0, 1]].copy()
