"""What a case says of a target of several parts; after validation every value is SI."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any

import numpy as np
from pydantic import Field, ValidationError, model_validator
from pydantic_core import InitErrorDetails

from birdstrike.data.errors import CaseError, UserError
from birdstrike.data.nearest import did_you_mean
from birdstrike.data.units import quantity_text
from birdstrike.solver.case.plate import EDGE_WORDS, EdgeSprings
from birdstrike.solver.fields import Between, OneOf, Section, WordOr, complaint
from birdstrike.solver.kernels.target import metal
from birdstrike.solver.registry import errors_of
from birdstrike.solver.target.files.mesh_file import METRES, MeshFile, digest
from birdstrike.solver.target.files.mesh_quality import Finding, slow_shells
from birdstrike.solver.target.generators.interface import Generator, Length
from birdstrike.solver.target.generators.registry import GENERATORS
from birdstrike.solver.target.laws.interface import Metal, TargetMaterial
from birdstrike.solver.target.laws.registry import TARGET_LAWS
from birdstrike.solver.target.links.rivets import RivetData
from birdstrike.solver.target.links.ties import TieData
from birdstrike.solver.target.part_mesh import Row

PLACE = Between("-100000 mm", "100000 mm")
Place = tuple[Annotated[float, PLACE], Annotated[float, PLACE], Annotated[float, PLACE]]
Strength = Annotated[float, Between("0.001 kN", "10000 kN")]
Stiffness = Annotated[float, Between("0.001 kN/mm", "100000 kN/mm")]
Exponent = Annotated[float, Between(0.5, 20.0)]


class Part(Section):
    """material: a name under `target.materials`."""

    thickness: Annotated[float, Between("0.1 mm", "50 mm")]
    material: str


class Tie(Section):
    """nodes: a set, whose nodes follow the part `onto` where they lie within `distance` [m] of its mid-surface."""

    nodes: str
    onto: str
    distance: Annotated[float, Between("0.001 mm", "100 mm")]

    def data(self) -> TieData:
        """As the target takes it."""
        return TieData(self.nodes, self.onto, self.distance)


class Rivets(Section):
    """A row of rivets, which breaks one by one at (N/tension_strength)^a + (S/shear_strength)^b = 1.

    exponents: a and b; springs: along the rivet and across it [N/m] and rotational [N m/rad], by default of the order
    that Huth's formula gives to 5 mm rivets in 2 mm aluminium sheets. parts, start, end [m], pitch [m]: where the row
    lies; a generator's own rows have their places already.
    """

    tension_strength: Strength
    shear_strength: Strength
    exponents: tuple[Exponent, Exponent] = (2.0, 2.0)
    tension_stiffness: Stiffness = 3e7
    shear_stiffness: Stiffness = 3e7
    rotational_stiffness: Annotated[float, Between("0 kN*m/rad", "1000 kN*m/rad")] = 100.0
    parts: tuple[str, str] | None = None
    start: Place | None = None
    end: Place | None = None
    pitch: Length | None = None

    @model_validator(mode="after")
    def _a_row_has_all_of_its_places(self) -> Rivets:
        given = [key for key in ("parts", "start", "end", "pitch") if getattr(self, key) is not None]
        if 0 < len(given) < 4:
            missing = ", ".join(key for key in ("parts", "start", "end", "pitch") if key not in given)
            raise complaint(f"has {', '.join(given)} and no {missing}; a row of your own needs all four")
        if self.parts is not None and self.parts[0] == self.parts[1]:
            raise complaint(f"has parts with {self.parts[0]} twice, a part joined to itself; name two parts")
        return self

    def row(self) -> Row | None:
        """Where it lies; None for a generator's own row."""
        if self.parts is None or self.start is None or self.end is None or self.pitch is None:
            return None
        start, end = np.array(self.start), np.array(self.end)
        count = max(round(float(np.linalg.norm(end - start)) / self.pitch), 1) + 1 if (start != end).any() else 1
        return Row(np.linspace(start, end, count), self.parts)

    def data(self) -> RivetData:
        """As the target takes it."""
        springs = (self.tension_stiffness, self.shear_stiffness, self.rotational_stiffness)
        return RivetData(*springs, self.tension_strength, self.shear_strength, self.exponents)


