"""One simulation: the time loop, its histories and its summary."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from birdstrike.data.errors import RunFailed
from birdstrike.data.histories import Array, Histories, Snapshot, farthest
from birdstrike.data.progress import Progress, silent
from birdstrike.solver.case.case import Case, case_hash
from birdstrike.solver.checks import check_sensors, run_checks, shells_of, warnings_of
from birdstrike.solver.coupling import Coupling
from birdstrike.solver.sensors.recording import Recorder
from birdstrike.solver.threads import MOST_THREADS, Team, limited_threads
from birdstrike.solver.version import SOLVER_VERSION

GIVEN_WAY = 0.2  # plastic strain, or deflection over the shorter side, beyond which a mesh of flat facets folds
AUDIT_EVERY = 20  # steps of the bird


def simulate(
    case: Case,
    *,
    step_factor: float = 1.0,
    threads: int | None = None,
    progress: Progress = silent,
) -> Histories:
    """Simulate a case and return its histories at `time.output_interval`.

    step_factor: scales the stable step (a safer retry uses 0.5); threads: of this run, else `solver.threads`, else all,
    without influence on the bits; progress: called with the share done. Raises RunFailed (unstable, unbalanced,
    non-finite) and UserError (a geometry that cannot be built).
    """
    with limited_threads(threads or case.solver.threads or MOST_THREADS) as team:
        return histories_of(case, step_factor, progress, team)


def histories_of(case: Case, step_factor: float, progress: Progress, team: Team) -> Histories:
    """As `simulate`, on this team of threads."""
    started = time.perf_counter()
    coupling = Coupling(case, step_factor)
    check_sensors(case, coupling.plate.mesh)
    recorder = Recorder(coupling, case.sensors, coupling.steps)
    state = PlateState()

    def audited(share: float) -> None:
        state.note(coupling)
        progress(share)
        team.follow_load()

    try:
        snapshots = run(coupling, recorder, case.time.snapshots, audited)
        figures = summarise(case, coupling)
    except RunFailed as failure:
        explained = state.explained(failure)
        if explained is failure:
            raise  # one that is its own cause could not be pickled: reducers of exceptions follow causes
        raise explained from failure
    clock = np.array(case.time.instants)
    channels = recorder.sampled(clock, case.instrument)
    units = {name: sensor.unit for name, sensor in case.sensors.items()}
    peaks = {name: peak(clock, values) for name, values in channels.items()}
    summary = figures | {"peak": peaks, "wall_s": time.perf_counter() - started}
    return Histories(clock, channels, units, summary, snapshots)


def run(coupling: Coupling, recorder: Recorder, instants: Sequence[float], progress: Progress) -> tuple[Snapshot, ...]:
    """The time loop: forces, readings, snapshots at the steps nearest `instants` [s], motion, audits of the energy."""
    snapshots: list[Snapshot] = []
    due = sorted(instants)
    for step in range(coupling.steps + 1):
        coupling.advance()
        recorder.read(coupling)
        while due and coupling.time >= due[0] - 0.5 * coupling.dt:
            snapshots.append(coupling.snapshot())
            due.pop(0)
        if step % (AUDIT_EVERY * coupling.stride) == 0 or step == coupling.steps:
            coupling.audit()
            progress(step / coupling.steps)
        else:
            coupling.move()
    return tuple(snapshots)


def peak(clock: Array, values: Array) -> dict[str, float]:
    """Largest reading, the one farthest from 0 with its sign, and its time [s]."""
    at = int(farthest(values))
    return {"value": float(values[at]) + 0.0, "time": float(clock[at])}  # a zero without a sign


def summarise(case: Case, coupling: Coupling) -> dict[str, Any]:
    """Energies, counts and warnings of a finished coupling. Raises RunFailed when its balance cannot be believed."""
    bird, plate, balance = coupling.bird, coupling.plate, coupling.balance
    run_checks(coupling, shells_of(case))
    return {
        "schema_version": 1,
        "solver_version": SOLVER_VERSION,
        "case_hash": case_hash(case),
        "steps": coupling.steps,
        "step_s": coupling.dt,
        "bird_steps": coupling.steps // coupling.stride,
        "shells": len(plate.quads),
        **bird.facts(),
        "energy_error": balance.energy_error(),
        "worst_energy_error": balance.worst,
        "momentum_error": balance.momentum_error(bird, plate),
        "angular_momentum_error": balance.angular_momentum_error(bird, coupling.half_length),
        "energies_J": {
            **balance.energy,
            **balance.kinetic,
            "initial": balance.initial,
            "normal": balance.normal_energy,
        },
        "shock_equivalent_viscosity_Pa_s": bird.equivalent_viscosity(),
        "deepest_overlap_m": coupling.deepest,
        "squeezed_through": coupling.contact.squeezed,
        "eroded_shells": plate.eroded,
        "largest_plastic_strain": plate.eps_p,
        **({} if plate.rivets is None else {"rivets": len(plate.rivets), "broken_rivets": plate.rivets.lost}),
        "warnings": warnings_of(case, coupling),
    }


@dataclass
class PlateState:
    """The plate at the last audit that was sound: largest plastic strain, deflection over the shorter side."""

    strain: float = 0.0
    sag: float = 0.0

    def note(self, coupling: Coupling) -> None:
        """Look at the plate as it is now."""
        rest, now = coupling.plate.mesh.nodes, coupling.plate.x
        self.strain = coupling.plate.eps_p
        shorter = float(np.sort(np.ptp(rest, axis=0))[1])  # of a target that stands upright too
        self.sag = float(np.ptp((now - rest) @ coupling.normal)) / shorter

    def explained(self, failure: RunFailed) -> RunFailed:
        """The failure with its physical cause where the plate had given way: then no step or mesh is the remedy."""
        if self.strain < GIVEN_WAY and self.sag < GIVEN_WAY:
            return failure
        held = (
            f"the plate had given way (deflected by {self.sag:.0%} of its shorter side, strained by {self.strain:.0%})"
        )
        return RunFailed(
            f"{failure.reason}; before that {held}",
            f"a thicker plate.thickness or a lower impact.speed; otherwise {failure.remedy}",
        )
