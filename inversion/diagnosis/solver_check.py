"""The solver once more at the fits: the case as declared, with the fitted parameters and effects written into it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from birdstrike.data.histories import Array, Histories
from birdstrike.data.units import quantity_text
from birdstrike.inversion.diagnosis.hypotheses import Hypothesis, Suspect
from birdstrike.inversion.diagnosis.refit import Fit
from birdstrike.inversion.diagnosis.setup import stack
from birdstrike.inversion.diagnosis.shots import Shot
from birdstrike.inversion.diagnosis.simulations import Strikes
from birdstrike.solver.case.case import Case
from birdstrike.solver.case.overlay import Raw
from birdstrike.solver.sensors.instrument import Instrument


@dataclass(frozen=True)
class SolverRun:
    """One run at a fit. curve: (n,) on the record's points; mismatch: RMS of the run less the fit by channel, SI."""

    case: Case
    curve: Array


def case_at(shot: Shot, fit: Fit, hypothesis: Hypothesis) -> Case:
    """The declared case with the fit's parameters and effects."""
    plan = shot.setup.plan
    case = plan.case.with_values(plan.values(fit.places.z[shot.group]))
    acting = [one for one in hypothesis.members if shot.name in one.shots]
    common = {one.name: size_of(one, fit) for one in acting if one.label.split("@")[0] == one.name}
    common = {name: value for name, value in common.items() if np.isfinite(value) and value}
    if common:
        case = case.with_effects({**case.effects, **common})
    single = [one for one in acting if one.label.split("@")[0] != one.name]
    table = _instruments(case, [(one, size_of(one, fit)) for one in single])
    return case.overlaid(table) if table else case


def size_of(one: Suspect, fit: Fit) -> float:
    """SI magnitude where the fit stands, held to what was looked at."""
    low, high = one.limits
    return one.magnitude(float(np.clip(fit.places.h.get(one.label, 0.0), low, high)))


def _instruments(case: Case, faults: Sequence[tuple[Suspect, float]]) -> Raw:
    """Tables of the instruments of single sensors with a fault in each."""
    table: Raw = {}
    for one, x in faults:
        sensor = one.fault.sensors[0] if one.fault else ""
        own = case.instrument.get(sensor, Instrument())
        changed = {
            "sensor_gain": {"gain": own.gain * (1.0 + x)},
            "time_offset": {"time_offset": quantity_text(own.time_offset + x, "s")},
            "sensor_drift": {"drift": quantity_text(own.drift + x, "m/s")},
            "sensor_bandwidth": {"bandwidth": quantity_text(1.0 / (2.0 * np.pi * max(x, 1e-9)), "1/s")},
        }[one.name]
        table.setdefault("instrument", {}).setdefault(sensor, {}).update(changed)
    return table


def run_at(
    wanted: Mapping[str, tuple[Shot, Fit, Hypothesis]], strikes: Strikes
) -> tuple[dict[str, SolverRun], dict[str, str]]:
    """Runs by label, and why the others failed."""
    cases = {label: case_at(*one) for label, one in wanted.items()}
    runs = strikes.run(cases)
    found = {
        label: SolverRun(cases[label], carried(wanted[label][0], wanted[label][1], histories))
        for label, histories in runs.items()
    }
    return found, {label: strikes.failures[label] for label in cases if label not in runs}


def carried(shot: Shot, fit: Fit, histories: Histories) -> Array:
    """(n,) a run's curve on the record's points."""
    return shot.sample(stack(histories, shot.setup.time, shot.setup.channels)[None])[0]


def errors(shot: Shot, curve: Array) -> dict[str, float]:
    """channel -> RMS of record less curve, SI."""
    residual = shot.record.values - curve
    return {
        trace.name: float(np.sqrt(np.mean(residual[shot.record.channel == i] ** 2)))
        for i, trace in enumerate(shot.record.traces)
    }
