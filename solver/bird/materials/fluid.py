"""A fluid with a pressure floor, a viscosity and limits of its volume: what the NULL material is."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.solver.bird.eos.interface import EquationOfState
from birdstrike.solver.bird.materials.interface import Material


def acting(tension_erosion: float, compression_erosion: float) -> dict[str, bool]:
    """Whether each erosion limit, a relative volume V/V0, acts: above 1 in tension, between 0 and 1 in compression."""
    return {"tension_erosion": tension_erosion > 1.0, "compression_erosion": 0.0 < compression_erosion < 1.0}


@dataclass(frozen=True)
class Fluid(Material):
    """Fluid on any equation of state.

    tension_erosion, compression_erosion: relative volumes V/V0 beyond which it erodes, where they act.
    """

    eos: EquationOfState
    pressure_cutoff: float = 0.0
    viscosity: float = 0.0
    tension_erosion: float = 0.0
    compression_erosion: float = 0.0
    shear_modulus: ClassVar[float] = 0.0
    failure_strain: ClassVar[float] = math.inf

    @property
    def volume_limits(self) -> tuple[float, float]:
        acts = acting(self.tension_erosion, self.compression_erosion)
        largest = self.tension_erosion if acts["tension_erosion"] else math.inf
        return largest, self.compression_erosion if acts["compression_erosion"] else 0.0

    @property
    def limits(self) -> Array:
        """Pressure floor [Pa], largest and smallest V/V0 before erosion."""
        return np.array([self.pressure_cutoff, *self.volume_limits])