class TargetMesh(Section):
    """What makes the mesh of a target: a generator, or the file `mesh` in the unit of length `mesh_unit`.

    origin [m]: the point of the file's own axes on which the bird is aimed, from their z; struck: the part that it is
    aimed at.
    """

    generator: Annotated[Generator, GENERATORS] | None = None
    mesh: str | None = None
    mesh_unit: Annotated[str, OneOf(tuple(METRES))] | None = None
    origin: tuple[Annotated[float, PLACE], Annotated[float, PLACE], Annotated[float, PLACE]] = (0.0, 0.0, 0.0)
    struck: str | None = None

    @property
    def source(self) -> Generator | MeshFile:
        """What makes the mesh; raises a complaint where the case names none, or a file that cannot be used."""
        if self.generator is None and self.mesh is None:
            raise complaint("needs a mesh: give target.generator or target.mesh")
        if self.generator is not None and self.mesh is not None:
            raise complaint(
                "has two meshes, target.generator and target.mesh: leave one out; over a case that has the other, "
                "target.mesh or a target.generator with its kind replaces it"
            )
        if self.generator is not None:
            return self.generator
        if self.mesh_unit is None:
            raise complaint(f"has no mesh_unit: say in which unit {self.mesh} is, one of {', '.join(METRES)}")
        assert self.mesh is not None
        try:
            return MeshFile(self.mesh, self.mesh_unit, self.origin, self.struck)
        except UserError as error:
            raise complaint(f"has a mesh that cannot be used: {'; '.join(error.errors)}") from error


