"""What a case says of the bird: shape, material, discretisation; after validation every value is SI."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import model_validator

from birdstrike.data.units import quantity_text
from birdstrike.solver.bird.eos.registry import EQUATIONS_OF_STATE
from birdstrike.solver.bird.materials.registry import BIRD_MATERIALS
from birdstrike.solver.bird.shape import SHAPES, size_of_mass, statistical_density, statistical_diameter, volume
from birdstrike.solver.fields import Between, Count, OneOf, Section, Switch

MASS, DENSITY = Between("0.001 kg", "50 kg"), Between("50 kg/m^3", "3000 kg/m^3")
SLENDERNESS = Between(1.0, 10.0)

PARTICLES = Count(100, 200_000)


class Bird(Section):
    """Idealised bird, `length` overall. Its size and density come from

    diameter, length and one of mass [kg] and density [kg/m^3]; or mass, density and slenderness = length/diameter;
    or mass and statistics = true: density and diameter of birds of that mass, the length following from them (or from
    slenderness, the diameter then from the mass). A porous law gives the density where none stands.
    particles: number of particles or, by method "hexahedra", of elements wanted; the nearest that fits is taken.
    jitter: random shift of each lattice point, share of the spacing, drawn from `seed`.
    """

    shape: Annotated[str, OneOf(SHAPES)]
    diameter: Annotated[float, Between("5 mm", "1000 mm")]
    length: Annotated[float, Between("5 mm", "3000 mm")]
    mass: Annotated[float, MASS] | None = None
    density: Annotated[float, DENSITY] | None = None
    slenderness: Annotated[float, SLENDERNESS] | None = None
    statistics: Annotated[bool, Switch()] = False
    method: Annotated[str, OneOf(("sph", "hexahedra"))] = "sph"
    particles: Annotated[int, PARTICLES] = 4500
    lattice: Annotated[str, OneOf(("fcc", "cubic"))] = "fcc"
    jitter: Annotated[float, Between(0.0, 0.3)] = 0.0
    seed: Annotated[int, Count(0, 2_000_000_000)] = 0
    material: Annotated[Any, BIRD_MATERIALS]  # a BirdMaterial; each model has keys of its own

    @model_validator(mode="before")
    @classmethod
    def _size_and_density(cls, raw: Any) -> Any:
        return raw | derived(raw) if isinstance(raw, dict) else raw

    @property
    def volume(self) -> float:
        """[m^3] of the ideal shape."""
        return volume(self.shape, self.diameter, self.length)

    @property
    def actual_density(self) -> float:
        """[kg/m^3], from the mass where that is given."""
        if self.density is not None:
            return self.density
        return float("nan") if self.mass is None else self.mass / self.volume

    @property
    def actual_mass(self) -> float:
        """[kg], from the density where that is given."""
        return self.mass if self.mass is not None else self.actual_density * self.volume


def derived(raw: Mapping[str, Any]) -> dict[str, Any]:
    """Diameter, length and density that follow from the other keys of `bird`, as texts; what is wrong is left alone."""
    mass, slenderness = MASS.valid(raw.get("mass")), SLENDERNESS.valid(raw.get("slenderness"))
    found: dict[str, Any] = {}
    density = DENSITY.valid(raw.get("density"))
    if density is None and raw.get("density") is None:
        density = statistical_density(mass) if raw.get("statistics") is True and mass else density_of_law(raw)
        if density is not None and (mass is None or "diameter" not in raw):
            found["density"] = quantity_text(density, "kg/m^3")
    if "diameter" in raw:
        return found | ({"length": raw["diameter"]} if raw.get("shape") == "sphere" and "length" not in raw else {})
    if mass is None or density is None or raw.get("shape") not in SHAPES:
        return found
    if slenderness is None and raw["shape"] == "sphere":
        slenderness = 1.0
    given = statistical_diameter(mass) if slenderness is None and raw.get("statistics") is True else None
    if slenderness is None and given is None:
        return found
    diameter, length = size_of_mass(raw["shape"], mass / density, slenderness, given)
    return found | {"diameter": quantity_text(diameter, "m"), "length": quantity_text(length, "m")}


def density_of_law(raw: Mapping[str, Any]) -> float | None:
    """Density [kg/m^3] that the law gives the bird; None for a law that gives none and for one that is in error."""
    material = raw.get("material")
    eos = material.get("eos") if isinstance(material, Mapping) else None
    law = EQUATIONS_OF_STATE.chosen(eos)
    if law is None or not law.gives_density:
        return None
    try:
        return law.model_validate(eos).own_density
    except ValueError:
        return None
