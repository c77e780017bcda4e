"""Reaction force of the plate on its frame [N], positive in the push, towards -z."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, ClassVar, Literal

from birdstrike.solver.fields import Between
from birdstrike.solver.sensors.sensor import Reading, Run, Sensor, TargetNames


class ReactionForce(Sensor):
    """What a load cell under the frame would feel; support: under one set of nodes of a target's supports alone."""

    noise_range: ClassVar = Between("0 kN", "100000 kN")
    drift_range: ClassVar = Between("-1e6 kN/s", "1e6 kN/s")
    noun: ClassVar = "the reaction force"
    figures: ClassVar = ("peak",)

    kind: Literal["reaction_force"] = "reaction_force"

    support: str | None = None

    def reading(self, _run: Run, /) -> Reading:
        name = self.support
        if name is None:
            return lambda now: -float(now.reaction[2])
        return lambda now: -float(now.plate.supports.reaction_of(name, now.plate.nodes, now.contact.on_plate)[2])

    def unknown_names(self, name: str, target: TargetNames | None, /) -> Iterator[str]:
        """Its support is a set of nodes by which the target is held: one that is free has no load cell under it."""
        if self.support is None:
            return
        given = f'sensors.{name}.support = "{self.support}"'
        if target is None:
            yield f"{given} does nothing on a plate, which has one frame; leave it out"
        elif self.support not in target.supports:
            known = ", ".join(target.supports) or "none"
            yield f"{given} holds nothing; target.supports that hold: {known}"

    def canonical(self) -> dict[str, Any]:
        """Without a support that is not stated."""
        return {key: value for key, value in super().canonical().items() if key != "support" or value is not None}

    def remarks(self, name: str, run: Run, /) -> Iterator[str]:
        """A plate with free edges has no frame to push."""
        if run.plate.supports.free:
            yield f"sensors.{name}: a plate with free edges has no frame: its reaction force is zero"
