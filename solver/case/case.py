"""A case: everything that defines one simulation, its sensors and instruments, and what an inversion may vary."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterator, Mapping
from copy import deepcopy
from dataclasses import dataclass
from numbers import Real
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, PrivateAttr, ValidationError, field_validator

from birdstrike.data.arguments import as_path
from birdstrike.data.errors import CaseError, UserError
from birdstrike.data.formatting import many, quantity, span
from birdstrike.data.units import quantity_text
from birdstrike.solver.bird.eos.registry import EQUATIONS_OF_STATE
from birdstrike.solver.bird.materials.registry import BIRD_MATERIALS
from birdstrike.solver.case.bird import Bird
from birdstrike.solver.case.effects import Effects, magnitude_text, with_effects
from birdstrike.solver.case.external import External, broken_external_rules, with_deck
from birdstrike.solver.case.load import (
    given_table,
    override_table,
    read_case,
    with_baselines,
    with_mesh_path,
    with_table,
)
from birdstrike.solver.case.messages import error_lines
from birdstrike.solver.case.nuisances import beyond_their_ranges
from birdstrike.solver.case.overlay import Raw, at, overlay
from birdstrike.solver.case.plate import Plate
from birdstrike.solver.case.rules import broken_rules, broken_sensor_rules
from birdstrike.solver.case.sections import Impact, Time, quantity_at
from birdstrike.solver.case.settings import DiagnosisSettings, InversionSettings, Prior, SolverSettings
from birdstrike.solver.case.struck import Plane, direction_of, meets_edge, struck_plane
from birdstrike.solver.case.target import Target, holds, parts_of_mesh, with_envelope
from birdstrike.solver.case.write import copy_case
from birdstrike.solver.effects.effect import SECTIONS
from birdstrike.solver.effects.registry import EFFECTS, effect_named, kind_of
from birdstrike.solver.fields import Section
from birdstrike.solver.sensors.instrument import Instrument
from birdstrike.solver.sensors.registry import DEFAULT_SENSORS, SENSORS
from birdstrike.solver.sensors.sensor import Sensor, TargetNames


@dataclass(frozen=True)
class Parameter:
    """A parameter that an inversion seeks: dotted case key, limits in SI, SI unit, scale of its designs, prior."""

    name: str
    low: float
    high: float
    unit: str
    scale: str = "linear"
    prior: Prior | None = None

    @property
    def words(self) -> str:
        """Range, scale and stated prior, with the digits by which two cases may differ."""
        limits = f"{span(self.low, self.high, self.unit, 6)} ({self.scale})"
        if self.prior is None:
            return limits
        return f"{limits}, prior {quantity(self.prior.mean, self.unit, 6)} ± {quantity(self.prior.sd, self.unit, 6)}"


class Case(Section):
    """One bird strike as it is simulated, every value in SI; made by `load_case`."""

    plate: Plate
    target: Target | None = None
    bird: Bird
    impact: Impact
    time: Time
    sensors: dict[str, Annotated[Sensor, SENSORS]] = DEFAULT_SENSORS
    solver: SolverSettings = SolverSettings()
    external: External | None = None
    inversion: InversionSettings = InversionSettings()
    diagnosis: DiagnosisSettings = DiagnosisSettings()
    effects: Effects = Field(default_factory=dict)
    instrument: dict[str, Instrument] = Field(default_factory=dict)

    _raw: Raw = PrivateAttr(default_factory=dict)
    _name: str = PrivateAttr(default="case")
    _acted: Case | None = PrivateAttr(default=None)

    @field_validator("sensors", mode="after")
    @classmethod
    def _no_sensors_mean_the_default_three(cls, value: dict[str, Sensor]) -> dict[str, Sensor]:
        return value or DEFAULT_SENSORS

    @field_validator("solver", mode="before")
    @classmethod
    def _a_word_names_the_solver(cls, value: Any) -> Any:
        return {"name": value} if isinstance(value, str) else value

    @property
    def name(self) -> str:
        """Name of the file that the case was read from, without its ending."""
        return self._name

    @property
    def struck_plane(self) -> Plane | None:
        """The plane that the bird strikes, by which stand-off and normal speed count; None where it is z = 0."""
        return struck_plane(self.impact, self.target)

    @property
    def meets_edge(self) -> bool:
        """Whether the bird is aimed at the edge of shells that stand along its flight."""
        return meets_edge(self.impact, self.target)

    @property
    def normal_speed(self) -> float:
        """Component of the velocity normal to the plane that is struck [m/s]."""
        plane = self.struck_plane
        if plane is None:
            return self.impact.speed * math.sin(self.impact.angle)
        return -self.impact.speed * float(plane.normal @ direction_of(self.impact))

    @property
    def first_contact(self) -> float:
        """Time at which the stand-off has been flown [s]."""
        return self.impact.standoff / self.impact.speed

    @property
    def mesh_file(self) -> Path | None:
        """File of the target's mesh, which is simulated as it is; None of a plate or a generated target."""
        return None if self.target is None or self.target.mesh is None else Path(self.target.mesh)

    def parameters(self) -> tuple[Parameter, ...]:
        """What an inversion seeks, in the order of the file."""
        entries = ((name, one, quantity_at(name)) for name, one in self.inversion.parameters.items())
        return tuple(Parameter(name, *e.range, u.unit, e.scale, e.prior) for name, e, u in entries if u is not None)

    @property
    def priors(self) -> dict[str, Prior]:
        """What is stated of parameters beside their ranges, by dotted key."""
        return {one.name: one.prior for one in self.parameters() if one.prior is not None}

    def with_values(self, values: Mapping[str, float]) -> Case:
        """The case with SI values under dotted keys, validated anew; raises CaseError."""
        errors = [f"{key} is no quantity of a case" for key in values if quantity_at(key) is None]
        errors += [
            f"{key} = {value!r} is no number: give its value in SI; load_case(case, overrides) takes texts with units"
            for key, value in values.items()
            if not isinstance(value, Real)
        ]
        if errors:
            raise CaseError(errors)
        return self.overlaid(_table(values))

    @property
    def table(self) -> Raw:
        """The case as TOML gives it, with all that it extends and every override laid over it; a copy."""
        return deepcopy(self._raw)

    def with_sensors(self, sensors: Mapping[str, Raw]) -> Case:
        """The case with these sensors, tables as TOML gives them, beside its own; raises CaseError."""
        own = self._raw.get("sensors") or {name: {"kind": sensor.kind} for name, sensor in self.sensors.items()}
        return self.overlaid({"sensors": {**own, **sensors}})

    def overlaid(self, table: Raw) -> Case:
        """The case with a table, as TOML gives it, laid over its own, validated anew; raises CaseError."""
        return case_from_table(overlay(self._raw, table), self._name)

    def save(self, path: str | Path) -> None:
        """Write the case as one TOML file that load_case reads back to the same case, with its effects.

        The files that it names (a deck, a mesh, baselines) go into a folder beside it that is named as the file is.
        """
        place = as_path("path", path)
        if place.suffix != ".toml":
            raise CaseError(f"path = {place}: a case is a TOML file; name it so, such as {place.name or 'case'}.toml")
        copy_case(self, place.parent, place.name, f"{place.stem}/")

    def with_effects(self, magnitudes: Mapping[str, float]) -> Case:
        """The case with these magnitudes (SI) under `effects`, in place of those it states; raises CaseError."""
        stated = {name: magnitude_text(effect_named(name), value) for name, value in magnitudes.items()}
        return case_from_table(self._raw | {"effects": stated}, self._name)

    def resolved(self) -> Case:
        """The case with its effects written into the keys that they change, and no section `effects`."""
        return self if self._acted is None else self._acted

    def with_mesh(self, particles: int, elements: tuple[int, int]) -> Case:
        """The case with another bird and plate mesh, validated anew; raises CaseError.

        elements: along length and width; of a generated target those along its length set the size of all, and a mesh
        from a file stays.
        """
        plate: Raw = {"plate": {"elements": list(elements)}}
        if self.target is not None:
            plate = {}
        if self.target is not None and self.target.generator is not None:
            size = self.target.generator.length / elements[0]
            plate = {"target": {"generator": {"element_size": quantity_text(size, "m")}}}
        return self.overlaid({"bird": {"particles": particles}} | plate)

    def canonical(self) -> dict[str, Any]:
        """Nested SI values of everything that changes a history; no noise, inversion or threads.

        `sources`, where it is there, holds digests of the sources of what installed packages give to the case: a run's
        key counts them, the case's hash does not.
        """
        plain = {"bird", "impact", "time", "solver"} | ({"plate"} if self.target is None else set())
        tree = self.model_dump(mode="json", include=plain)
        if self.target is not None:
            tree["target"] = self.target.content
        del tree["solver"]["threads"]
        if self.solver.name == "embedded":
            del tree["solver"]["name"]
        for key in ("mass", "slenderness", "statistics"):
            del tree["bird"][key]
        tree["bird"]["density"] = self.bird.actual_density
        if self.target is None and not self.plate.rigid:
            del tree["plate"]["rigid"]
        if not any(self.impact.offset):
            del tree["impact"]["offset"]
        for key in ("yaw", "pitch", "point", "direction"):
            if not getattr(self.impact, key):
                del tree["impact"][key]
        tree["sensors"] = {name: sensor.canonical() for name, sensor in self.sensors.items()}
        acting = {name: own.model_dump(mode="json") for name, own in self.instrument.items() if own != Instrument()}
        if self.solver.name == "external" and self.external is not None:
            tree["external"] = self.external.canonical()
        sources = self.sources_from_outside()
        return tree | ({"instrument": acting} if acting else {}) | ({"sources": sources} if sources else {})

    def sources_from_outside(self) -> dict[str, str]:
        """Digests of the installed packages' sources of what this case uses of theirs."""
        material = self.bird.material
        laws = [] if material.law is None else [material.law.kind]
        return (
            BIRD_MATERIALS.sources([material.model])
            | EQUATIONS_OF_STATE.sources(laws)
            | SENSORS.sources(sensor.kind for sensor in self.sensors.values())
            | EFFECTS.sources({kind_of(name) for name in self.effects})
        )


