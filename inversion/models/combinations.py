"""What several sought constants make together: the bulk modulus with its interval, where its factors are not found."""

from __future__ import annotations

import numpy as np

from birdstrike.data.formatting import listing, plain, quantity, span
from birdstrike.data.histories import Array
from birdstrike.inversion.estimation.locate import Located
from birdstrike.inversion.estimation.prior import identified
from birdstrike.inversion.invert import InversionOutcome
from birdstrike.inversion.models.campaigns import ModelRuns
from birdstrike.inversion.models.candidates import bulk_moduli, modulus_of
from birdstrike.inversion.models.points import linearised_draws, prior_draws
from birdstrike.inversion.models.results import Combined

DRAWS = 400  # of prior and posterior


def combinations(runs: ModelRuns, outcome: InversionOutcome, located: Located) -> dict[str, Combined]:
    """The bulk modulus, where what is sought changes it; its widths are compared as ratios of their ends."""
    rng = np.random.default_rng(runs.options.seed)
    calibration, case = located.calibration, runs.cases[0]
    if calibration.design.deficient:
        return {}
    formula, keys = modulus_of(case)
    mode = calibration.modes[0]
    everywhere = _moduli(runs, prior_draws(calibration.coordinates, DRAWS, rng))
    at_answer = _moduli(runs, mode.theta[None])
    if not len(at_answer) or np.ptp(everywhere) <= 1e-9 * np.abs(everywhere).max():
        return {}
    if outcome.posterior is not None:
        theta = outcome.posterior.theta[rng.integers(0, len(outcome.posterior.theta), DRAWS)]
    else:
        theta = linearised_draws(located, DRAWS, rng)
    draws, value = _moduli(runs, theta), float(at_answer[0])
    low, high = np.quantile(draws, [0.025, 0.975])
    interval = (min(float(low), value), max(float(high), value))
    before = np.quantile(everywhere, [0.025, 0.975])
    width = np.log(interval[1] / interval[0]) / np.log(before[1] / before[0])
    known = bool(identified(width, 1.0)) and outcome.inversion.prior_predictive.inside
    estimates = outcome.inversion.methods["emulator"].parameters
    priors = case.priors  # what one states is known beside the records
    weak = [plain(key, estimates) for key in keys if not estimates[key].identified and key not in priors]
    named = f"K = {formula}" if formula else "K"
    records = "these records" if len(runs.setups) > 1 else "this record"
    text = f"{named} = {quantity(value, 'Pa')} (95 %: {span(*interval, 'Pa')})"
    if not known:
        text = f"the bulk modulus {named} is not identifiable from {records}"
    elif weak and len(keys) > 1:
        text += f"; {listing(weak)} not identifiable from {records}: only the combination counts"
    return {
        "bulk_modulus": Combined(
            value=value, interval_95=interval, unit="Pa", identified=known, formula=formula, of=keys, sentence=text
        )
    }


def _moduli(runs: ModelRuns, theta: Array) -> Array:
    """Bulk modulus [Pa] at parameters (n, k) SI, as far as the case does not refuse it."""
    names = runs.space.names
    return np.array(bulk_moduli(runs.cases[0], (dict(zip(names, map(float, row), strict=True)) for row in theta)))
