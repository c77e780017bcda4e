"""Contact force of the bird on the plate [N], positive in the push: against the normal of what is struck."""

from __future__ import annotations

from typing import ClassVar, Literal

from birdstrike.solver.fields import Between
from birdstrike.solver.sensors.sensor import Reading, Run, Sensor


class ContactForce(Sensor):
    """Sum of the contact forces' components normal to the plane that is struck, at rest; no instrument measures it.

    That plane is z = 0, and of a mesh from a file that lies aslant the struck part's at the point of aim.
    """

    noise_range: ClassVar = Between("0 kN", "100000 kN")
    drift_range: ClassVar = Between("-1e6 kN/s", "1e6 kN/s")
    noun: ClassVar = "the contact force"
    figures: ClassVar = ("impulse",)

    kind: Literal["contact_force"] = "contact_force"

    def reading(self, _run: Run, /) -> Reading:
        return lambda now: now.push
