"""What a case says of the bird: shape, material, discretisation; after validation every value is SI."""

from __future__ import annotations

import math
from typing import Annotated, Any

from pydantic import model_validator

from solver.bird_shape import SHAPES, volume
from solver.case_fields import Between, Count, OneOf, Section


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
    """Idealised bird: `length` overall; either its mass [kg] or its density [kg/m^3] is given.

    particles: number of particles or, by method "hexahedra", of elements wanted; the nearest that fits is taken.
    """

    shape: Annotated[str, OneOf(SHAPES)]
    diameter: Annotated[float, Between("5 mm", "1000 mm")]
    length: Annotated[float, Between("5 mm", "3000 mm")]
    mass: Annotated[float, Between("1 g", "50000 g")] | None = None
    density: Annotated[float, Between("50 kg/m^3", "3000 kg/m^3")] | None = None
    method: Annotated[str, OneOf(("sph", "hexahedra"))] = "sph"
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
