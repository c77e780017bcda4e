"""Simulate one strike: the loop, its histories and its summary."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numba
import numpy as np

from birdstrike.data.errors import RunFailed
from birdstrike.data.histories import Array, Histories, Snapshot
from birdstrike.solver.case.case import Case, case_hash
from birdstrike.solver.checks import judge, warnings_of
from birdstrike.solver.coupling import Strike
from birdstrike.solver.estimate import estimate
from birdstrike.solver.sensors.recording import Recorder
from birdstrike.solver.version import SOLVER_VERSION

if TYPE_CHECKING:
    from birdstrike.solver.coupling import Strike

GIVEN_WAY = 0.2  # plastic strain, or deflection over the shorter side, beyond which a mesh of flat facets folds


@dataclass
class PlateState:
    """The plate at the last audit that was sound: largest plastic strain, deflection over the shorter side."""

    strain: float = 0.0
    sag: float = 0.0

    def note(self, strike: Strike) -> None:
        """Look at the plate as it is now."""
        rest, now = strike.plate.mesh.nodes, strike.plate.x
        self.strain = float(strike.plate.eps_p.max())
        self.sag = float(np.ptp(now[:, 2] - rest[:, 2]) / np.ptp(rest[:, :2], axis=0).min())

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


__all__ = ["SOLVER_VERSION", "estimate", "simulate"]

MOST_THREADS = numba.get_num_threads()  # what the process may use, read before anyone lowers it
AUDIT_EVERY = 20  # steps of the bird


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
    clock = np.array(case.time.instants)
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
