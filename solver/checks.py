"""What is said of a finished strike: whether its books can be believed, and what the user should know of it."""

from __future__ import annotations

from birdstrike.data.errors import RunFailed
from birdstrike.solver.case.case import Case
from birdstrike.solver.case.remarks import remarks
from birdstrike.solver.coupling import Strike
from birdstrike.solver.sensors.instrument import unrecorded_ends
from birdstrike.solver.sensors.recording import remarks_on_sensors

BALANCE_LIMIT = 0.01  # of the normal kinetic energy, beyond it a run is not believed; shipped cases stay below 0.005
LINEAR_LIMIT, ANGULAR_LIMIT = 1e-10, 0.01  # of the bird's momentum, and of that times half its length
EROSION_TOLD = 0.05  # share of the bird's mass


def judge(strike: Strike) -> None:
    """Raise RunFailed on books that cannot be believed: energy at the worst audit or made by contact, momentum."""
    worst, created = strike.balance.worst, strike.balance.contact_created(strike.contact)
    if worst > BALANCE_LIMIT:
        raise RunFailed(
            f"the energy balance was off by {worst:.1%} of the normal kinetic energy (limit {BALANCE_LIMIT:.0%})",
            "lower solver.courant or refine bird.particles and plate.elements",
        )
    if created > BALANCE_LIMIT:
        raise RunFailed(
            f"contact made {created:.1%} of the normal kinetic energy out of nothing (limit {BALANCE_LIMIT:.0%})",
            "refine plate.elements or bird.particles; if the bird meets the plate's rim, enlarge the plate",
        )
    linear = strike.balance.momentum_error(strike.bird, strike.plate)
    angular = strike.balance.angular_momentum_error(strike.bird, strike.half_length)
    if linear > LINEAR_LIMIT or angular > ANGULAR_LIMIT:
        raise RunFailed(
            f"momentum went astray: {linear:.0e} of the bird's (limit {LINEAR_LIMIT:.0e}), angular {angular:.1%} "
            f"(limit {ANGULAR_LIMIT:.0%})",
            "lower solver.courant or refine bird.particles",
        )


def untouched(strike: Strike) -> str:
    """Why the bird and the plate never met, and what to change."""
    if (strike.bird.x[: strike.bird.n, 2] < strike.plate.x[:, 2].min()).all():
        return "the bird flew past the plate: enlarge plate.length or plate.width, or aim elsewhere (impact.aim)"
    return "the bird did not touch the plate before time.end: shorten impact.standoff or lengthen time.end"


def warnings_of(case: Case, strike: Strike) -> list[str]:
    """What the user should know about a run that nevertheless finished."""
    warnings = strike.bird.warnings(strike.balance.normal_energy)
    warnings += remarks(case) + remarks_on_sensors(case.sensors, strike) + unrecorded_ends(case.instrument)
    if strike.deepest == 0.0:
        warnings.append(untouched(strike))
    if strike.first_touch_off_plate:
        warnings.append(
            "the bird reaches the plate's plane beside the plate: first contact comes later than stand-off says"
        )
    if strike.bird.facts()["eroded_mass_fraction"] > EROSION_TOLD:
        text = f"erosion took more than {EROSION_TOLD:.0%} of the bird's mass, which then pushed nothing"
        warnings.append(f"{text}: check the bird's limits")
    warnings += case.bird.material.warnings(strike.bird.equivalent_viscosity())
    if torn := strike.plate.eroded:
        warnings.append(f"the plate tore: {torn} of {len(strike.plate.quads)} shells reached the failure strain")
    if squeezed := strike.contact.let_go:
        warnings.append(f"{squeezed} particles were squeezed through the edge of a tear, not through its opening")
    hourglass, internal = strike.balance.energy["plate_hourglass"], strike.balance.energy["plate_internal"]
    if hourglass > 0.05 * internal > 0.0:
        warnings.append(
            f"hourglass energy is {hourglass / internal:.0%} of the plate's internal energy: refine plate.elements"
        )
    return warnings