CaseSource = str | Path | Mapping[str, Any] | Case
"""What a verb takes as a case: a file, a shipped case's name, a table as TOML gives it, or a loaded case."""


def load_case(path: str | Path | Mapping[str, Any], overrides: Mapping[str, Any] | None = None) -> Case:
    """Case from a TOML file, a shipped case's name or a table; raises CaseError with all errors.

    overrides: dotted key -> value, laid over it: texts as `--set` has them, numbers, lists.
    """
    table = raw_case(path, overrides)
    name = "case" if isinstance(path, Mapping) else Path(path).stem
    case = case_from_table(table, name)
    if errors := list(beyond_their_ranges(case)):
        raise CaseError(errors, f"case {name}: {many(len(errors), 'error')}")
    return case


def raw_case(path: str | Path | Mapping[str, Any], overrides: Mapping[str, Any] | None = None) -> Raw:
    """The table that `load_case` validates; raises CaseError where there is none."""
    if isinstance(path, Case):
        raise CaseError(
            f"the case {path.name} is loaded already; case.with_values({{key: SI value}}) gives a variant, or load "
            "its file with the overrides"
        )
    if not isinstance(path, str | Path | Mapping):
        raise CaseError(f"a case is a file, a shipped case's name, a table or a loaded case, not {path!r}")
    raw = given_table(path) if isinstance(path, Mapping) else read_case(path)
    table = with_table(overlay(raw, override_table(overrides or {})), Path.cwd())
    return with_mesh_path(with_baselines(with_deck(table, Path.cwd()), Path.cwd()), Path.cwd())


