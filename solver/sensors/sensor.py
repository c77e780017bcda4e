"""A kind of sensor: what a case says of it, what it reads from the running state, and how its readings are sampled."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray
from pydantic import field_validator

from birdstrike.data.histories import Array
from birdstrike.solver.fields import Between, Section

if TYPE_CHECKING:  # the types bring in the compiled kernels, which loading a case has no use for
    from birdstrike.solver.bird.body import BirdBody
    from birdstrike.solver.contact import Contact
    from birdstrike.solver.target.assembly import Target
    from birdstrike.solver.target.mesh import ShellMesh

PLACE = Between("-2500 mm", "2500 mm")
OFF = 0.5
"""Of the nearest shell's longest side, by which a stated place may lie off the target."""
Component = Annotated[float, Between(-1.0, 1.0)]
Along = tuple[Component, Component, Component]
"""A direction in space, of any length up to 1 a component."""


class Run(Protocol):
    """The running state as sensors see it.

    normal: of the plane that is struck, a unit vector (3,), z where that is level; push: contact force on the plate
    against it [N]; reaction: force on the frame, (3,) [N].
    """

    @property
    def plate(self) -> Target:
        """The target."""
        ...

    @property
    def bird(self) -> BirdBody:
        """The bird."""
        ...

    @property
    def contact(self) -> Contact:
        """Contact between them."""
        ...

    @property
    def normal(self) -> Array:
        """(3,)."""
        ...

    @property
    def push(self) -> float:
        """[N]."""
        ...

    @property
    def reaction(self) -> Array:
        """(3,) [N]."""
        ...


Reading = Callable[[Run], float]


@dataclass(frozen=True)
class PlateText:
    """The plate as the file has it, for rules that a sensor must keep: text and SI size [m] by key, None if wrong."""

    texts: Mapping[str, Any]
    sizes: Mapping[str, float | None]
    rigid: bool


def overhang(place: Any, reaches: Sequence[float], plate: PlateText) -> Iterator[tuple[str, float]]:
    """Side of the plate and length [m] by which a sensor of these half sizes [m] hangs over it.

    place: texts along length and width, as the file has them; a middle that is not on the plate is told elsewhere.
    """
    for text, key, reach in zip(place if isinstance(place, list) else (), ("length", "width"), reaches, strict=False):
        offset, size = PLACE.valid(text), plate.sizes[key]
        if offset is None or size is None or abs(offset) > 0.5 * size:
            continue
        if (beyond := abs(offset) + reach - 0.5 * size) > 1e-9 * size:
            yield key, beyond


@dataclass(frozen=True)
class TargetNames:
    """Names of a target of several parts that a sensor may use: of its parts, and of the supports that hold it."""

    parts: tuple[str, ...]
    supports: tuple[str, ...]


class Sensor(Section):
    """What is recorded; `kind` names it. A kind is a class derived from this one, in the registry `SENSORS`.

    noise: 1 sigma, in the channel's SI unit. Of the class: noise_range, whose unit is the channel's; drift_range: of
    its instrument's drift, that unit per second; noun: the sensor in words; figures: numbers of its curve whose
    convergence with the mesh is of interest, of "impulse", "peak", "peak_time"; is_transducer: whether it stands for a
    displacement transducer, whose gain, bandwidth and drift the library's effects change.
    """

    noise_range: ClassVar[Between]
    drift_range: ClassVar[Between]
    noun: ClassVar[str]
    figures: ClassVar[tuple[str, ...]] = ("peak", "peak_time")
    is_transducer: ClassVar[bool] = False

    kind: str
    noise: float | None = None

    @field_validator("noise", mode="before")
    @classmethod
    def _noise_in_the_unit_of_its_kind(cls, value: Any) -> float | None:
        return None if value is None else cls.noise_range.validate(value)

    @property
    def unit(self) -> str:
        """SI unit of the channel."""
        return self.noise_range.unit

    @property
    def place(self) -> tuple[float, float] | None:
        """Where it sits, from the plate's centre along length and width [m]; None for one that has no place."""
        return None

    def canonical(self) -> dict[str, Any]:
        """What changes its history, SI; `at` of every kind, because the hashes of stored cases hold it."""
        return {"at": list(self.place or (0.0, 0.0))} | self.model_dump(mode="json", exclude={"noise"})

    def elements(self, _run: Run, /) -> NDArray[np.int64]:
        """Elements of the plate whose strain increments must be summed for it."""
        return np.empty(0, np.int64)

    def reading(self, run: Run, /) -> Reading:
        """What it reads from the state at every step; run: the state before the first one."""
        raise NotImplementedError(self.kind)

    def sampled(self, clock: Array, time: Array, values: Array) -> Array:
        """Readings of every step on the user's clock [s]: means over the sampling interval around each instant.

        What oscillates at a multiple of the sampling rate, and would otherwise come back as a slow wave that is not
        there, leaves nothing; no impulse is lost.
        """
        return mean_over_interval(clock, time, values)

    def remarks(self, _name: str, _run: Run, /) -> Iterator[str]:
        """What the user should know of its readings in a finished run."""
        yield from ()

    @classmethod
    def broken_rules(cls, _name: str, _table: Mapping[str, Any], _plate: PlateText, /) -> Iterator[str]:
        """One line for every rule between fields that a sensor's table, as read, breaks."""
        yield from ()

    def unknown_names(self, _name: str, _target: TargetNames | None, /) -> Iterator[str]:
        """One line for every name that it uses and the target has not; None: the target is a plate."""
        yield from ()

    def misplaced(self, _name: str, _mesh: ShellMesh, /) -> Iterator[str]:
        """One line for every reason why it cannot lie on these shells at rest."""
        yield from ()


