"""Simulate one strike: the loop, its histories and its summary."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Any

import numba
import numpy as np

from data.errors import RunFailed
from data.histories import Array, Histories, Snapshot
from solver.case import Case, case_hash
from solver.estimate import estimate
from solver.gauges import coarse_gauges
from solver.instrument import unrecorded_ends
from solver.places import place_on
from solver.plate_state import PlateState
from solver.sensors import Recorder
from solver.strike import Strike
from solver.version import SOLVER_VERSION

__all__ = ["SOLVER_VERSION", "estimate", "simulate"]

MOST_THREADS = numba.get_num_threads()  # what the process may use, read before anyone lowers it
AUDIT_EVERY = 20  # steps of the bird
BALANCE_LIMIT, BALANCE_GOAL = 0.02, 0.01  # beyond the limit a run is not believed, beyond the goal it says so
LINEAR_LIMIT, ANGULAR_LIMIT = 1e-10, 0.01  # of the bird's momentum, and of that times half its length
EROSION_TOLD = 0.05  # share of the bird's mass
SHOCK_VISCOSITY_LIMIT = 75.0  # Pa s: 5 % of the range of MU


def simulate(
    case: Case,
    *,
    step_factor: float = 1.0,
    threads: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> Histories:
    """Run one strike and return its histories at `time.output_interval`.

    step_factor: scales the stable step (a safer retry uses 0.5); threads: of this run, else `solver.threads`, else all,
    without influence on the bits; progress: called with the share done. Raises RunFailed (unstable, unbalanced,
    non-finite) and UserError (a geometry that cannot be built).
    """
    numba.set_num_threads(min(threads or case.solver.threads or MOST_THREADS, MOST_THREADS))
    started = time.perf_counter()
    strike = Strike(case, step_factor)
    recorder = Recorder(strike, case.sensors, strike.steps)
    state, tell = PlateState(), progress or silent

    def audited(share: float) -> None:
        state.note(strike)
        tell(share)

    try:
        snapshots = run(strike, recorder, case.time.snapshots, audited)
        books = summarise(case, strike)
    except RunFailed as failure:
        raise state.explained(failure) from failure
    interval = case.time.output_interval
    clock = interval * np.arange(int(case.time.end / interval * (1.0 + 1e-12)) + 1)
    channels = recorder.sampled(clock, case.instrument)
    units = {name: sensor.unit for name, sensor in case.sensors.items()}
    peaks = {name: peak(clock, values) for name, values in channels.items()}
    summary = books | {"peak": peaks, "wall_s": time.perf_counter() - started}
    return Histories(clock, channels, units, summary, snapshots)


def run(
    strike: Strike, recorder: Recorder, instants: Sequence[float], progress: Callable[[float], None]
) -> tuple[Snapshot, ...]:
    """The time loop: forces, readings, snapshots at the steps nearest `instants` [s], motion; books audited."""
    snapshots: list[Snapshot] = []
    due = sorted(instants)
    for step in range(strike.steps + 1):
        strike.advance()
        recorder.read(strike)
        while due and strike.time >= due[0] - 0.5 * strike.dt:
            snapshots.append(strike.snapshot())
            due.pop(0)
        if step % (AUDIT_EVERY * strike.stride) == 0 or step == strike.steps:
            strike.audit()
            progress(step / strike.steps)
        else:
            strike.move()
    return tuple(snapshots)


def silent(_share: float) -> None:
    """Progress that nobody watches."""


def peak(clock: Array, values: Array) -> dict[str, float]:
    """Largest reading in the push and its time [s]."""
    at = int(np.argmax(values))
    return {"value": float(values[at]), "time": float(clock[at])}


def summarise(case: Case, strike: Strike) -> dict[str, Any]:
    """Books, counts and warnings of a finished strike. Raises RunFailed when its balance cannot be believed."""
    bird, plate, balance = strike.bird, strike.plate, strike.balance
    judge(strike)
    return {
        "schema_version": 1,
        "solver_version": SOLVER_VERSION,
        "case_hash": case_hash(case),
        "steps": strike.steps,
        "step_s": strike.dt,
        "bird_steps": strike.steps // strike.stride,
        "shells": len(plate.quads),
        **bird.facts(),
        "energy_error": balance.energy_error(),
        "worst_energy_error": balance.worst,
        "momentum_error": balance.momentum_error(bird, plate),
        "angular_momentum_error": balance.angular_momentum_error(bird, strike.half_length),
        "energies_J": {
            **balance.energy,
            **balance.kinetic,
            "initial": balance.initial,
            "normal": balance.normal_energy,
        },
        "shock_equivalent_viscosity_Pa_s": bird.equivalent_viscosity(),
        "deepest_overlap_m": strike.deepest,
        "squeezed_through": strike.contact.let_go,
        "eroded_shells": plate.eroded,
        "largest_plastic_strain": float(plate.eps_p.max()),
        "warnings": warnings_of(case, strike),
    }


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


def torn_sensors(case: Case, strike: Strike) -> list[str]:
    """Sensors whose shell is gone: their node flies on freely, their strain stands still."""
    placed = {n: sensor for n, sensor in case.sensors.items() if sensor.kind in ("displacement", "strain")}
    gone = [n for n, sensor in placed.items() if not strike.plate.alive[place_on(strike.plate.mesh, sensor.at)[0]]]
    return [f"sensors.{name} lies on a shell that tore: what it reads since then is no measurement" for name in gone]


def warnings_of(case: Case, strike: Strike) -> list[str]:
    """What the user should know about a run that nevertheless finished."""
    warnings = strike.bird.warnings(strike.balance.normal_energy)
    warnings += coarse_gauges(case.sensors, strike) + unrecorded_ends(case.instrument)
    if strike.deepest == 0.0:
        warnings.append(untouched(strike))
    if strike.first_touch_off_plate:
        warnings.append(
            "the bird reaches the plate's plane beside the plate: first contact comes later than stand-off says"
        )
    if strike.bird.facts()["eroded_mass_fraction"] > EROSION_TOLD:
        text = f"erosion took more than {EROSION_TOLD:.0%} of the bird's mass, which then pushed nothing"
        warnings.append(f"{text}: check the bird's limits")
    worst, viscosity = strike.balance.worst, strike.bird.equivalent_viscosity()
    if worst > BALANCE_GOAL:
        warnings.append(f"the energy balance was off by {worst:.1%} of the normal kinetic energy; the goal is 1 %")
    if viscosity > SHOCK_VISCOSITY_LIMIT:
        text = f"the shock viscosity dissipated as much as a shear viscosity of {viscosity:.0f} Pa s would"
        warnings.append(f"{text}, more than 5 % of the range of a NULL bird's MU: refine bird.particles")
    if (
        not case.plate.rigid
        and case.plate.edges == "free"
        and any(sensor.kind == "reaction_force" for sensor in case.sensors.values())
    ):
        warnings.append("a plate with free edges has no frame: its reaction force is zero")
    if torn := strike.plate.eroded:
        warnings.append(f"the plate tore: {torn} of {len(strike.plate.quads)} shells reached the failure strain")
        warnings += torn_sensors(case, strike)
    if squeezed := strike.contact.let_go:
        warnings.append(f"{squeezed} particles were squeezed through the edge of a tear, not through its opening")
    hourglass, internal = strike.balance.energy["plate_hourglass"], strike.balance.energy["plate_internal"]
    if hourglass > 0.05 * internal > 0.0:
        warnings.append(
            f"hourglass energy is {hourglass / internal:.0%} of the plate's internal energy: refine plate.elements"
        )
    return warnings
