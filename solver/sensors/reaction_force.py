"""Reaction force of the plate on its frame [N], positive in the push: against the normal of what is struck."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, ClassVar, Literal

import numpy as np

from birdstrike.solver.fields import Between
from birdstrike.solver.sensors.sensor import Along, PlateText, Reading, Run, Sensor, TargetNames, no_direction


class ReactionForce(Sensor):
    """What a load cell under the frame would feel; support: under one set of nodes of a target's supports alone.

    along: its direction in space, absent: the push, against the normal of the plane that is struck.
    """

    noise_range: ClassVar = Between("0 kN", "100000 kN")
    drift_range: ClassVar = Between("-1e6 kN/s", "1e6 kN/s")
    noun: ClassVar = "the reaction force"
    figures: ClassVar = ("peak",)

    kind: Literal["reaction_force"] = "reaction_force"

    support: str | None = None
    along: Along | None = None

    def reading(self, run: Run, /) -> Reading:
        name = self.support
        against = run.normal if self.along is None else -np.array(self.along) / np.linalg.norm(self.along)
        if name is None:
            return lambda now: -float(now.reaction @ against)
        return lambda now: -float(now.plate.supports.reaction_of(name, now.plate.nodes, now.contact.on_plate) @ against)

    @classmethod
    def broken_rules(cls, name: str, table: Mapping[str, Any], _plate: PlateText, /) -> Iterator[str]:
        """Its direction is one, where it states one."""
        yield from no_direction(name, table)

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
        """Without a support and a direction that are not stated."""
        unsaid = {key for key in ("support", "along") if getattr(self, key) is None}
        return {key: value for key, value in super().canonical().items() if key not in unsaid}

    def remarks(self, name: str, run: Run, /) -> Iterator[str]:
        """A plate with free edges has no frame to push."""
        if run.plate.supports.free:
            yield f"sensors.{name}: a plate with free edges has no frame: its reaction force is zero"
