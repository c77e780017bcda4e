"""State at the end of a simulation: impulse, residual deflection, whether the bird went through the plate."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.integrate import cumulative_trapezoid

from birdstrike.data.histories import Array, Histories, Snapshot
from birdstrike.reports.figures.views import push_direction
from birdstrike.solver.build import outline_of
from birdstrike.solver.case.case import Case
from birdstrike.solver.estimate import first_period
from birdstrike.solver.sensors.reaction_force import ReactionForce
from birdstrike.solver.sensors.sensor import Sensor

QUIET = 0.01  # of the largest contact force: below it the bird is taken to have left


def impulse(time: Array, force: Array) -> Array:
    """Integral of `force` (n,) N over `time` (n,) s from the first sample by the trapezium rule, (n,) N s."""
    return np.asarray(cumulative_trapezoid(force, time, initial=0.0))


def sensor_of_kind(case: Case, run: Histories, kind: str) -> str | None:
    """Name of the case's first sensor of a kind that the run has, None without one; a cell under one support of
    several, or along a direction of its own, does not read the frame's force in the push.
    """
    return next(
        (name for name, one in case.sensors.items() if one.kind == kind and _whole(one) and name in run.channels), None
    )


def _whole(sensor: Sensor) -> bool:
    return not isinstance(sensor, ReactionForce) or (sensor.support is None and sensor.along is None)


def residual_deflection(case: Case, run: Histories, channel: str) -> tuple[float | None, str]:
    """Deflection [m] that stays, and how it is known; None where the run is too short.

    A plate that never yielded returns to 0. One that did swings about its new rest: the mean over the last first
    period counts, once the bird has left.
    """
    if case.plate.rigid:
        return 0.0, "rigid"
    if float(run.summary.get("largest_plastic_strain", np.nan)) == 0.0:
        return 0.0, "no yield"
    period, contact = first_period(case), sensor_of_kind(case, run, "contact_force")
    if contact is None:
        return None, "no contact force sensor shows when the bird has left"
    if period is None:
        return None, "the first period of such a structure is not known"
    force = np.abs(run.channels[contact])
    left = float(run.time[np.flatnonzero(force > QUIET * force.max())[-1]])
    if run.time[-1] < left + period:
        enough = f"time.end = {1e3 * (left + period):.2f} ms would do"
        return None, f"the run ends before the plate has swung once without the bird, {enough}"
    last = run.time >= run.time[-1] - period
    return float(run.channels[channel][last].mean()), "mean of the last period"


def penetration(case: Case, run: Histories) -> str:
    """`no`, `no, but 9 shells torn`, or `yes` with the share of the bird that is behind the plate in the end."""
    torn = int(run.summary.get("eroded_shells", 0))
    if not torn:
        return "no"
    behind = share_behind(case, run.snapshots) if run.snapshots else 0.0
    return f"yes, {behind * 100:.0f} % of the bird" if behind > 0.0 else f"no, but {torn} shells torn"


def share_behind(case: Case, snapshots: Sequence[Snapshot]) -> float:
    """Share of the bird's pieces, eroded ones left out, that end behind the deepest shell left, within the outline."""
    struck, last = outline_of(case), snapshots[-1]
    push = push_direction(snapshots) if struck.plane is None else -1.0
    x, y, z = struck.seen(last.particles).T
    left = struck.seen(last.nodes[np.unique(last.quads)])[:, 2]
    deepest = float((push * left).max()) if left.size else 0.0
    inside = (np.abs(np.stack([x, y], axis=1) - struck.middle) < struck.sides / 2).all(axis=1)
    return float((inside & (push * z > deepest + case.plate.thickness) & ~last.eroded).mean())
