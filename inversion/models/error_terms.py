"""What every model carries besides its constants and the shots' nuisances: a discrepancy of the model, as columns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from scipy.linalg import block_diag

from birdstrike.data.histories import Array
from birdstrike.inversion.diagnosis.preparation.discrepancy import UNSEEN, started
from birdstrike.inversion.estimation.calibration import Mode
from birdstrike.inversion.estimation.known_errors import Columns
from birdstrike.inversion.estimation.shots import shot_number
from birdstrike.inversion.estimation.whitening import factor_between
from birdstrike.inversion.observations.observations import Observations

WORTH_A_COLUMN = 1e-3  # share of its variance


@dataclass(frozen=True)
class Discrepancy:
    """The model's discrepancy as columns: the diagnosis's process in time, a share of each channel's peak.

    contacts: instants [s] of the shots' first contacts, before which there is none; end: of the runs [s].
    """

    contacts: Sequence[float]
    end: float
    _factors: dict[tuple[float, bytes], Array] = field(default_factory=dict)

    def only(self, shots: Sequence[int]) -> Discrepancy:
        """Of some of the shots, in that order, with the factors that are known."""
        return replace(self, contacts=[self.contacts[i] for i in shots])

    def columns(self, observations: Observations, share: float) -> Array:
        """(n, s) SI, one standard deviation each."""
        blocks = [
            share * c.peak * self._factor(c.times, self.contacts[shot_number(c.name)]) for c in observations.channels
        ]
        return np.asarray(block_diag(*blocks), dtype=np.float64)

    def _factor(self, times: Array, contact: float) -> Array:
        key = (contact, times.tobytes())
        if key not in self._factors:
            length = UNSEEN * (self.end - contact)
            process = partial(started, contact=contact, length=length)
            self._factors[key] = factor_between(process, times, WORTH_A_COLUMN)
        return self._factors[key]


def with_discrepancy(columns: Columns | None, discrepancy: Discrepancy, share: float) -> Columns:
    """The columns, if there are any, and those of the discrepancy of a share of the peaks (1 sigma), none for 0."""

    def more(observations: Observations, mode: Mode) -> Array:
        known = [columns(observations, mode)] if columns is not None else []
        own = [discrepancy.columns(observations, share)] if share else []
        return np.hstack([np.zeros((len(observations.values), 0)), *known, *own])

    return more