class Target(TargetMesh):
    """A target of named parts; supports: how sets of nodes are held, a word or a table of springs.

    ties, rivets: what joins parts that share no node. damping [1/s]: rate at which a free vibration's amplitude decays.
    """

    materials: dict[str, Annotated[TargetMaterial, TARGET_LAWS]]
    parts: dict[str, Part]
    supports: dict[str, Annotated[str | EdgeSprings, WordOr(EDGE_WORDS, EdgeSprings)]] = Field(default_factory=dict)
    ties: dict[str, Tie] = Field(default_factory=dict)
    rivets: dict[str, Rivets] = Field(default_factory=dict)
    damping: Annotated[float, Between("0 1/s", "1e5 1/s")] = 0.0

    @model_validator(mode="after")
    def _names_that_belong_together(self) -> Target:
        """Every part of the mesh has its thickness and a known material; every support is of a set of the mesh."""
        source = self.source
        wrong = [*self._wrong_parts(source), *self._wrong_links(source)]
        if wrong:
            raise errors_of([InitErrorDetails(type=complaint(text), loc=(), input={}) for text in wrong])
        self._check_pieces(source)
        return self

    def _wrong_parts(self, source: Generator | MeshFile) -> Iterator[str]:
        """What is wrong with the names of parts, materials and supports."""
        idle = [key for key in ("mesh_unit", "origin", "struck") if key in self.model_fields_set]
        if self.generator is not None and idle:
            yield f"has {idle[0]}, which is of a mesh from a file; leave it out beside a generator"
        known, given = source.parts, self.parts
        if source.struck not in known:
            yield f'has struck = "{source.struck}", a part that the mesh has not; its parts: {", ".join(known)}'
        for name in known:
            if name not in given:
                yield f"has no parts.{_key(name)}: give it a thickness and a material"
        for name, part in given.items():
            if name not in known:
                yield f"has parts.{_key(name)}, which the mesh has not; {_nearest(name, known)}"
            if part.material not in self.materials:
                names = ", ".join(self.materials) or "none"
                yield f'has parts.{_key(name)}.material = "{part.material}", unknown; materials: {names}'
        for name in self.supports:
            if name not in source.sets:
                yield f"has supports.{_key(name)}, a set of nodes that {_no_set(name, source)}"
            yield from self._empty(f"supports.{name}, a set", name, source)

    def _wrong_links(self, source: Generator | MeshFile) -> Iterator[str]:
        """Ties and rivets name sets and parts that the mesh has."""
        parts = ", ".join(source.parts)
        for name, tie in self.ties.items():
            if tie.nodes not in source.sets:
                yield f'has ties.{name}.nodes = "{tie.nodes}", a set that {_no_set(tie.nodes, source)}'
            yield from self._empty(f'ties.{name}.nodes = "{tie.nodes}", a set', tie.nodes, source)
            if tie.onto not in source.parts:
                yield f'has ties.{name}.onto = "{tie.onto}", a part that the mesh has not; parts: {parts}'
        yield from self._wrong_rivets(source)

    def _wrong_rivets(self, source: Generator | MeshFile) -> Iterator[str]:
        """Rows join parts that the mesh has, and those of the generator have strengths and no places of their own."""
        parts = ", ".join(source.parts)
        for name, rivets in self.rivets.items():
            for part in rivets.parts or ():
                if part not in source.parts:
                    yield f'has rivets.{name}.parts with "{part}", which the mesh has not; parts: {parts}'
            if rivets.parts is None and name not in source.rows:
                rows = ", ".join(source.rows) or "none"
                yield f"has rivets.{name} without parts, start, end and pitch; rows that the generator places: {rows}"
            if rivets.parts is not None and name in source.rows:
                yield (
                    f"has rivets.{name} with parts, start, end and pitch, and the generator places a row of that name; "
                    "leave them out, or give the row of your own another name"
                )
        for name in source.rows:
            if name not in self.rivets:
                yield f"has no rivets.{name}: give it a tension_strength and a shear_strength"

    @staticmethod
    def _empty(said: str, name: str, source: Generator | MeshFile) -> Iterator[str]:
        """A set of a mesh from a file holds nodes."""
        if isinstance(source, MeshFile) and name in source.sets and name not in source.filled:
            filled = ", ".join(source.filled) or "none"
            yield f"has {said} that holds no node of the shells; sets that hold nodes: {filled}"

    def _check_pieces(self, source: Generator | MeshFile) -> None:
        """A mesh from a file hangs together, unless something joins its pieces."""
        if isinstance(source, MeshFile) and source.pieces > 1 and not self.ties and not self.rivets:
            raise complaint(
                f"has a mesh that cannot be used: target.mesh = {source.path}: it falls into {source.pieces} pieces "
                "that share no node; merge the nodes along their joints, or give target.ties or target.rivets"
            )

    def findings(self) -> list[Finding]:
        """What is doubtful about the shells of a mesh from a file, and which of them rule the time step."""
        source = self.source
        if not isinstance(source, MeshFile):
            return []
        metals = [self.materials[self.parts[name].material] for name in source.parts]
        return [*source.findings, *slow_shells(source.mesh(), [_speed_of_sound(one) for one in metals])]

    @property
    def metals(self) -> dict[str, TargetMaterial]:
        """Material of every part by its name."""
        return {name: self.materials[part.material] for name, part in self.parts.items()}

    @property
    def holding(self) -> tuple[str, ...]:
        """Names of the supports that hold anything."""
        return tuple(name for name, held in self.supports.items() if holds(held))

    def rivet_rows(self) -> Iterator[tuple[str, Row, RivetData]]:
        """Every row of rivets with its place."""
        placed = self.source.mesh().rows
        for name, rivets in self.rivets.items():
            row = rivets.row()
            for one in placed[name] if row is None else (row,):
                yield name, one, rivets.data()

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
        tree = self.model_dump(mode="json", exclude={key for key in ("ties", "rivets") if not getattr(self, key)})
        if self.generator is not None:
            tree["generator"] = self.generator.canonical()
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

    def _of_its_law(self, constants: Mapping[str, Any]) -> dict[str, Any]:
        """Constants of a plate's metal by the names that the struck part's law has for them; raises CaseError."""
        known = type(self.materials[self.struck_part.material]).model_fields
        found = {"a" if key == "yield_stress" and key not in known else key: value for key, value in constants.items()}
        if lost := [key for key in found if key not in known]:
            raise CaseError(self.lacks(key) for key in lost)
        return found

    def changed(self, changes: Mapping[str, Any]) -> dict[str, Any]:
        """Changes of a case in which those of the plate act on the struck part, its material and all supports.

        Raises CaseError for a change of a plate that a target has no place for.
        """
        plate = changes.get("plate")
        if plate is None:
            return dict(changes)
        if lost := [key for key in plate if key not in OF_A_TARGET]:
            raise CaseError(f"plate.{key} of an effect has no place in a target" for key in lost)
        target: dict[str, Any] = {key: plate[key] for key in ("damping",) if key in plate}
        if "thickness" in plate:
            target["parts"] = {self.struck_name: {"thickness": plate["thickness"]}}
        if "edges" in plate:
            target["supports"] = dict.fromkeys(self.supports, plate["edges"])
        if "material" in plate:
            target["materials"] = {self.struck_part.material: self._of_its_law(plate["material"])}
        kept = {key: value for key, value in changes.items() if key not in ("plate", "target")}
        return kept | {"target": {**changes.get("target", {}), **target}}


