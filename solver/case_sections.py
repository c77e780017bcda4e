"""What a case says of the strike itself: plate, bird, impact, time; and the quantities under its dotted keys."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any, get_args

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from solver.case_bird import Bird
from solver.case_fields import Between, OneOf, Section
from solver.case_plate import Plate


class Impact(Section):
    """angle [rad] from the plate's surface; standoff [m]: way flown before the first touch, so that it sets t = 0."""

    speed: Annotated[float, Between("0.1 m/s", "1000 m/s")]
    angle: Annotated[float, Between("1 deg", "90 deg")]
    aim: Annotated[str, OneOf(("axis", "first_touch"))] = "axis"
    standoff: Annotated[float, Between("0 mm", "1000 mm")] = 0.0
    friction: Annotated[float, Between(0.0, 2.0)] = 0.0


class Time(Section):
    """end, output_interval, snapshots: [s]."""

    end: Annotated[float, Between("0.001 ms", "100 ms")]
    output_interval: Annotated[float, Between("0.01 us", "1000 us")] = 5e-6
    snapshots: tuple[Annotated[float, Between("0 ms", "100 ms")], ...] = ()


STRIKE: dict[str, type[Section]] = {"plate": Plate, "bird": Bird, "impact": Impact, "time": Time}


def quantity_at(key: str) -> Between | None:
    """Range and unit of the physical quantity under a dotted key ("bird.material.viscosity"); None where none is."""
    first, *rest = key.split(".")
    model: Any = STRIKE.get(first)
    metadata: list[Any] = []
    for name in rest:
        fields = getattr(model, "model_fields", {})
        if name not in fields:
            return None
        model, metadata = section_of(fields[name].annotation), metadata_of(fields[name])
    return next((mark for mark in metadata if isinstance(mark, Between)), None)


def section_of(annotation: Any) -> Any:
    """The section among a field's types ("a word, or a table"), else the annotation itself."""
    parts = (part for part in get_args(annotation) if isinstance(part, type) and issubclass(part, BaseModel))
    return next(parts, annotation)


def metadata_of(field: FieldInfo) -> list[Any]:
    """Annotations of a field, also under `| None`."""
    optional = (mark for part in get_args(field.annotation) for mark in getattr(part, "__metadata__", ()))
    return [*field.metadata, *optional]


def quantities(model: type[BaseModel] | None = None, prefix: str = "") -> Iterator[tuple[str, Between]]:
    """Every dotted key of the strike that holds a physical quantity."""
    fields = STRIKE if model is None else {n: section_of(f.annotation) for n, f in model.model_fields.items()}
    for name, kind in fields.items():
        key = f"{prefix}{name}"
        if isinstance(kind, type) and issubclass(kind, BaseModel):
            yield from quantities(kind, f"{key}.")
        elif mark := quantity_at(key):
            yield key, mark
