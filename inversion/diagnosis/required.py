"""The required discrepancy of a model: the smallest model-form error with which the record is consistent.

One share of the peak for every kind of sensor. Consistent: the model's marginal likelihood is within 1.35 of its largest
over the share, the one-sided 95 % limit of a likelihood ratio with one degree of freedom (Wilks, Ann. Math. Stat. 9
(1938) 60: half of the chi-square quantile 2.71).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.inversion.diagnosis.evidence import UNNAMED, Judge
from birdstrike.inversion.diagnosis.hypotheses import SOMETHING_ELSE
from birdstrike.inversion.diagnosis.ranking import Ranking
from birdstrike.inversion.diagnosis.refit import Fit

SHARES = np.geomspace(0.0005, 0.5, 41)
WITHIN = 1.35


def required_discrepancy(ranking: Ranking) -> dict[str, float | None]:
    """Model -> share of the peak; None where even half of the peak is not enough. Pairs and something else are left out."""
    found: dict[str, float | None] = {}
    judges: dict[int, Judge] = {}
    for label, model in ranking.models.items():
        if len(model.members) > 1 or label == SOMETHING_ELSE:
            continue
        fit = ranking.fits.get(label, ranking.fits["none"])
        judge = judges.setdefault(id(fit), at_shares(fit))
        sizes = ranking.evidence[label].h
        logs = np.array([judge.model(model, list(sizes), np.array([i])).log_evidence for i in range(len(SHARES))])
        found[label] = smallest(logs)
    return found


def at_shares(fit: Fit) -> Judge:
    """The fit's system judged at common shares."""
    combinations = np.repeat(SHARES[:, None], len(fit.judge.kinds), axis=1)
    return Judge(fit.system, fit.judge.known, fit.judge.places, fit.judge.scale, combinations, (UNNAMED[0],))


def smallest(logs: Array) -> float | None:
    """The smallest consistent share of log likelihoods (shares,)."""
    if int(logs.argmax()) == len(logs) - 1:
        return None
    return float(SHARES[int(np.flatnonzero(logs >= logs.max() - WITHIN)[0])])


def best_share(required: Mapping[str, float | None]) -> str | None:
    """The model that needs least."""
    known = {label: value for label, value in required.items() if value is not None}
    return min(known, key=lambda label: known[label]) if known else None
