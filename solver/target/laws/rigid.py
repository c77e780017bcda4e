"""A part that neither moves nor strains: its nodes are held."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from birdstrike.data.histories import Array
from birdstrike.solver.fields import Between
from birdstrike.solver.target.laws.interface import TargetMaterial, elastic_row


class Rigid(TargetMaterial):
    """Held in space, so that its mass means nothing; nodes that it shares with other parts are held too."""

    law: Literal["rigid"]
    moves: ClassVar[bool] = False
    density: Annotated[float, Between("100 kg/m^3", "25000 kg/m^3")] = 7850.0

    def row(self) -> Array:
        return elastic_row(200e9, 0.3)
