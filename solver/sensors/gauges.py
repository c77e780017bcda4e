"""Gauges: what each kind of sensor reads from the present state of a strike."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from birdstrike.data.errors import UserError
from birdstrike.data.histories import Array
from birdstrike.solver.bird.body import BirdBody
from birdstrike.solver.case.sensors import Sensor
from birdstrike.solver.contact import Contact
from birdstrike.solver.kernels.contact import bilinear
from birdstrike.solver.kernels.gauge import force_on_disc
from birdstrike.solver.plate.mesh import PlateMesh
from birdstrike.solver.plate.shell import Plate
from birdstrike.solver.sensors.places import blend, facets_around, place_on, point_at

if TYPE_CHECKING:
    from birdstrike.solver.coupling import Strike

POINTS = np.polynomial.legendre.leggauss(5)  # along a strain gauge of finite length
FEWEST_SPACINGS = 3.0  # of a pressure gauge's radius

Reading = Callable[["Strike"], float]


def gauges(sensors: dict[str, Sensor], strike: Strike) -> dict[str, Reading]:
    """Reading functions by sensor: displacement [m] and forces [N] positive in the push (-z), strain positive in
    tension, pressure [Pa] positive in compression."""
    strains = {name: sensor for name, sensor in sensors.items() if sensor.kind == "strain"}
    return {name: one(sensor, strike) for name, sensor in sensors.items() if sensor.kind != "strain"} | strain_gauges(
        strains, strike
    )


def one(sensor: Sensor, strike: Strike) -> Reading:
    """Reading of a sensor of any kind but strain."""
    if sensor.kind == "contact_force":
        return lambda now: now.push
    if sensor.kind == "reaction_force":
        return lambda now: -float(now.reaction[2])
    return pressure(sensor, strike) if sensor.kind == "pressure" else displacement(sensor, strike)


def displacement(sensor: Sensor, strike: Strike) -> Reading:
    """Of a material point of the mid-surface, by the shape functions of the element that holds it."""
    element, xi, eta = place_on(strike.plate.mesh, sensor.at)
    nodes, shape = strike.plate.quads[element], np.array(bilinear(xi, eta))
    rest = strike.plate.x[nodes, 2].copy()
    return lambda now: float(shape @ (rest - now.plate.x[nodes, 2]))


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
        touching = (contact.quads, contact.watched, bird.active, contact.facet, contact.foot)
        disc = (self.centre, self.radius, self.width)
        force = force_on_disc(bird.n, contact.stiffness, contact.gap, self.nodes, *touching, *disc)
        return force / (math.pi * (self.radius**2 + self.width**2 / 12.0))


def disc(sensor: Sensor, mesh: PlateMesh, spacing: float) -> Disc:
    """The disc of a pressure sensor under a bird of this particle spacing [m]."""
    return Disc(mesh.nodes, point_at(mesh, *place_on(mesh, sensor.at)), sensor.radius, spacing)


def pressure(sensor: Sensor, strike: Strike) -> Reading:
    """Of the gauge's disc."""
    gauge = disc(sensor, strike.plate.mesh, strike.contact.spacing)
    return lambda now: gauge.pressure(now.bird, now.contact)


def coarse_gauges(sensors: dict[str, Sensor], strike: Strike) -> list[str]:
    """Warnings about pressure gauges that few particles reach."""
    spacing = strike.contact.spacing
    return [
        f"sensors.{name}.radius = {1e3 * sensor.radius:.3g} mm is {sensor.radius / spacing:.1f} particle spacings: "
        f"below {FEWEST_SPACINGS:.0f} a pressure is coarse; raise bird.particles or the radius"
        for name, sensor in sensors.items()
        if sensor.kind == "pressure" and round(sensor.radius / spacing, 1) < FEWEST_SPACINGS
    ]


def strain_gauges(sensors: dict[str, Sensor], strike: Strike) -> dict[str, Reading]:
    """Surface strains, (L - L0)/L0 along each gauge, by the elements' co-rotational strain increments.

    The increments of membrane strain and curvature sum up in the plate (`Plate.watch`), on the surface as
    e = membrane + z curvature with z = t/2 on the impact side, -t/2 on the back. They are brought from the elements'
    centres to the gauge (`places.blend`), and averaged over its length where it has one. The sum is the logarithmic
    strain, ln(L/L0).
    """
    if not sensors:
        return {}
    plate = strike.plate
    if not isinstance(plate, Plate):
        raise UserError("a rigid plate has no strain: leave out its strain sensors or plate.rigid")
    weights = {name: gauge_weights(sensor, plate, strike.contact.side) for name, sensor in sensors.items()}
    elements = np.unique(np.concatenate([near for near, _ in weights.values()]))
    plate.watch(elements)

    def reading(near: NDArray[np.int64], share: Array) -> Reading:
        rows = np.searchsorted(elements, near)
        return lambda _: math.expm1(float((share * plate.felt[rows]).sum()))

    return {name: reading(near, share) for name, (near, share) in weights.items()}


def gauge_weights(sensor: Sensor, plate: Plate, side: int) -> tuple[NDArray[np.int64], Array]:
    """Elements (k,) and the shares (k, 8) of their strains that a gauge feels. side: see `Contact`."""
    toward = np.array([math.cos(sensor.direction), math.sin(sensor.direction)])
    at = np.array(sensor.at)
    steps, shares = POINTS if sensor.length else (np.zeros(1), np.full(1, 2.0))
    height = 0.5 * plate.thickness * side * (1.0 if sensor.side == "impact" else -1.0)
    total = np.zeros((len(plate.quads), 8))
    for step, share in zip(steps, 0.5 * shares, strict=True):
        x, y = at + 0.5 * (sensor.length or 0.0) * step * toward
        add_point(total, share, plate, (float(x), float(y)), toward, height)
    near = np.flatnonzero(np.abs(total).sum(axis=1)).astype(np.int64)
    return near, total[near]


def add_point(total: Array, share: float, plate: Plate, at: tuple[float, float], toward: Array, height: float) -> None:
    """Add the shares of one point of a gauge to total (e, 8); toward: (2,) direction in plan, laid on each element."""
    element, xi, eta = place_on(plate.mesh, at)
    near = facets_around(plate.quads, element)
    frame = plate.frame[near].reshape(-1, 3, 3)
    centres = plate.mesh.nodes[plate.quads[near]].mean(axis=1) - point_at(plate.mesh, element, xi, eta)
    own = plate.frame[element].reshape(3, 3)
    along = frame[:, :2, :2] @ toward
    c, s = (along / np.linalg.norm(along, axis=1)[:, None]).T
    felt = np.stack([c * c, s * s, c * s], axis=1)
    weight = share * blend(centres @ own[:2].T)[:, None]
    total[near, :3] += weight * felt
    total[near, 3:6] += weight * height * felt
