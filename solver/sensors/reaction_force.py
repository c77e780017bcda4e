"""Reaction force of the plate on its frame [N], positive in the push, towards -z."""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar, Literal

from birdstrike.solver.fields import Between
from birdstrike.solver.sensors.sensor import Reading, Run, Sensor


class ReactionForce(Sensor):
    """What a load cell under the frame would feel."""

    noise_range: ClassVar = Between("0 kN", "100000 kN")
    drift_range: ClassVar = Between("-1e6 kN/s", "1e6 kN/s")
    noun: ClassVar = "the reaction force"
    figures: ClassVar = ("peak",)

    kind: Literal["reaction_force"] = "reaction_force"

    def reading(self, _run: Run, /) -> Reading:
        return lambda now: -float(now.reaction[2])

    def remarks(self, name: str, run: Run, /) -> Iterator[str]:
        """A plate with free edges has no frame to push."""
        if run.plate.supports.free:
            yield f"sensors.{name}: a plate with free edges has no frame: its reaction force is zero"
