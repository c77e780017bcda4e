"""Surface strain of the plate along a gauge, (L - L0)/L0, positive in tension."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.histories import Array
from birdstrike.solver.fields import Between, OneOf
from birdstrike.solver.sensors.sensor import (
    Along,
    Placed,
    PlateText,
    Reading,
    Run,
    deformable,
    overhang,
    shell_is_gone,
    torn,
)
from birdstrike.solver.target.mesh import LEVEL

if TYPE_CHECKING:  # the type brings in the compiled kernels, which loading a case has no use for
    from birdstrike.solver.target.assembly import Target
    from birdstrike.solver.target.mesh import ShellMesh

UPRIGHT = 0.999
"""Cosine of a gauge's direction to the shell's normal beyond which it has none in the shell."""
POINTS = np.polynomial.legendre.leggauss(5)  # along a gauge of finite length
DIRECTION, LENGTH = Between("-360 deg", "360 deg"), Between("0.1 mm", "1000 mm")


class Strain(Placed):
    """direction: from the length axis towards the width's [rad]; side: of the plate; length: of the gauge [m].

    along: the direction in space instead, laid on the shell, for gauges on webs and flanges. Absent, the length is that
    of a point. The elements' co-rotational increments of membrane strain and curvature sum up in the shells
    (`Target.watch`), on the surface as e = membrane + z curvature with z = t/2 on the impact side, -t/2 on the
    back. They are brought from the elements' centres to the gauge (`places.blend`), those that have torn left out, and
    averaged over its length where it has one. The sum is the logarithmic strain, ln(L/L0).
    measure: of a rosette at the place instead of one gauge, the largest "principal" strain of the surface, or the
    "effective" one, 2/sqrt(3) sqrt(e1^2 + e1 e2 + e2^2), as if no volume were lost.
    """

    noise_range: ClassVar = Between(0.0, 1.0)
    drift_range: ClassVar = Between("-1000 1/s", "1000 1/s")
    noun: ClassVar = "a strain gauge"

    kind: Literal["strain"] = "strain"
    direction: Annotated[float, DIRECTION] = 0.0
    side: Annotated[str, OneOf(("impact", "back"))] = "back"
    length: Annotated[float, LENGTH] | None = None
    along: Along | None = None
    measure: Annotated[str, OneOf(("principal", "effective"))] | None = None

    def laid(self, mesh: ShellMesh) -> Array:
        """Its direction on the shell under it at rest, a unit vector (3,)."""
        from birdstrike.solver.sensors.places import normal_of, tangents  # late: it brings in compiled kernels

        element = self.on(mesh)[0]
        if self.along is None:
            axes = tangents(mesh, element)
            assert axes is not None, "`misplaced` has refused it"
            return np.array([math.cos(self.direction), math.sin(self.direction)]) @ axes
        normal, given = normal_of(mesh, element), np.array(self.along)
        toward = given - (given @ normal) * normal
        return toward / np.linalg.norm(toward)

    def shifted(self, by: float, mesh: ShellMesh) -> Strain:
        """The gauge moved along itself [m], on a plate along its surface."""
        from birdstrike.solver.sensors.places import point_at, tangents  # late: it brings in compiled kernels

        axes = tangents(mesh, self.on(mesh)[0]) if self.point is None and not mesh.parts else None
        if axes is not None:
            x, y = np.array(self.at) + by * (axes @ self.laid(mesh))
            return self.model_copy(update={"at": (float(x), float(y))})
        moved = point_at(mesh, *self.on(mesh)) + by * self.laid(mesh)
        return self.model_copy(update={"point": tuple(float(c) for c in moved)})

    def extent(self, mesh: ShellMesh, /) -> Iterator[tuple[str, Placed]]:
        """Its middle, and both ends of a gauge of some length."""
        yield from super().extent(mesh)
        for share in (-0.5, 0.5) if self.length else ():
            yield "length", self.shifted(share * (self.length or 0.0), mesh)

    def face(self, mesh: ShellMesh) -> int:
        """1 where it sits on the side to which its shell's own normal points, else -1; shells may be wound anyhow."""
        from birdstrike.solver.sensors.places import facing, normal_of  # late: it brings in compiled kernels

        return facing(normal_of(mesh, self.on(mesh)[0])) * (1 if self.side == "impact" else -1)

    def misplaced(self, name: str, mesh: ShellMesh, /) -> Iterator[str]:
        """Its shell strains, and its direction has a component in it."""
        from birdstrike.solver.sensors.places import normal_of, tangents  # late: it brings in compiled kernels

        element, given = self.on(mesh)[0], None if self.along is None else np.array(self.along)
        if (part := mesh.part_of(element)) in mesh.rigid:
            yield (
                f'sensors.{name}.kind = strain: part {part} is of law = "rigid" and has no strain; leave the sensor '
                "out, or put it on another part"
            )
        elif given is None and tangents(mesh, element) is None:
            yield (
                f"sensors.{name}: the shell under the gauge stands upright, where its direction cannot be counted from "
                f"the length axis; give sensors.{name}.along, a direction in space"
            )
        elif given is not None and abs(given @ normal_of(mesh, element)) > UPRIGHT * np.linalg.norm(given):
            yield (
                f"sensors.{name}.along = {given.tolist()} is normal to the shell under the gauge, which has no "
                "strain that way; give a direction in the shell"
            )
        else:
            yield from super().misplaced(name, mesh)

    def elements(self, run: Run, /) -> NDArray[np.int64]:
        """Those that it feels; raises UserError for a plate that does not strain."""
        return np.unique(np.concatenate([shells_of(gauge_points(gauge, run)) for gauge in self.rosette(run)]))

    def rosette(self, run: Run) -> tuple[Strain, ...]:
        """The gauge itself, or where a measure is asked for three of them: at 0, 45 and 90 degrees."""
        if self.measure is None:
            return (self,)
        from birdstrike.solver.sensors.places import normal_of  # late: it brings in compiled kernels

        mesh = run.plate.mesh
        first = self.laid(mesh)
        second = np.cross(normal_of(mesh, self.located(run)[0]), first)
        lines = (math.cos(turn) * first + math.sin(turn) * second for turn in (0.0, 0.25 * math.pi, 0.5 * math.pi))
        return tuple(self.model_copy(update={"along": tuple(line), "measure": None}) for line in lines)

    def reading(self, run: Run, /) -> Reading:
        if self.measure is not None:
            first, between, second = (gauge.reading(run) for gauge in self.rosette(run))
            principal = self.measure == "principal"
            return lambda now: of_rosette(first(now), between(now), second(now), principal)
        target = deformable(run)
        points = gauge_points(self, run)
        near = shells_of(points)
        rows, whole = np.searchsorted(target.watched, near), np.ones(len(near), np.bool_)
        shares = {whole.tobytes(): gauge_shares(points, near, whole)}

        def strain(_: Run) -> float:
            alive = target.alive[near]
            key = alive.tobytes()
            if key not in shares:
                shares[key] = gauge_shares(points, near, alive)
            return math.expm1(float((shares[key] * target.felt[rows]).sum()))

        return strain

    def remarks(self, name: str, run: Run, /) -> Iterator[str]:
        """Its strain stands still once the shell has torn."""
        if shell_is_gone(run, self):
            yield torn(name)

    @classmethod
    def broken_rules(cls, name: str, table: Mapping[str, Any], plate: PlateText, /) -> Iterator[str]:
        """Middle and ends lie on the plate, which strains."""
        yield from super().broken_rules(name, table, plate)
        if "direction" in table and table.get("along") is not None:
            yield (
                f"sensors.{name}.direction = {table['direction']} does nothing beside sensors.{name}.along = "
                f"{table['along']}; leave one of the two out"
            )
        yield from _ends(name, table, plate)
        if plate.rigid:
            yield f"sensors.{name}.kind = strain: a rigid plate has no strain; leave the sensor or plate.rigid out"


