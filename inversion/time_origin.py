"""The time origin: by how much the record's clock is ahead of the model's, when they share no trigger."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from inversion.calibration import Calibrator, Mode

NORMAL_95 = 1.959964


@dataclass(frozen=True)
class TimeOrigin:
    """The model at t - value stands beside the record at t; value, sigma, interval_95 in [s].

    sigma: what was known beforehand, None where the clocks are the same (then value is 0 and there is no interval).
    """

    value: float
    sigma: float | None
    interval_95: tuple[float, float] | None

    @property
    def sentence(self) -> str:
        """One line for the user."""
        if self.interval_95 is None:
            return "time origin: the record's own (the case names no time_offset)"
        low, high = self.interval_95
        interval = f"(95 %: {low * 1e3:+.3f} .. {high * 1e3:+.3f} ms)"
        return f"time origin: {self.value * 1e3:+.3f} ms {interval}, estimated by the emulator"


def time_origin(calibrator: Calibrator, modes: tuple[Mode, ...]) -> tuple[TimeOrigin, tuple[str, ...]]:
    """The best mode's time origin with the interval of all modes, and a warning when the record's end holds it."""
    if not calibrator.sigma:
        return TimeOrigin(0.0, None, None), ()
    ends = [
        (mode.t0 + sign * NORMAL_95 * float(np.sqrt(mode.covariance[-1, -1]))) for mode in modes for sign in (-1, 1)
    ]
    origin = TimeOrigin(modes[0].t0, calibrator.sigma, (min(ends), max(ends)))
    earliest = calibrator.offsets[0] * calibrator.sigma
    if origin.value - earliest > 0.01 * calibrator.sigma:
        return origin, ()
    held = f"the time origin {origin.value * 1e3:+.3f} ms is held by the end of the simulated record"
    return origin, (f"{held} at {calibrator.model.end * 1e3:g} ms; raise time.end",)
