"""The time origin: by how much the record's clock is ahead of the model's, when they share no trigger."""

from __future__ import annotations

import numpy as np

from birdstrike.data.formatting import signed_ms
from birdstrike.data.histories import Array
from birdstrike.inversion.estimation.calibration import Calibrator, Mode
from birdstrike.inversion.observations.expected import FARTHEST_ORIGIN
from birdstrike.inversion.results.fit import TimeOrigin
from birdstrike.surrogate.gaussian_process import NORMAL_95

NEAR = 0.01  # sigmas from a limit at which it is taken to hold


def time_origin(calibrator: Calibrator, modes: tuple[Mode, ...]) -> tuple[TimeOrigin, tuple[str, ...]]:
    """The best mode's time origin with the interval of all modes; a warning instead where a limit holds it."""
    if not calibrator.sigma:
        return TimeOrigin(0.0, None, None), ()
    holds = held(calibrator, modes[0].t0)
    if holds:
        return TimeOrigin(modes[0].t0, calibrator.sigma, None), (holds,)
    ends = [
        (mode.t0 + sign * NORMAL_95 * float(np.sqrt(mode.covariance[-1, -1]))) for mode in modes for sign in (-1, 1)
    ]
    return TimeOrigin(modes[0].t0, calibrator.sigma, (min(ends), max(ends))), ()


def held(calibrator: Calibrator, t0: float) -> str:
    """Which limit of the search holds a time origin [s], and the remedy; empty where none does."""
    earliest, latest = calibrator.offsets
    tau = t0 / calibrator.sigma
    if earliest + NEAR < tau < latest - NEAR:
        return ""
    text = f"the time origin {signed_ms(t0)} is held by"
    if tau <= earliest + NEAR and earliest > -FARTHEST_ORIGIN + NEAR:
        return f"{text} the end of the simulated record at {calibrator.model.end * 1e3:g} ms; raise time.end"
    return (
        f"{text} {FARTHEST_ORIGIN:g} times inversion.nuisance.time_offset = {calibrator.sigma * 1e3:g} ms; "
        "if the record's trigger may be further off, raise it (or shift the record's clock)"
    )


def clock_drift(calibrator: Calibrator, mode: Mode, origin: TimeOrigin) -> Array:
    """(n,) change of the stacked curve at `mode` for one standard deviation of the time origin, SI.

    A secant over both sides, cut at the limits of the search; zero where the clocks are the same. Where a limit holds
    the time origin, so that it has no interval, the standard deviation is that known beforehand.
    """
    if not calibrator.sigma:
        return np.zeros(len(calibrator.model.observations.values))
    sd = calibrator.sigma
    if origin.interval_95 is not None:
        sd = (origin.interval_95[1] - origin.interval_95[0]) / (2.0 * NORMAL_95)
    limits = np.array(calibrator.offsets) * calibrator.sigma
    early, late = (float(t) for t in np.clip(origin.value + np.array([-sd, sd]), *limits))
    scores = calibrator.model.scores(mode.theta[None])
    change = calibrator.model.curves(scores, late)[0] - calibrator.model.curves(scores, early)[0]
    return change * sd / (late - early)
