"""Checks of a run: its sensors before it; after it the energy and momentum balance against limits, and warnings."""

from __future__ import annotations

import math

from birdstrike.data.errors import RunFailed
from birdstrike.solver.case.case import Case
from birdstrike.solver.coupling import Coupling
from birdstrike.solver.sensors.recording import refuse_misplaced, remarks_on_sensors
from birdstrike.solver.setup_warnings import aimed_off, setup_warnings
from birdstrike.solver.target.mesh import ShellMesh

BALANCE_LIMIT = 0.01  # of the normal kinetic energy, beyond it a run fails; shipped cases stay below 0.005
LINKED_LIMIT = 0.02  # the same of a target that tears, or has ties or rivets
LINEAR_LIMIT, ANGULAR_LIMIT = 1e-10, 0.01  # of the bird's momentum, and of that times half its length
LINKED_LINEAR_LIMIT = 1e-9
FRICTION_LIMIT = 1e-4  # of the normal kinetic energy that friction gave: sound runs stay below 1e-5, tearing ones too
COURANT_MARGIN, LEAST_COURANT = 0.85, 0.05
EROSION_LIMIT = 0.05  # share of the bird's mass


def check_sensors(case: Case, mesh: ShellMesh) -> None:
    """Raise UserError where sensors do not lie on these shells at rest, what is wrong with the aim said first."""
    refuse_misplaced(case.sensors, mesh, aimed_off(case))


def run_checks(coupling: Coupling, shells: str = "plate.elements") -> None:
    """Raise RunFailed where energy, at the worst audit or made by contact, or momentum is beyond its limit.

    shells: what refines them, see `shells_of`.
    """
    plate, balance = coupling.plate, coupling.balance
    linked = plate.eroded > 0 or plate.ties is not None or plate.rivets is not None
    limit, linear_limit = (LINKED_LIMIT, LINKED_LINEAR_LIMIT) if linked else (BALANCE_LIMIT, LINEAR_LIMIT)
    if balance.worst > limit:
        raise RunFailed(
            f"the energy balance was off by {balance.worst:.1%} of the normal kinetic energy (limit {limit:.0%})",
            f"{shorter_step(coupling, limit)}refine bird.particles and {shells}",
        )
    created = balance.contact_created(coupling.contact)
    if created > limit:
        raise RunFailed(
            f"contact created {created:.1%} of the normal kinetic energy (limit {limit:.0%})",
            f"refine {shells} or bird.particles; if the bird meets the plate's rim, enlarge the plate",
        )
    rubbed = balance.friction_created(coupling.contact)
    if rubbed > FRICTION_LIMIT:
        raise RunFailed(
            f"friction created {rubbed:.2%} of the normal kinetic energy (limit {FRICTION_LIMIT:.2%})",
            "lower solver.courant or impact.friction",
        )
    linear = balance.momentum_error(coupling.bird, plate)
    angular = balance.angular_momentum_error(coupling.bird, coupling.half_length)
    if linear > linear_limit or angular > ANGULAR_LIMIT:
        raise RunFailed(
            f"momentum is not conserved: {linear:.0e} of the bird's (limit {linear_limit:.0e}), angular {angular:.1%} "
            f"(limit {ANGULAR_LIMIT:.0%})",
            "lower solver.courant or refine bird.particles",
        )


def shorter_step(coupling: Coupling, limit: float) -> str:
    """`lower solver.courant to 0.3 or `, with which a run whose energy balance is off should stay within the limit.

    At shallow angles, where the balance is a share of little energy, its error fell with the step's power 1.5 to 2.
    Nothing where the step is as short as the least Courant number that a case may state makes it.
    """
    used = min(coupling.stride * coupling.dt / coupling.limits.bird, 1.0)
    if used <= LEAST_COURANT:
        return ""
    wanted = COURANT_MARGIN * used * (limit / coupling.balance.worst) ** (2.0 / 3.0)
    return f"lower solver.courant to {max(math.floor(100.0 * wanted) / 100.0, LEAST_COURANT):.2g} or "


def shells_of(case: Case) -> str:
    """The key, or the file, by which the shells of a case are made smaller."""
    if case.target is None:
        return "plate.elements"
    return "target.generator.element_size" if case.mesh_file is None else "the file of target.mesh"


def untouched(coupling: Coupling) -> str:
    """Why the bird and the plate never met, and what to change."""
    behind = (coupling.plate.x @ coupling.normal).min()
    if (coupling.bird.x[: coupling.bird.n] @ coupling.normal < behind).all():
        return "the bird flew past the plate: enlarge it, or aim elsewhere (impact.offset, impact.point, impact.angle)"
    return "the bird did not touch the plate before time.end: shorten impact.standoff or lengthen time.end"


def warnings_of(case: Case, coupling: Coupling) -> list[str]:
    """What the user should know about a run that nevertheless finished, the gravest first."""
    return [
        *_of_the_meeting(coupling),
        *remarks_on_sensors(case.sensors, coupling),
        *_of_what_failed(coupling),
        *coupling.bird.warnings(coupling.balance.normal_energy),
        *case.bird.material.warnings(coupling.bird.equivalent_viscosity()),
        *_of_hourglass(case, coupling),
        *setup_warnings(case),
    ]


def _of_the_meeting(coupling: Coupling) -> list[str]:
    """Bird and plate that never met, or met later than the stand-off says."""
    found = [untouched(coupling)] if coupling.deepest == 0.0 else []
    if coupling.first_touch_off_plate:
        found.append(
            "the bird reaches the plate's plane beside the plate: first contact comes later than stand-off says"
        )
    return found


def _of_what_failed(coupling: Coupling) -> list[str]:
    """Torn shells, broken rivets, particles squeezed through a tear, an eroded bird."""
    found = []
    if torn := coupling.plate.eroded:
        found.append(f"the plate tore: {torn} of {len(coupling.plate.quads)} shells reached the failure strain")
    rivets = coupling.plate.rivets
    if rivets is not None and rivets.lost:
        told = rivets.losses(coupling.begin)
        found.append(f"{rivets.lost} of {len(rivets)} rivets broke: they hold nothing since then ({told})")
    if squeezed := coupling.contact.squeezed:
        found.append(f"{squeezed} particles were squeezed through the edge of a tear, not through its opening")
    if coupling.bird.facts()["eroded_mass_fraction"] > EROSION_LIMIT:
        text = f"erosion took more than {EROSION_LIMIT:.0%} of the bird's mass, which then pushed nothing"
        found.append(f"{text}: check the bird's limits")
    return found


def _of_hourglass(case: Case, coupling: Coupling) -> list[str]:
    hourglass, internal = coupling.balance.energy["plate_hourglass"], coupling.balance.energy["plate_internal"]
    if not hourglass > 0.05 * internal > 0.0:
        return []
    return [f"hourglass energy is {hourglass / internal:.0%} of the plate's internal energy: refine {shells_of(case)}"]