class Placed(Sensor):
    """A sensor at a place; at: from the plate's centre along length and width, on the undeformed plate [m].

    On a target of several parts it may be given by a point in space [m] and the part that it lies on, absent: any; the
    nearest place at rest is taken.
    """

    at: tuple[Annotated[float, PLACE], Annotated[float, PLACE]] = (0.0, 0.0)
    point: tuple[Annotated[float, PLACE], Annotated[float, PLACE], Annotated[float, PLACE]] | None = None
    part: str | None = None

    @property
    def place(self) -> tuple[float, float]:
        """Where it sits [m]."""
        return self.at if self.point is None else self.point[:2]

    def canonical(self) -> dict[str, Any]:
        """Without what a sensor on a plate does not have."""
        unsaid = {key for key in ("point", "part", "along", "measure") if getattr(self, key, None) is None}
        return {key: value for key, value in super().canonical().items() if key not in unsaid}

    def located(self, run: Run, /) -> tuple[int, float, float]:
        """Facet, xi and eta of its place."""
        return self.on(run.plate.mesh)

    def on(self, mesh: ShellMesh) -> tuple[int, float, float]:
        """Facet, xi and eta of its place on shells at rest."""
        from birdstrike.solver.sensors.places import place_in_space, place_on  # late: it brings in compiled kernels

        if self.point is None:
            return place_on(mesh, self.at)
        return place_in_space(mesh, np.array(self.point), self.part)

    def extent(self, _mesh: ShellMesh, /) -> Iterator[tuple[str, Placed]]:
        """What must lie on the shells: key by which it is stated, and a sensor there."""
        yield "at" if self.point is None else "point", self

    def misplaced(self, name: str, mesh: ShellMesh, /) -> Iterator[str]:
        """It lies off the shells by more than half of the nearest one."""
        from birdstrike.solver.sensors.places import point_at  # late: it brings in compiled kernels

        for key, one in self.extent(mesh):
            facet, xi, eta = one.on(mesh)
            corners = mesh.nodes[mesh.quads[facet]]
            nearest = point_at(mesh, facet, xi, eta)
            stated = np.array(one.at if one.point is None else one.point)
            reached = nearest if one.point is not None else point_at(mesh, facet, xi, eta, mesh.surface)
            off = float(np.linalg.norm(reached - stated))
            if off > OFF * float(np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1).max()):
                part = f" on part {mesh.part_of(facet)}" if mesh.parts else ""
                said, found = (", ".join(f"{c:.6g}" for c in np.round(1e3 * p, 3) + 0.0) for p in (stated, nearest))
                within = f" of part {self.part}" if self.part else ""
                yield (
                    f"sensors.{name}.{key}: ({said}) mm lies {1e3 * off:.4g} mm off the target's shells{within} at "
                    f"rest; the nearest place is ({found}) mm{part}: correct sensors.{name}"
                )

    def unknown_names(self, name: str, target: TargetNames | None, /) -> Iterator[str]:
        """Its part is one of the target's."""
        if self.part is None:
            return
        if target is None:
            yield f'sensors.{name}.part = "{self.part}" does nothing on a plate, which has no parts; leave it out'
        elif self.part not in target.parts:
            known = ", ".join(target.parts)
            yield f'sensors.{name}.part = "{self.part}": the mesh has no such part; its parts: {known}'

    @classmethod
    def broken_rules(cls, name: str, table: Mapping[str, Any], plate: PlateText, /) -> Iterator[str]:
        """It lies on the plate, has one place, and a direction where it states one."""
        place = table.get("at")
        if place is not None and table.get("point") is not None:
            yield f"sensors.{name} has at and point, two places; keep one"
        if table.get("part") is not None and table.get("point") is None:
            given = f"sensors.{name}.part = {table['part']}"
            yield f"{given} needs a point in space; give sensors.{name}.point, or leave it out"
        yield from no_direction(name, table)
        for text, key in zip(place if isinstance(place, list) else (), ("length", "width"), strict=False):
            offset, size = PLACE.valid(text), plate.sizes[key]
            if offset is not None and size is not None and abs(offset) > 0.5 * size:
                where = f"within half of plate.{key} = {plate.texts[key]} of its centre"
                yield f'sensors.{name}.at: "{text}" is off the plate; {where}'


def no_direction(name: str, table: Mapping[str, Any]) -> Iterator[str]:
    """One line where a sensor's table, as read, has a direction `along` that is of no length."""
    along = table.get("along")
    if isinstance(along, list) and along and all(c == 0 for c in along):
        yield f"sensors.{name}.along = {along} is no direction; write one such as [1.0, 0.0, 0.0], or leave it out"


def mean_over_interval(clock: Array, time: Array, values: Array) -> Array:
    """Mean over each sampling interval centred on the clock, from the integral: no impulse is lost or aliased.

    An interval before the first instant or beyond the last one has the value there.
    """
    integral = np.concatenate([[0.0], np.cumsum(0.5 * (values[1:] + values[:-1]) * np.diff(time))])
    half = 0.5 * (clock[1] - clock[0])
    early, late = (np.clip(clock + side, time[0], time[-1]) for side in (-half, half))
    gained, length = np.interp(late, time, integral) - np.interp(early, time, integral), late - early
    return np.where(length > 0.0, gained / np.where(length > 0.0, length, 1.0), np.interp(clock, time, values))


def deformable(run: Run) -> Target:
    """The target, if it strains; raises UserError."""
    run.plate.require_strain()
    return run.plate


def shell_is_gone(run: Run, sensor: Placed) -> bool:
    """Whether the shell under a sensor has torn."""
    return not run.plate.alive[sensor.located(run)[0]]


def torn(name: str) -> str:
    """A warning about a sensor whose shell is gone."""
    return f"sensors.{name} lies on a shell that tore: what it reads since then is no measurement"
