"""Pressure on a disc of the plate's surface [Pa], positive in compression."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.histories import Array
from birdstrike.solver.fields import Between
from birdstrike.solver.sensors.sensor import Placed, PlateText, Reading, Run, overhang
from birdstrike.solver.target.mesh import LEVEL, vector_areas

if TYPE_CHECKING:  # the types bring in the compiled kernels, which loading a case has no use for
    from birdstrike.solver.bird.body import BirdBody
    from birdstrike.solver.contact import Contact
    from birdstrike.solver.target.mesh import ShellMesh

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

    def misplaced(self, name: str, mesh: ShellMesh, /) -> Iterator[str]:
        """Its disc lies on its part whole: on a target no farther from its middle than the part's outermost nodes."""
        told = list(super().misplaced(name, mesh))
        yield from told
        if told or not mesh.parts:
            return
        part = mesh.part_of(self.on(mesh)[0])
        beyond = self.radius - reach_on_part(mesh, part, self.on(mesh))
        if beyond > 1e-9:
            yield (
                f"sensors.{name}.radius = {1e3 * self.radius:.4g} mm: the gauge reaches {1e3 * beyond:.3g} mm beyond "
                f"part {part}, whose shells alone it feels; a smaller gauge, or another place?"
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
    sides: of a target of several parts, for every sheet of its surface 1 and -1 for the facets (e,) that the gauge
    feels, on the side of the sheet's normals or on the other, and 0 for those of other parts and surfaces.
    """

    nodes: Array
    centre: Array
    radius: float
    width: float
    sides: tuple[NDArray[np.int64], ...] = ()

    def pressure(self, bird: BirdBody, contact: Contact) -> float:
        """Normal contact force on the disc over its area [Pa]."""
        from birdstrike.solver.kernels.gauge import force_on_disc  # late: loading a case needs no compiled kernels

        disc, force = (self.centre, self.radius, self.width), 0.0
        for number, sheet in enumerate(contact.sheets):
            pressing = sheet.watched
            if self.sides:
                pressing = pressing & (self.sides[number][sheet.facet] * sheet.side > 0)
            touching = (sheet.quads, pressing, bird.active, sheet.facet, sheet.touch, sheet.foot)
            force += force_on_disc(bird.n, contact.stiffness, self.nodes, *touching, *disc)
        return force / (math.pi * (self.radius**2 + self.width**2 / 12.0))


def disc(sensor: Pressure, run: Run) -> Disc:
    """The disc of a pressure sensor."""
    from birdstrike.solver.sensors.places import point_at  # late: loading a case needs no compiled kernels

    mesh, where = run.plate.mesh, sensor.located(run)
    sides = felt_sides(mesh, where[0], run.contact) if mesh.parts else ()
    return Disc(mesh.nodes, point_at(mesh, *where), sensor.radius, run.contact.spacing, sides)


def felt_sides(mesh: ShellMesh, facet: int, contact: Contact) -> tuple[NDArray[np.int64], ...]:
    """`Disc.sides` of a gauge on the impact side of a facet: of its part, where that is level with the facet."""
    from birdstrike.solver.sensors.places import facing, normal_of  # late: loading a case needs no compiled kernels

    normal, own = normal_of(mesh, facet), mesh.parts[mesh.part_of(facet)]
    outward, sides = facing(normal) * normal, list[NDArray[np.int64]]()
    for sheet in contact.sheets:
        normals = vector_areas(mesh.nodes, sheet.quads)
        cosine = normals @ outward / np.linalg.norm(normals, axis=1)
        level = np.isin(sheet.sheet.facets, own) & (np.abs(cosine) > LEVEL)
        sides.append(np.where(level, np.sign(cosine), 0.0).astype(np.int64))
    return tuple(sides)


def reach_on_part(mesh: ShellMesh, part: str, where: tuple[int, float, float]) -> float:
    """How far a part certainly goes on about a place (facet, xi, eta) on it, in whatever direction it ends first [m].

    The least distance to the part's outermost nodes along the shell's length, its width, or what spans an upright one.
    """
    from birdstrike.solver.sensors.places import normal_of, point_at, tangents  # late: it brings in compiled kernels

    offsets = mesh.nodes[np.unique(mesh.quads[mesh.parts[part]])] - point_at(mesh, *where)
    axes = tangents(mesh, where[0])
    if axes is None:
        normal = normal_of(mesh, where[0])
        level = np.cross([0.0, 0.0, 1.0], normal)
        level /= np.linalg.norm(level)
        axes = np.stack([level, np.cross(normal, level)])
    reaches = []
    for along in (offsets @ np.vstack([axes, -axes]).T).T:
        outermost = along > along.max() - 1e-6
        reaches.append(np.linalg.norm(offsets[outermost], axis=1).min())
    return float(min(reaches))
