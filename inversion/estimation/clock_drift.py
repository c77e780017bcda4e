"""What the uncertain time origin does to the curve: its change for one standard deviation of the clocks' offset."""

from __future__ import annotations

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.inversion.estimation.calibration import Calibrator, Mode
from birdstrike.inversion.observations.time_origin import NORMAL_95, TimeOrigin


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
