"""How far the plate had given way when a run failed: a shell folded over is no matter of the time step."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from data.errors import RunFailed

if TYPE_CHECKING:
    from solver.strike import Strike

GIVEN_WAY = 0.2  # plastic strain, or deflection over the shorter side, beyond which a mesh of flat facets folds


@dataclass
class PlateState:
    """The plate at the last audit that was sound: largest plastic strain, deflection over the shorter side."""

    strain: float = 0.0
    sag: float = 0.0

    def note(self, strike: Strike) -> None:
        """Look at the plate as it is now."""
        rest, now = strike.plate.mesh.nodes, strike.plate.x
        self.strain = float(strike.plate.eps_p.max())
        self.sag = float(np.ptp(now[:, 2] - rest[:, 2]) / np.ptp(rest[:, :2], axis=0).min())

    def explained(self, failure: RunFailed) -> RunFailed:
        """The failure with its physical cause where the plate had given way: then no step or mesh is the remedy."""
        if self.strain < GIVEN_WAY and self.sag < GIVEN_WAY:
            return failure
        held = (
            f"the plate had given way (deflected by {self.sag:.0%} of its shorter side, strained by {self.strain:.0%})"
        )
        return RunFailed(
            f"{failure.reason}; before that {held}",
            f"a thicker plate.thickness or a lower impact.speed; otherwise {failure.remedy}",
        )