def _ends(name: str, table: Mapping[str, Any], plate: PlateText) -> Iterator[str]:
    """Both ends of a gauge lie on the plate, as its middle does."""
    length, turned = LENGTH.valid(table.get("length")), DIRECTION.valid(table.get("direction", "0 deg"))
    if length is None or turned is None or "along" in table:  # else by `misplaced`
        return
    reaches = [0.5 * length * abs(reach) for reach in (math.cos(turned), math.sin(turned))]
    for key, beyond in overhang(table.get("at", ["0 mm", "0 mm"]), reaches, plate):
        yield (
            f"sensors.{name}.length = {table['length']}: an end of the gauge is {1e3 * beyond:.3g} mm beyond the "
            f"plate (plate.{key} = {plate.texts[key]}); a shorter gauge, or another place or direction?"
        )


def of_rosette(first: float, between: float, second: float, principal: bool) -> float:
    """Largest principal strain, or the effective one, of strains at 0, 45 and 90 degrees."""
    middle, shear = 0.5 * (first + second), between - 0.5 * (first + second)
    radius = math.hypot(0.5 * (first - second), shear)
    one, two = middle + radius, middle - radius
    return one if principal else math.sqrt(4.0 / 3.0 * (one * one + one * two + two * two))


class GaugePoint(NamedTuple):
    """One point of a gauge, and its share of the gauge.

    near (k,): the shells about it; offsets (k, 2) [m] of their centres; felt (k, 3): what the gauge feels of each
    strain there; heights (k, 1) [m] of its side above their mid-surfaces, along their own normals.
    """

    share: float
    near: NDArray[np.int64]
    offsets: Array
    felt: Array
    heights: Array


