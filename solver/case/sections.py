"""What a case says of the event itself: plate, bird, impact, time; and the quantities under its dotted keys."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from decimal import Decimal
from functools import cache
from types import UnionType
from typing import Annotated, Any, Union, get_args, get_origin

from pydantic import BaseModel, model_validator
from pydantic.fields import FieldInfo

from birdstrike.solver.case.bird import Bird
from birdstrike.solver.case.overlay import ANGLE, at, is_direction, slope_of
from birdstrike.solver.case.plate import Plate
from birdstrike.solver.case.target import Place, Target
from birdstrike.solver.fields import Between, OneOf, Section, complaint
from birdstrike.solver.registry import Kinds

ASIDE = Between("-2500 mm", "2500 mm")


class Impact(Section):
    """angle [rad] from the plate's surface; standoff [m]: way flown before the ideal surface touches: it sets t = 0.

    offset [m]: along length and width, from the plate's centre to the point of aim. yaw [rad]: angle between the bird's
    axis and its velocity, in the plane of the velocity and the horizontal across it; above 0 the nose points left
    of the way over the plate, seen from above: to the width's end where the heading is 0.
    pitch [rad]: the same in the plane of the velocity and the plate's normal; above 0 the nose is raised; after yaw.
    point [m]: in space, through which the bird's axis flies (`offset` then counts from it). direction: of the velocity,
    a vector of any length; it gives the angle and the way across the plate.
    """

    speed: Annotated[float, Between("0.1 m/s", "1000 m/s")]
    direction: tuple[float, float, float] | None = None
    angle: Annotated[float, ANGLE]
    aim: Annotated[str, OneOf(("axis", "first_touch"))] = "axis"
    standoff: Annotated[float, Between("0 mm", "1000 mm")] = 0.0
    offset: tuple[Annotated[float, ASIDE], Annotated[float, ASIDE]] = (0.0, 0.0)
    friction: Annotated[float, Between(0.0, 2.0)] = 0.0
    yaw: Annotated[float, Between("-45 deg", "45 deg")] = 0.0
    pitch: Annotated[float, Between("-45 deg", "45 deg")] = 0.0
    point: Place | None = None

    @model_validator(mode="before")
    @classmethod
    def _a_direction_gives_the_angle(cls, raw: Any) -> Any:
        """The angle from the surface of a direction that stands alone; what is no direction is refused."""
        if not isinstance(raw, dict) or raw.get("direction") is None:
            return raw
        given = raw["direction"]
        if not is_direction(given) or ANGLE.valid(f"{math.degrees(slope_of(given))!r} deg") is None:
            raise complaint(
                f"has direction = {given}; write three numbers of which the third is negative, such as "
                f"[0.8, 0.1, -0.6]: the bird flies towards -z, at {ANGLE.low} or more to the plane of x and y. A mesh "
                "from a file that is struck from another side must be turned in its file, such as x to z, and points "
                "and directions of the case with it"
            )
        if "angle" in raw:
            return raw
        return raw | {"angle": f"{math.degrees(slope_of(given))!r} deg"}

    @model_validator(mode="after")
    def _first_touch_is_of_a_plane_flight(self) -> Impact:
        if self.aim == "first_touch" and (self.direction or self.point or self.pitch):
            raise complaint('has aim = "first_touch", which knows no direction, point and pitch; leave them or it out')
        return self

    @property
    def heading(self) -> float:
        """Angle of the way over the plate from its length axis [rad]."""
        return 0.0 if self.direction is None else math.atan2(self.direction[1], self.direction[0])


class Time(Section):
    """end, output_interval, snapshots: [s]."""

    end: Annotated[float, Between("0.001 ms", "100 ms")]
    output_interval: Annotated[float, Between("0.01 us", "1000 us")] = 5e-6
    snapshots: tuple[Annotated[float, Between("0 ms", "100 ms")], ...] = ()

    @property
    def instants(self) -> tuple[float, ...]:
        """Multiples of the output interval up to the end [s], each the double nearest to its decimal."""
        interval = Decimal(repr(self.output_interval))
        return tuple(float(k * interval) for k in range(int(self.end / self.output_interval * (1.0 + 1e-12)) + 1))


PHYSICAL_SECTIONS: dict[str, type[Section]] = {
    "plate": Plate,
    "target": Target,
    "bird": Bird,
    "impact": Impact,
    "time": Time,
}


@cache
def quantity_at(key: str) -> Between | None:
    """Range and unit of the physical quantity under a dotted key ("bird.material.viscosity"); None where none is.

    A key that several models or laws share means the same quantity in all of them.
    """
    return _quantity(field for field in _fields(key) if not is_list(field))


@cache
def entry_at(key: str) -> Between | None:
    """Range and unit of every entry of the list under a dotted key ("impact.offset"); None where no such list is."""
    return _quantity(field for field in _fields(key) if is_list(field))


def quantity_in(content: Mapping[str, Any], key: str) -> Between | None:
    """As `quantity_at`, of the models and laws alone that a case's table has chosen."""
    return _quantity(field for field in _fields(key, content) if not is_list(field))