def as_case(case: CaseSource, overrides: Mapping[str, Any] | None = None) -> Case:
    """A loaded case as it is, anything else as `load_case` reads it; raises UserError for overrides of a loaded one."""
    if not isinstance(case, Case):
        return load_case(case, overrides)
    if overrides:
        raise UserError(
            f"settings = {dict(overrides)}: the case is loaded already; give them to load_case(case, settings), which "
            "takes a file, a shipped case's name or a table"
        )
    return case


def case_from_table(table: Raw, name: str = "case") -> Case:
    """Case from a table as TOML gives it; raises CaseError with all errors."""
    errors = [*broken_rules(table), *broken_sensor_rules(table), *broken_external_rules(table)]
    case = None
    try:
        case = Case.model_validate(with_envelope(table))
    except ValidationError as error:
        errors = error_lines(Case, error.errors(), errors, table)
    errors += list(_unknown_names_beside_errors(table) if case is None else _unknown_names(case))
    if case is None or errors:
        raise CaseError(errors, f"case {name}: {many(len(errors), 'error')}")
    if case.effects:
        case = _acted_upon(case, table, name)
    case._raw, case._name = table, name
    return case


def _unknown_names(case: Case) -> Iterator[str]:
    """One line for every part or support that a sensor names and the target has not."""
    target = case.target
    names = None if target is None else TargetNames(tuple(target.parts), target.holding)
    for name, sensor in case.sensors.items():
        yield from sensor.unknown_names(name, names)


def _unknown_names_beside_errors(table: Raw) -> Iterator[str]:
    """The same of a case with other errors, as far as its sensors and the mesh of its target can be read."""
    target, sensors = table.get("target"), table.get("sensors")
    parts, supports = parts_of_mesh(target), at(target, "supports")
    holding = [name for name, held in supports.items() if holds(held)] if isinstance(supports, dict) else []
    if not isinstance(sensors, dict) or (target is not None and parts is None):
        return
    names = None if target is None else TargetNames(parts or (), tuple(holding))
    for name, fields in sensors.items():
        try:
            sensor = SENSORS.validate(fields)
        except ValueError:  # an error of the sensor's own
            continue
        yield from sensor.unknown_names(name, names)


def _acted_upon(case: Case, table: Raw, name: str) -> Case:
    """The case with the sections that its effects change; what an inversion seeks stays as the file says.

    Raises CaseError that names the case and the effect.
    """
    try:
        acted = with_effects(case, table, lambda changed: case_from_table(changed, name))
    except CaseError as error:
        raise CaseError(error.errors, f"case {name}: {many(len(error.errors), 'error')}") from error
    changed = case.model_copy(update={section: getattr(acted, section) for section in SECTIONS})
    changed._acted = acted
    return changed


def case_hash(case: Case) -> str:
    """First 16 hex digits of the SHA-256 of the canonical case; floats by their shortest exact text.

    Like the solver's version, the sources of installed packages are no part of it: an upgrade leaves the case the same.
    """
    tree = {key: value for key, value in case.canonical().items() if key != "sources"}
    text = json.dumps(tree, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _table(values: Mapping[str, float]) -> Raw:
    """Nested table of dotted keys with SI values as texts that the case's fields accept."""
    table: Raw = {}
    for key, value in values.items():
        mark = quantity_at(key)
        content: Any = quantity_text(value, mark.unit) if mark is not None and mark.unit else float(value)
        for part in reversed(key.split(".")):
            content = {part: content}
        table = overlay(table, content)
    return table
