"""Simulations of the verification: a shipped case, its changes, and variations of the set-up that no case key names."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from birdstrike.data.histories import Array, Histories
from birdstrike.data.progress import silent
from birdstrike.data.storage.store import RunStore, run_key
from birdstrike.solver.build import bird_lattice, in_flight
from birdstrike.solver.case.case import Case, load_case
from birdstrike.solver.coupling import Coupling
from birdstrike.solver.sensors.recording import Recorder
from birdstrike.solver.simulate import run, simulate, summarise
from birdstrike.solver.version import SOLVER_VERSION


@dataclass(frozen=True)
class RunSpec:
    """One simulation. changes: dotted keys and texts, as of `--set`.

    roll: turn of the lattice about the bird's axis [rad]; gap: added to the contact gap [m]; stiffness: factor on the
    contact's penalty. The bird begins where it would without them.
    """

    case: str
    changes: tuple[tuple[str, str], ...] = ()
    roll: float = 0.0
    gap: float = 0.0
    stiffness: float = 1.0

    def with_(self, **changes: str) -> RunSpec:
        """The simulation with further changes, dots written as double underscores."""
        more = {key.replace("__", "."): value for key, value in changes.items()}
        return RunSpec(self.case, tuple((dict(self.changes) | more).items()), self.roll, self.gap, self.stiffness)

    def load(self) -> Case:
        """Its case."""
        return load_case(self.case, dict(self.changes))

    def key(self) -> str:
        """Its name in the run store."""
        varied = {"roll": self.roll, "gap": self.gap, "stiffness": self.stiffness}
        return run_key(self.load().canonical() | {"varied": varied}, SOLVER_VERSION)


def histories_of(spec: RunSpec, store: RunStore) -> Histories:
    """Its histories, from the store where it has run before. Raises RunFailed."""
    kept = store.look_up(spec.key())
    if kept is None:
        kept = compute(spec)
        store.save(spec.key(), kept)
    return kept


def compute(spec: RunSpec) -> Histories:
    """Run the simulation on one thread."""
    case = spec.load()
    if (spec.roll, spec.gap, spec.stiffness) == (0.0, 0.0, 1.0):
        return simulate(case, threads=1)
    varied = Coupling(case)
    vary(varied, case, spec)
    recorder = Recorder(varied, case.sensors, varied.steps)
    snapshots = run(varied, recorder, case.time.snapshots, silent)
    clock = np.array(case.time.instants)
    units = {name: sensor.unit for name, sensor in case.sensors.items()}
    return Histories(clock, recorder.sampled(clock), units, summarise(case, varied), snapshots)


def vary(coupling: Coupling, case: Case, spec: RunSpec) -> None:
    """Turn the bird's lattice, change the contact, and put the bird back where the case lets it begin."""
    bird = coupling.bird
    coupling.contact.widen(spec.gap)
    coupling.contact.stiffness *= spec.stiffness
    points, _ = bird_lattice(case.bird)
    c, s = math.cos(spec.roll), math.sin(spec.roll)
    points = points @ np.array([[1.0, 0.0, 0.0], [0.0, c, s], [0.0, -s, c]])
    bird.x[: bird.n], _, begin = in_flight(case, points, coupling.contact.gap - 0.5 * case.plate.thickness)
    coupling.start(case, begin)
    coupling.balance.momentum, coupling.balance.angular = coupling.balance.bird_momenta(bird)


def momentum_given(histories: Histories) -> Array:
    """J(t) [N s]: momentum normal to the plate that contact took from the bird so far."""
    force = histories.channels["contact_force"]
    steps = 0.5 * (force[1:] + force[:-1]) * np.diff(histories.time)
    return np.concatenate([[0.0], np.cumsum(steps)])
