"""What a case says of the strike itself: plate, bird, impact, time; after validation every value is SI."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated, Any, get_args

from pydantic import BaseModel, ConfigDict, model_validator
from pydantic.fields import FieldInfo

from solver.bird_shape import SHAPES, volume
from solver.case_fields import Between, Count, OneOf


class Section(BaseModel):
    """Part of a case: immutable, and closed to keys that it does not know."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class PlateMaterial(Section):
    """Elastic-plastic metal. beta: 0 kinematic .. 1 isotropic; rate_c, rate_p: Cowper-Symonds, rate_c = 0 is off."""

    young: Annotated[float, Between("0.1 GPa", "1000 GPa")]
    poisson: Annotated[float, Between(0.0, 0.49)]
    density: Annotated[float, Between("100 kg/m^3", "25000 kg/m^3")]
    yield_stress: Annotated[float, Between("1 MPa", "10000 MPa")]
    tangent_modulus: Annotated[float, Between("0 MPa", "100000 MPa")] = 0.0
    beta: Annotated[float, Between(0.0, 1.0)] = 1.0
    rate_c: Annotated[float, Between("0 1/s", "1e9 1/s")] = 0.0
    rate_p: Annotated[float, Between(0.1, 100.0)] = 1.0
    failure_strain: Annotated[float, Between(0.001, 10.0)] = 10.0


class Plate(Section):
    """Rectangular plate, `length` along the velocity's plane; elements: shells along length and width."""

    length: Annotated[float, Between("20 mm", "5000 mm")]
    width: Annotated[float, Between("20 mm", "5000 mm")]
    thickness: Annotated[float, Between("0.1 mm", "50 mm")]
    elements: tuple[Annotated[int, Count(2, 400)], Annotated[int, Count(2, 400)]]
    edges: Annotated[str, OneOf(("clamped", "pinned", "free"))] = "clamped"
    material: PlateMaterial


class Grueneisen(Section):
    """Shock velocity u_s = C + S1 u + ...; g0 the Grueneisen gamma, a its first-order volume correction."""

    kind: Annotated[str, OneOf(("grueneisen",), ("linear_polynomial", "murnaghan", "polynomial_k", "porous", "table"))]
    C: Annotated[float, Between("10 m/s", "10000 m/s")]
    S1: Annotated[float, Between(0.0, 10.0)]
    S2: Annotated[float, Between(-10.0, 10.0)] = 0.0
    S3: Annotated[float, Between(-10.0, 10.0)] = 0.0
    g0: Annotated[float, Between(0.0, 10.0)] = 0.0
    a: Annotated[float, Between(-10.0, 10.0)] = 0.0


class BirdMaterial(Section):
    """NULL material: pressure floor [Pa] <= 0, dynamic viscosity [Pa s], erosion limits in V/V0.

    tension_erosion acts above 1, compression_erosion between 0 and 1; outside they are inactive (0 is off).
    """

    model: Annotated[str, OneOf(("null",), ("elastic", "plastic_kinematic", "hydrodynamic"))]
    pressure_cutoff: Annotated[float, Between("-1000 MPa", "0 MPa")]
    viscosity: Annotated[float, Between("0 Pa s", "10000 Pa s")]
    tension_erosion: Annotated[float, Between(0.0, 10.0)] = 0.0
    compression_erosion: Annotated[float, Between(0.0, 2.0)] = 0.0
    eos: Grueneisen

    @property
    def inactive(self) -> tuple[str, ...]:
        """Erosion limits that can erode nothing at their present value."""
        active = {
            "tension_erosion": self.tension_erosion > 1.0,
            "compression_erosion": 0.0 < self.compression_erosion < 1.0,
        }
        return tuple(name for name, acts in active.items() if not acts)


class Bird(Section):
    """Idealised bird: `length` overall; either its mass [kg] or its density [kg/m^3] is given."""

    shape: Annotated[str, OneOf(SHAPES)]
    diameter: Annotated[float, Between("5 mm", "1000 mm")]
    length: Annotated[float, Between("5 mm", "3000 mm")]
    mass: Annotated[float, Between("1 g", "50000 g")] | None = None
    density: Annotated[float, Between("50 kg/m^3", "3000 kg/m^3")] | None = None
    method: Annotated[str, OneOf(("sph",), ("hexahedra",))] = "sph"
    particles: Annotated[int, Count(100, 200_000)] = 4500
    lattice: Annotated[str, OneOf(("fcc", "cubic"))] = "fcc"
    material: BirdMaterial

    @model_validator(mode="before")
    @classmethod
    def _a_sphere_is_as_long_as_wide(cls, raw: Any) -> Any:
        if isinstance(raw, dict) and raw.get("shape") == "sphere" and "diameter" in raw:
            return {"length": raw["diameter"]} | raw
        return raw

    @property
    def overall_length(self) -> float:
        """[m] from nose to tail, whatever the shape."""
        return self.length

    @property
    def volume(self) -> float:
        """[m^3] of the ideal shape."""
        return volume(self.shape, self.diameter, self.length)

    @property
    def actual_density(self) -> float:
        """[kg/m^3], from the mass where that is given."""
        return self.mass / self.volume if self.mass is not None else self.density or math.nan

    @property
    def actual_mass(self) -> float:
        """[kg], from the density where that is given."""
        return self.mass if self.mass is not None else self.actual_density * self.volume


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
        model, metadata = fields[name].annotation, metadata_of(fields[name])
    return next((mark for mark in metadata if isinstance(mark, Between)), None)


def metadata_of(field: FieldInfo) -> list[Any]:
    """Annotations of a field, also under `| None`."""
    optional = (mark for part in get_args(field.annotation) for mark in getattr(part, "__metadata__", ()))
    return [*field.metadata, *optional]


def quantities(model: type[BaseModel] | None = None, prefix: str = "") -> Iterator[tuple[str, Between]]:
    """Every dotted key of the strike that holds a physical quantity."""
    for name, kind in STRIKE.items() if model is None else ((n, f.annotation) for n, f in model.model_fields.items()):
        key = f"{prefix}{name}"
        if isinstance(kind, type) and issubclass(kind, BaseModel):
            yield from quantities(kind, f"{key}.")
        elif mark := quantity_at(key):
            yield key, mark