def gauge_points(sensor: Strain, run: Run) -> list[GaugePoint]:
    """The points at which a gauge feels the strain, one where it has no length."""
    from birdstrike.solver.sensors.places import normal_of  # late: loading a case needs no compiled kernels

    plate, toward = run.plate, sensor.laid(run.plate.mesh)
    steps, shares = POINTS if sensor.length else (np.zeros(1), np.full(1, 2.0))
    outward = sensor.face(plate.mesh) * normal_of(plate.mesh, sensor.located(run)[0])
    points = []
    for step, share in zip(steps, 0.5 * shares, strict=True):
        moved = sensor.shifted(0.5 * (sensor.length or 0.0) * step, plate.mesh) if step else sensor
        points.append(point_of_gauge(share, plate, moved.located(run), toward, outward))
    return points


def shells_of(points: list[GaugePoint]) -> NDArray[np.int64]:
    """Those that a gauge feels, rising."""
    return np.unique(np.concatenate([point.near for point in points]))


def gauge_shares(points: list[GaugePoint], near: NDArray[np.int64], alive: NDArray[np.bool_]) -> Array:
    """The shares (k, 8) of the strains of the shells near (k,) that a gauge feels.

    alive (k,): those that have torn have none, unless no other is left about a point.
    """
    from birdstrike.solver.sensors.places import blend  # late: loading a case needs no compiled kernels

    total = np.zeros((len(near), 8))
    for share, shells, offsets, felt, heights in points:
        rows = np.searchsorted(near, shells)
        left = alive[rows] if alive[rows].any() else np.ones(len(rows), np.bool_)
        weight = share * blend(offsets[left])[:, None]
        total[rows[left], :3] += weight * felt[left]
        total[rows[left], 3:6] += weight * heights[left] * felt[left]
    return total


def point_of_gauge(
    share: float, plate: Target, where: tuple[int, float, float], toward: Array, outward: Array
) -> GaugePoint:
    """One point of a gauge.

    where: facet, xi and eta; toward: direction in space (3,), laid on each element; outward (3,): the normal on the
    gauge's side.
    """
    # late: loading a case needs no compiled kernels
    from birdstrike.solver.sensors.places import facets_around, point_at
    from birdstrike.solver.target.mesh import centres_of

    element, xi, eta = where
    near = facets_around(plate.quads, where)
    frame = plate.frames(near).reshape(-1, 3, 3)
    own = plate.frames(np.array([element])).reshape(3, 3)
    for facets in plate.mesh.parts.values():  # over a joint, and in a part of another section, the field is another
        if element in facets:
            level = np.isin(near, facets) & (np.abs(frame[:, 2] @ own[2]) > LEVEL)
            near, frame = near[level], frame[level]
    turned = np.sign(frame[:, 2] @ outward)[:, None]
    centres = centres_of(plate.mesh.nodes, plate.quads[near]) - point_at(plate.mesh, element, xi, eta)
    along = frame[:, :2] @ toward
    c, s = (along / np.linalg.norm(along, axis=1)[:, None]).T
    felt = np.stack([c * c, s * s, c * s], axis=1)
    return GaugePoint(share, near, centres @ own[:2].T, felt, plate.skin[element] * turned)
