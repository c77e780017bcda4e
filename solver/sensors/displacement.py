"""Displacement of a material point of the plate's mid-surface [m], positive in the push: against the struck normal."""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar, Literal

import numpy as np

from birdstrike.data.histories import Array
from birdstrike.solver.fields import Between
from birdstrike.solver.sensors.sensor import Along, Placed, Reading, Run, shell_is_gone, torn


class Displacement(Placed):
    """Interpolated by the shape functions of the element that holds the point; along: its direction, absent: the push.

    That is against the normal of the plane that is struck, towards -z but for a mesh from a file that lies aslant.
    It is sampled at the instants themselves: the plate's inertia has limited its band.
    """

    noise_range: ClassVar = Between("0 mm", "1000 mm")
    drift_range: ClassVar = Between("-1000 mm/s", "1000 mm/s")
    noun: ClassVar = "a displacement sensor"
    is_transducer: ClassVar = True

    kind: Literal["displacement"] = "displacement"
    along: Along | None = None

    def reading(self, run: Run, /) -> Reading:
        from birdstrike.solver.kernels.contact.contact import bilinear  # late: loading a case needs no compiled kernels

        element, xi, eta = self.located(run)
        nodes, shape = run.plate.quads[element], np.array(bilinear(xi, eta))
        rest, normal = run.plate.x[nodes].copy(), run.normal
        if self.along is None:
            return lambda now: float(shape @ ((rest - now.plate.x[nodes]) @ normal))
        along = np.array(self.along) / np.linalg.norm(self.along)
        return lambda now: float(shape @ (now.plate.x[nodes] - rest) @ along)

    def sampled(self, clock: Array, time: Array, values: Array) -> Array:
        """Readings of every step on the user's clock [s]: interpolated."""
        return np.interp(clock, time, values)

    def remarks(self, name: str, run: Run, /) -> Iterator[str]:
        """Its node flies on freely once the shell has torn."""
        if shell_is_gone(run, self):
            yield torn(name)
