"""How far a simulated curve is from the record: the errors that engineers quote, and two ratings of its shape."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from birdstrike.data.histories import Array, Histories, farthest, side_of
from birdstrike.inversion.misfit import relative, rmse
from birdstrike.reports.comparison.clock import on_clock
from birdstrike.reports.comparison.iso18571 import SAMPLES, Rating, rate

FEWEST_POINTS = 8  # of a record, for an error that needs the curve between its points
HOLE_STEPS, HOLE_SHARE = 5.0, 0.05  # of the usual step and of the record: a longer step leaves the curve unknown


@dataclass(frozen=True)
class Score:
    """Errors of one curve against one channel of the record, SI; None where it is not known between its points.

    rms, share: root mean square over the record's points, and that over the record's peak; peak, peak_share,
    peak_time: simulated less recorded peak, on the side of the latter, both read at the record's points; magnitude,
    phase: Sprague and Geers; rating: ISO/TS 18571.
    """

    rms: float
    share: float
    peak: float
    peak_share: float
    peak_time: float
    magnitude: float | None
    phase: float | None
    rating: Rating | None


def score(
    time: Array, record: Array, run: Histories, channel: str, offset: float, *, shaped: bool = True
) -> Score | None:
    """Score of a run's channel against a record (m,), NaN in gaps, on its clock; None where they never meet.

    shaped: with the figures of the curve's shape, magnitude, phase and rating, which cost far more than the others.
    """
    simulated = on_clock(run, channel, time, offset)
    both = np.isfinite(record) & np.isfinite(simulated)
    if not both.any() or not np.abs(record[both]).max() > 0.0:
        return None
    time, record, simulated = time[both], record[both], simulated[both]
    top, found = same_side(record, simulated)
    difference = float(simulated[found] - record[top])
    shape = _shape(time, record, run, channel, offset) if shaped and _is_curve(time) else None
    magnitude, phase = sprague_geers(*shape) if shape else (None, None)
    return Score(
        rms=rmse(simulated, record),
        share=relative(simulated, record),
        peak=difference,
        peak_share=difference / abs(float(record[top])) * float(np.sign(record[top])),
        peak_time=float(time[found] - time[top]),
        magnitude=magnitude,
        phase=phase,
        rating=rate(shape[0], shape[1]) if shape else None,
    )


def same_side(record: Array, simulated: Array) -> tuple[int, int]:
    """Places of a record's largest reading (m,) and of a simulation's on the same side of 0; NaN are skipped.

    Of a simulation that never gets there, where it comes nearest.
    """
    side = side_of(record)
    return int(farthest(record)), int(np.nanargmax(side * simulated))


def _is_curve(time: Array) -> bool:
    """Whether a record at these instants (m,) [s] is known between them: enough of them, and no stretch left out."""
    if len(time) < FEWEST_POINTS:
        return False
    steps = np.diff(time)
    longest = max(HOLE_STEPS * float(np.median(steps)), HOLE_SHARE * float(time[-1] - time[0]))
    return float(steps.max()) <= longest


def _shape(time: Array, record: Array, run: Histories, channel: str, offset: float) -> tuple[Array, Array]:
    """Record (by straight lines between its points) and run at SAMPLES equal steps of the time that both cover."""
    even = np.linspace(time[0], time[-1], SAMPLES)
    return np.interp(even, time, record), on_clock(run, channel, even, offset)


def sprague_geers(record: Array, simulated: Array) -> tuple[float, float]:
    """Magnitude M and phase P of two curves at the same equal steps.

    M = sqrt(I_ss / I_rr) - 1, P = arccos(I_rs / sqrt(I_ss I_rr)) / pi, with I the integrals of the products.
    M. A. Sprague and T. L. Geers, Commun. Numer. Meth. Engng 20 (2004) 71, eqs. 1 to 4.
    """
    rr, ss, rs = (
        float(np.trapezoid(a * b)) for a, b in ((record, record), (simulated, simulated), (record, simulated))
    )
    if not ss > 0.0:
        return -1.0, 0.5
    return float(np.sqrt(ss / rr)) - 1.0, float(np.arccos(np.clip(rs / np.sqrt(ss * rr), -1.0, 1.0)) / np.pi)