def _fields(key: str, content: Any = None) -> list[FieldInfo]:
    """The fields that a dotted key may mean: of all models and laws, or of those that `content` has chosen."""
    first, *rest = key.split(".")
    sections: list[type[Section]] = [PHYSICAL_SECTIONS[first]] if first in PHYSICAL_SECTIONS else []
    content, fields, named = _below(content, first), list[FieldInfo](), list[FieldInfo]()
    for name in rest:
        content = _below(content, name)
        known = (section.model_fields[name] for section in sections if name in section.model_fields)
        fields, named = (named, []) if named else (list(known), [])
        named = [entry for field in fields for entry in entries_of(field)]
        sections = [section for field in fields for section in sections_of(field, content)]
    return fields


def entries_of(field: FieldInfo) -> Iterator[FieldInfo]:
    """What a table whose keys are names that the user chooses holds under each; nothing for other fields."""
    if get_origin(field.annotation) is dict:
        yield FieldInfo.from_annotation(get_args(field.annotation)[1])


def sections_of(field: FieldInfo, content: Any = None) -> Iterator[type[Section]]:
    """The tables that a field may hold: all kinds of a registry, or the one that `content`, as read, has chosen."""
    marks = metadata_of(field) if get_origin(field.annotation) in (Union, UnionType) else field.metadata
    kinds = next((mark for mark in marks if isinstance(mark, Kinds)), None)
    if kinds is not None:
        chosen = kinds.chosen(content)
        yield from kinds.values() if chosen is None else (chosen,)
    elif isinstance(field.annotation, type) and issubclass(field.annotation, BaseModel):
        yield field.annotation  # pyright: ignore[reportReturnType] (every table of a case is a Section)
    elif get_origin(field.annotation) in (Union, UnionType):
        yield from (part for part in get_args(field.annotation) if isinstance(part, type) and issubclass(part, Section))


def _below(content: Any, name: str) -> Any:
    return content.get(name) if isinstance(content, Mapping) else None


def _quantity(fields: Iterable[FieldInfo]) -> Between | None:
    """The mark of a physical quantity that any of the fields carries."""
    marks = (mark for field in fields for mark in metadata_of(field))
    return next((mark for mark in marks if isinstance(mark, Between)), None)


def is_list(field: FieldInfo) -> bool:
    """Whether a field holds several values, of which none is sought by itself."""
    return get_origin(field.annotation) is tuple


def metadata_of(field: FieldInfo) -> list[Any]:
    """Annotations of a field, also under `| None`."""
    optional = (mark for part in get_args(field.annotation) for mark in getattr(part, "__metadata__", ()))
    return [*field.metadata, *optional]


def quantities(content: Mapping[str, Any] | None = None) -> Iterator[tuple[str, Between]]:
    """Every dotted key of these sections that holds a physical quantity; given a case's table, of its models alone."""
    for name, section in PHYSICAL_SECTIONS.items():
        yield from _quantities(section, f"{name}.", None if content is None else content.get(name, {}))


def _quantities(section: type[Section], prefix: str, content: Any) -> Iterator[tuple[str, Between]]:
    for name, field in section.model_fields.items():
        below = _below(content, name)
        nested = list(sections_of(field, below))
        found = (pair for kind in nested for pair in _quantities(kind, f"{prefix}{name}.", below))
        if nested:
            yield from dict(found).items()
        elif mark := quantity_at(f"{prefix}{name}"):
            yield f"{prefix}{name}", mark


def si(raw: Mapping[str, Any], key: str) -> float | None:
    """SI value under a dotted key, its default where it is absent; None for one that is an error, reported elsewhere.

    A key that has no default, or of which several models have one each, has None where it is absent.
    """
    mark, given = quantity_at(key), at(raw, key)
    if mark is None:
        return None
    return _default(key) if given is None else mark.valid(given)


@cache
def _default(key: str) -> float | None:
    """What a case that says nothing under a dotted key gets, SI; None where that is nothing or not one number."""
    defaults = {field.get_default() for field in _fields(key) if not is_list(field)}
    only = defaults.pop() if len(defaults) == 1 else None
    return only if isinstance(only, float) else None


def said(raw: Mapping[str, Any], key: str) -> str:
    """What a case has under a dotted key as the user reads it: as written, or the default marked as such."""
    given, mark, default = at(raw, key), quantity_at(key), si(raw, key)
    if given is None and mark is not None and default is not None:
        return f"{mark.display(default)} (the default)"
    return str(given)
