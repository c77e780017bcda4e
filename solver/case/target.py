"""What a case says of a target of several parts; after validation every value is SI."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Any

from pydantic import Field, ValidationError, model_validator

from birdstrike.data.errors import UserError
from birdstrike.data.units import quantity_text
from birdstrike.solver.case.plate import EDGE_WORDS, EdgeSprings
from birdstrike.solver.fields import Between, OneOf, Section, WordOr, complaint
from birdstrike.solver.target.generators.interface import Generator
from birdstrike.solver.target.generators.registry import GENERATORS
from birdstrike.solver.target.laws.interface import Metal, TargetMaterial
from birdstrike.solver.target.laws.registry import TARGET_LAWS
from birdstrike.solver.target.mesh_file import METRES, MeshFile, digest

PLACE = Between("-100000 mm", "100000 mm")


class Part(Section):
    """material: a name under `target.materials`."""

    thickness: Annotated[float, Between("0.1 mm", "50 mm")]
    material: str


class Target(Section):
    """A target of named parts; supports: how sets of nodes are held, a word or a table of springs.

    Its mesh is a generator's, or that of the file `mesh` in the unit of length `mesh_unit`; origin [m]: the point of
    the file's own axes on which the bird is aimed, from their z; struck: the part that it is aimed at.
    damping [1/s]: rate at which a free vibration's amplitude decays.
    """

    generator: Annotated[Generator, GENERATORS] | None = None
    mesh: str | None = None
    mesh_unit: Annotated[str, OneOf(tuple(METRES))] | None = None
    origin: tuple[Annotated[float, PLACE], Annotated[float, PLACE], Annotated[float, PLACE]] = (0.0, 0.0, 0.0)
    struck: str | None = None
    materials: dict[str, Annotated[TargetMaterial, TARGET_LAWS]]
    parts: dict[str, Part]
    supports: dict[str, Annotated[str | EdgeSprings, WordOr(EDGE_WORDS, EdgeSprings)]] = Field(default_factory=dict)
    damping: Annotated[float, Between("0 1/s", "1e5 1/s")] = 0.0

    @model_validator(mode="after")
    def _names_that_belong_together(self) -> Target:
        """Every part of the mesh has its thickness and a known material; every support is of a set of the mesh."""
        source = self.source
        idle = [key for key in ("mesh_unit", "origin", "struck") if key in self.model_fields_set]
        if self.generator is not None and idle:
            raise complaint(f"has {idle[0]}, which is of a mesh from a file; leave it out beside a generator")
        known, given = source.parts, self.parts
        if source.struck not in known:
            raise complaint(
                f'has struck = "{source.struck}", a part that the mesh has not; its parts: {", ".join(known)}'
            )
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
            if name not in source.sets:
                sets = ", ".join(source.sets)
                raise complaint(f"has supports.{name}, a set of nodes that does not exist; sets: {sets}")
        return self

    @property
    def source(self) -> Generator | MeshFile:
        """What makes the mesh; raises a complaint where the case names none, or a file that cannot be used."""
        if (self.generator is None) == (self.mesh is None):
            raise complaint("needs a mesh: give target.generator or target.mesh, one of them")
        if self.generator is not None:
            return self.generator
        if self.mesh_unit is None:
            raise complaint(f"has no mesh_unit: say in which unit {self.mesh} is, one of {', '.join(METRES)}")
        assert self.mesh is not None
        try:
            return MeshFile(self.mesh, self.mesh_unit, self.origin, self.struck)
        except UserError as error:
            raise complaint(f"has a mesh that cannot be used: {'; '.join(error.errors)}") from error

    @property
    def struck_name(self) -> str:
        """Name of the part that the bird is aimed at."""
        return self.source.struck

    @property
    def struck_part(self) -> Part:
        """That part."""
        return self.parts[self.struck_name]

    @property
    def content(self) -> dict[str, Any]:
        """What changes a history, SI: of a mesh from a file its content, not its name."""
        tree = self.model_dump(mode="json")
        if self.mesh is not None:
            tree["mesh"] = digest(self.source.mesh())
            del tree["mesh_unit"], tree["origin"]
        return tree

    def lacks(self, key: str) -> str:
        """Why the struck part has no such property of a plate; empty where it has."""
        material = self.materials[self.struck_part.material]
        if key == "preload":
            return "a target of several parts takes no preload"
        has = key in type(material).model_fields or (key == "yield_stress" and "a" in type(material).model_fields)
        return "" if has else f'materials.{self.struck_part.material} is of law = "{material.law}", which has no {key}'

    def changed(self, changes: Mapping[str, Any]) -> dict[str, Any]:
        """Changes of a case in which those of the plate act on the struck part, its material and all supports."""
        plate = changes.get("plate")
        if plate is None:
            return dict(changes)
        target: dict[str, Any] = {key: plate[key] for key in ("damping",) if key in plate}
        if "thickness" in plate:
            target["parts"] = {self.struck_name: {"thickness": plate["thickness"]}}
        if "edges" in plate:
            target["supports"] = dict.fromkeys(self.supports, plate["edges"])
        if "material" in plate:
            known = type(self.materials[self.struck_part.material]).model_fields
            own = {key if key in known else "a": value for key, value in plate["material"].items()}
            target["materials"] = {self.struck_part.material: own}
        return {key: value for key, value in changes.items() if key != "plate"} | {"target": target}


def with_envelope(table: Mapping[str, Any]) -> Mapping[str, Any]:
    """A case's table with the plate that stands for its target where only the size of what is struck is asked for.

    Its length and width are the target's, thickness and metal those of the part that the bird is aimed at.
    """
    if "target" not in table or "plate" in table:
        return table
    try:
        return {**table, "plate": envelope(Target.model_validate(table["target"]))}
    except ValidationError:  # the case's own validation says what is wrong
        return {**table, "plate": PLACEHOLDER}


SHARED = {"tangent_modulus": "Pa", "rate_c": "1/s", "rate_p": "", "failure_strain": ""}
PLACEHOLDER = {"length": "1 m", "width": "1 m", "thickness": "1 mm", "elements": [2, 2], "rigid": True}


def envelope(target: Target) -> dict[str, Any]:
    """The plate that stands for a target, as a case's table has it."""
    generator, struck = target.source, target.struck_part
    material = target.materials[struck.material]
    plate: dict[str, Any] = {
        "length": quantity_text(generator.length, "m"),
        "width": quantity_text(generator.width, "m"),
        "thickness": quantity_text(struck.thickness, "m"),
        "elements": [
            min(max(round(side / generator.element_size), 2), 400) for side in (generator.length, generator.width)
        ],
    }
    if not isinstance(material, Metal):
        return plate | {"rigid": True}
    metal = {
        "young": quantity_text(material.young, "Pa"),
        "poisson": material.poisson,
        "density": quantity_text(material.density, "kg/m^3"),
        "yield_stress": quantity_text(material.first_yield, "Pa"),
    }
    for key, unit in SHARED.items():
        value = getattr(material, key, None)
        if value is not None:
            metal[key] = quantity_text(value, unit) if unit else value
    held = next(iter(target.supports.values()), "free")
    edges = held if isinstance(held, str) else {key: text for key, text in springs_text(held) if text is not None}
    return plate | {"edges": edges, "material": metal}


def springs_text(springs: EdgeSprings) -> Iterator[tuple[str, str | None]]:
    """Springs as a case's table has them."""
    for key, unit in (("rotational", "N m/rad/m"), ("in_plane", "Pa"), ("transverse", "Pa")):
        value = getattr(springs, key)
        yield key, None if value is None else quantity_text(value, unit)
