"""Whether intervals hold the truth, over draws of the noise."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from birdstrike.inversion.diagnosis.judge import Judge, Judged

from birdstrike.data.histories import Array
from birdstrike.inversion.audit.draws import Draws
from birdstrike.inversion.diagnosis.evidence import magnitude_interval
from birdstrike.inversion.diagnosis.ranking import bounds
from birdstrike.inversion.estimation.estimates import NEWS
from birdstrike.inversion.estimation.time_origin import NORMAL_95


def covered(judge: Judge, one: Judged, draws: Draws, parameters: Mapping[str, float], b: float) -> dict[str, Array]:
    """(draws,) whether the 95 % interval holds the truth: of identified parameters, and of the effect as `b`."""
    fit, coordinates = one.fit, judge.groundwork.coordinates
    spread = NORMAL_95 * np.sqrt(np.diag(fit.covariance()))
    least, most = bounds(fit.problem, fit.own, fit.box)
    x = np.clip(draws.unknowns[one.name], least, most)
    lower, upper = np.clip(x - spread, least, most), np.clip(x + spread, least, most)
    low, high = judge.groundwork.dataset.lows, judge.groundwork.dataset.highs
    prior = coordinates.prior_width()
    found: dict[str, Array] = {}
    for i, name in enumerate(coordinates.names):
        if name in parameters and 2.0 * spread[i] < NEWS * prior[i]:
            found[name] = _holds(lower[:, i], upper[:, i], (parameters[name] - low[i]) / (high[i] - low[i]))
    if fit.own:
        found["b"] = _holds(*magnitude_interval(fit, x[:, len(fit.x) - len(fit.own)]), b)
    return found


def _holds(lower: Array, upper: Array, truth: float) -> Array:
    """(draws,) whether intervals hold the truth, up to rounding at a bound."""
    return ((lower <= truth + 1e-9) & (truth <= upper + 1e-9)).astype(float)
