"""Pressure on a disc of the plate's surface [Pa], positive in compression."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from birdstrike.data.histories import Array
from birdstrike.solver.fields import Between
from birdstrike.solver.sensors.sensor import Placed, PlateText, Reading, Run, overhang

if TYPE_CHECKING:  # the types bring in the compiled kernels, which loading a case has no use for
    from birdstrike.solver.bird.body import BirdBody
    from birdstrike.solver.contact import Contact

RADIUS = Between("0.1 mm", "1000 mm")
FEWEST_SPACINGS = 3.0  # of a gauge's radius


class Pressure(Placed):
    """radius: of the gauge [m].

    10 mm unless given: about a tenth of the diameter of a 1.8 kg bird. Below three particle spacings a reading is
    coarse, and the run says so.
    """

    noise_range: ClassVar = Between("0 MPa", "100000 MPa")
    drift_range: ClassVar = Between("-1e6 MPa/s", "1e6 MPa/s")
    noun: ClassVar = "a pressure gauge"

    kind: Literal["pressure"] = "pressure"
    radius: Annotated[float, RADIUS] = 0.01

    @classmethod
    def broken_rules(cls, name: str, table: Mapping[str, Any], plate: PlateText, /) -> Iterator[str]:
        """Its disc lies on the plate whole, over whose area the force is divided."""
        yield from super().broken_rules(name, table, plate)
        radius = RADIUS.valid(table.get("radius", "10 mm"))
        reaches = () if radius is None else (radius, radius)
        for key, beyond in overhang(table.get("at", ["0 mm", "0 mm"]), reaches, plate):
            yield (
                f"sensors.{name}.radius = {table.get('radius', '10 mm')}: the gauge reaches {1e3 * beyond:.3g} mm "
                f"beyond the plate (plate.{key} = {plate.texts[key]}); a smaller gauge, or another place?"
            )

    def reading(self, run: Run, /) -> Reading:
        gauge = disc(self, run)
        return lambda now: gauge.pressure(now.bird, now.contact)

    def remarks(self, name: str, run: Run, /) -> Iterator[str]:
        """Few particles reach a small gauge."""
        spacings = self.radius / run.contact.spacing
        if round(spacings, 1) < FEWEST_SPACINGS:
            yield (
                f"sensors.{name}.radius = {1e3 * self.radius:.3g} mm is {spacings:.1f} particle spacings: "
                f"below {FEWEST_SPACINGS:.0f} a pressure is coarse; raise bird.particles or the radius"
            )


@dataclass(frozen=True)
class Disc:
    """A pressure gauge: centre (3,), radius and the particles' width [m], on the undeformed nodes (m, 3).

    The disc is a part of the undeformed surface and moves with it. A particle's force is spread over one particle
    spacing d, and so is the disc's edge: the area is that of the smeared disc, pi (r^2 + d^2/12).
    """

    nodes: Array
    centre: Array
    radius: float
    width: float

    def pressure(self, bird: BirdBody, contact: Contact) -> float:
        """Normal contact force on the disc over its area [Pa]."""
        from birdstrike.solver.kernels.gauge import force_on_disc  # late: loading a case needs no compiled kernels

        disc, force = (self.centre, self.radius, self.width), 0.0
        for sheet in contact.sheets:
            touching = (sheet.quads, sheet.watched, bird.active, sheet.facet, sheet.touch, sheet.foot)
            force += force_on_disc(bird.n, contact.stiffness, self.nodes, *touching, *disc)
        return force / (math.pi * (self.radius**2 + self.width**2 / 12.0))


def disc(sensor: Pressure, run: Run) -> Disc:
    """The disc of a pressure sensor."""
    from birdstrike.solver.sensors.places import point_at  # late: loading a case needs no compiled kernels

    mesh = run.plate.mesh
    return Disc(mesh.nodes, point_at(mesh, *sensor.located(run)), sensor.radius, run.contact.spacing)
