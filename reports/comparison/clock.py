"""Each model's clock beside the record's: the offset that fits best, within what is known of the record's trigger."""

from __future__ import annotations

import numpy as np
from scipy.optimize import minimize_scalar

from birdstrike.data.histories import Array, Histories
from birdstrike.inversion.observations.expected import FARTHEST_ORIGIN
from birdstrike.reports.results.results import Results

TRIALS = 81
FORBIDDEN = 1e100  # above any misfit, and finite: the minimiser fits parabolas through the costs


def on_clock(run: Histories, channel: str, times: Array, offset: float) -> Array:
    """The channel at `times` [s] of the record's clock: at rest before the impact began, NaN after its end."""
    return run.at(channel, np.maximum(times - offset, run.time[0]))


def best_offset(results: Results, run: Histories) -> float:
    """Offset [s] that minimises |(record - run) / noise|^2 + (offset / sigma)^2 over the points that the fit used.

    sigma: `inversion.nuisance.time_offset`, as for the inverted bird, so that an error of the trigger counts against
    no model. An offset that leaves a point of the record without a value of the run is not considered; 0 where the
    clocks are one.
    """
    sigma = results.inversion.time_offset.sigma
    if not sigma:
        return 0.0
    noise, record = results.inversion.measured.noise, results.used
    points = {channel: record.points(channel) for channel in results.channels}
    inside = {c: (t[t <= run.time[-1]], v[t <= run.time[-1]]) for c, (t, v) in points.items()}

    def cost(offset: float) -> float:
        misfits = (on_clock(run, c, t, offset) - v for c, (t, v) in inside.items())
        weighted = sum(float(np.sum((m / noise[c]) ** 2)) for c, m in zip(inside, misfits, strict=True))
        return FORBIDDEN if np.isnan(weighted) else weighted + (offset / sigma) ** 2

    trials = np.linspace(-FARTHEST_ORIGIN * sigma, FARTHEST_ORIGIN * sigma, TRIALS)
    best = float(trials[int(np.argmin([cost(float(t)) for t in trials]))])
    step = float(trials[1] - trials[0])
    found = minimize_scalar(cost, bounds=(best - step, best + step), method="bounded", options={"xatol": 1e-8})
    return float(found.x) if found.fun < cost(best) else best
