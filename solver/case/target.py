"""What a case says of a target of several parts; after validation every value is SI."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import Field, ValidationError, model_validator

from birdstrike.data.units import quantity_text
from birdstrike.solver.case.plate import EDGE_WORDS, EdgeSprings
from birdstrike.solver.fields import Between, Section, WordOr, complaint
from birdstrike.solver.target.generators.interface import Generator
from birdstrike.solver.target.generators.registry import GENERATORS
from birdstrike.solver.target.laws.interface import Metal, TargetMaterial
from birdstrike.solver.target.laws.registry import TARGET_LAWS


class Part(Section):
    """material: a name under `target.materials`."""

    thickness: Annotated[float, Between("0.1 mm", "50 mm")]
    material: str


class Target(Section):
    """A target of named parts; supports: how sets of nodes are held, a word or a table of springs.

    damping [1/s]: rate at which a free vibration's amplitude decays.
    """

    generator: Annotated[Generator, GENERATORS]
    materials: dict[str, Annotated[TargetMaterial, TARGET_LAWS]]
    parts: dict[str, Part]
    supports: dict[str, Annotated[str | EdgeSprings, WordOr(EDGE_WORDS, EdgeSprings)]] = Field(default_factory=dict)
    damping: Annotated[float, Between("0 1/s", "1e5 1/s")] = 0.0

    @model_validator(mode="after")
    def _names_that_belong_together(self) -> Target:
        """Every part of the mesh has its thickness and a known material; every support is of a set of the mesh."""
        known, given = self.generator.parts, self.parts
        for name in known:
            if name not in given:
                raise complaint(f"has no parts.{name}: give it a thickness and a material")
        for name, part in given.items():
            if name not in known:
                raise complaint(f"has parts.{name}, which the mesh has not; its parts: {', '.join(known)}")
            if part.material not in self.materials:
                names = ", ".join(self.materials) or "none"
                raise complaint(f'has parts.{name}.material = "{part.material}", unknown; materials: {names}')
        for name in self.supports:
            if name not in self.generator.sets:
                sets = ", ".join(self.generator.sets)
                raise complaint(f"has supports.{name}, a set of nodes that does not exist; sets: {sets}")
        return self


def with_envelope(table: Mapping[str, Any]) -> Mapping[str, Any]:
    """A case's table with the plate that stands for its target where only the size of what is struck is asked for.

    Its length and width are the target's, thickness and metal those of the part that the bird is aimed at.
    """
    if "target" not in table or "plate" in table:
        return table
    try:
        return table | {"plate": envelope(Target.model_validate(table["target"]))}
    except ValidationError:  # the case's own validation says what is wrong
        return table | {"plate": PLACEHOLDER}


PLACEHOLDER = {"length": "1 m", "width": "1 m", "thickness": "1 mm", "elements": [2, 2], "rigid": True}


def envelope(target: Target) -> dict[str, Any]:
    """The plate that stands for a target, as a case's table has it."""
    generator = target.generator
    struck = target.parts[generator.struck]
    material = target.materials[struck.material]
    plate: dict[str, Any] = {
        "length": quantity_text(generator.length, "m"),
        "width": quantity_text(generator.width, "m"),
        "thickness": quantity_text(struck.thickness, "m"),
        "elements": [max(round(side / generator.element_size), 2) for side in (generator.length, generator.width)],
    }
    if not isinstance(material, Metal):
        return plate | {"rigid": True}
    metal = {
        "young": quantity_text(material.young, "Pa"),
        "poisson": material.poisson,
        "density": quantity_text(material.density, "kg/m^3"),
        "yield_stress": quantity_text(material.first_yield, "Pa"),
    }
    return plate | {"edges": "clamped" if target.supports else "free", "material": metal}
