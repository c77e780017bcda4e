"""Mean deflection of the whole plate [m], as a fringe projector integrates it."""

from __future__ import annotations

from typing import ClassVar, Literal

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.solver.fields import Between
from birdstrike.solver.sensors.sensor import Reading, Run, Sensor


class MeanDeflection(Sensor):
    """Of all nodes, positive in the push; read at the instants themselves."""

    noise_range: ClassVar = Between("0 mm", "100 mm")
    drift_range: ClassVar = Between("-100 mm/s", "100 mm/s")
    noun: ClassVar = "the mean deflection"

    kind: Literal["mean_deflection"] = "mean_deflection"

    def reading(self, run: Run, /) -> Reading:
        rest = run.plate.x[:, 2].copy()
        return lambda now: float((rest - now.plate.x[:, 2]).mean())

    def sampled(self, clock: Array, time: Array, values: Array) -> Array:
        return np.interp(clock, time, values)