OF_A_TARGET = ("damping", "thickness", "edges", "material")
"""Keys of a plate that have a place in a target."""


def parts_of_mesh(target: Any) -> tuple[str, ...] | None:
    """Parts of the mesh that a target's table as read names; None where it names none that can be made."""
    if not isinstance(target, Mapping):
        return None
    try:
        mesh = TargetMesh.model_validate({key: target[key] for key in TargetMesh.model_fields if key in target})
        return tuple(mesh.source.parts)
    except ValueError:  # the target's own validation says what is wrong
        return None


def holds(edges: Any) -> bool:
    """Whether a support, as read or validated, holds anything: it is not free, nor are all of its springs 0."""
    springs = edges.model_dump().values() if isinstance(edges, EdgeSprings) else (None,)
    return edges != "free" and any(spring is None or spring > 0.0 for spring in springs)


def unknown_part(target: Any, name: str) -> str:
    """What to say of a table under `target.parts` whose name is no part of the mesh; empty where it is one."""
    known = parts_of_mesh(target)
    return (
        ""
        if known is None or name in known
        else f"target has parts.{_key(name)}, which the mesh has not; {_nearest(name, known)}"
    )


def _no_set(name: str, source: Generator | MeshFile) -> str:
    """Why there is no such set of nodes, and which there are."""
    why = source.unread(name) if isinstance(source, MeshFile) else ""
    return f"{f'is left out: {why}' if why else 'does not exist'}; sets: {', '.join(source.sets)}"


def _key(name: str) -> str:
    """A name as a case file has it in a key: in quotes where it holds more than letters, digits, - and _."""
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else f'"{name}"'


def _nearest(name: str, known: Sequence[str]) -> str:
    """The nearest of the known parts, and all of them."""
    close = did_you_mean(name, known)
    return f"{f'{close} Its' if close else 'its'} parts: {', '.join(known)}"


def _speed_of_sound(material: TargetMaterial) -> float:
    """Of waves in the plane of a sheet [m/s]; 0 in what does not move."""
    row = material.row()
    plane = row[metal.YOUNG] / (1.0 - row[metal.POISSON] ** 2)
    return math.sqrt(plane / material.density) if material.moves else 0.0


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
LEAST_SIDE = 0.02
"""Of a plate [m]: a target that stands upright, such as a rib, has no extent of its own in plan."""
PLACEHOLDER = {"length": "1 m", "width": "1 m", "thickness": "1 mm", "elements": [2, 2], "rigid": True}


def envelope(target: Target) -> dict[str, Any]:
    """The plate that stands for a target, as a case's table has it."""
    generator, struck = target.source, target.struck_part
    material, radius = target.materials[struck.material], getattr(generator, "radius", None)
    plate: dict[str, Any] = {} if radius is None else {"radius": quantity_text(radius, "m")}
    sides = [max(side, LEAST_SIDE) for side in (generator.length, generator.width)]
    plate |= {
        "length": quantity_text(sides[0], "m"),
        "width": quantity_text(sides[1], "m"),
        "thickness": quantity_text(struck.thickness, "m"),
        "elements": [min(max(round(side / generator.element_size), 2), 400) for side in sides],
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
    edges = held if isinstance(held, str) else held.texts()
    return plate | {"edges": edges, "material": metal, "damping": quantity_text(target.damping, "1/s")}
