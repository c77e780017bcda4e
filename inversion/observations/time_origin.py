"""The time origin: by how much the record's clock is ahead of the model's, when they share no trigger."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from birdstrike.inversion.estimation.calibration import FARTHEST_OFFSET, Calibrator, Mode

NORMAL_95 = 1.959964
NEAR = 0.01  # sigmas from a limit at which it is taken to hold


@dataclass(frozen=True)
class TimeOrigin:
    """The model at t - value stands beside the record at t; value, sigma, interval_95 in [s].

    sigma: what was known beforehand, None where the clocks are the same (then value is 0). There is no interval where
    the clocks are the same, nor where a limit of the search holds the value.
    """

    value: float
    sigma: float | None
    interval_95: tuple[float, float] | None

    @property
    def sentence(self) -> str:
        """One line for the user."""
        if self.sigma is None:
            return "time origin: the record's own (the case names no time_offset)"
        if self.interval_95 is None:
            return f"time origin: {self.value * 1e3:+.3f} ms, held there by a limit of the search"
        low, high = self.interval_95
        interval = f"(95 %: {low * 1e3:+.3f} .. {high * 1e3:+.3f} ms)"
        return f"time origin: {self.value * 1e3:+.3f} ms {interval}, estimated by the emulator"


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
    text = f"the time origin {t0 * 1e3:+.3f} ms is held by"
    if tau <= earliest + NEAR and earliest > -FARTHEST_OFFSET:
        return f"{text} the end of the simulated record at {calibrator.model.end * 1e3:g} ms; raise time.end"
    return (
        f"{text} {FARTHEST_OFFSET:g} times inversion.nuisance.time_offset = {calibrator.sigma * 1e3:g} ms; "
        "if the record's trigger may be further off, raise it (or shift the record's clock)"
    )
