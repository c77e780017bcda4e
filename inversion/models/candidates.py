"""Bird models by name, and a case with one of them in place of its own: constants, and ranges in which they are sought.

A name is MODEL or MODEL+LAW, with any registered material and equation of state; LAW alone means null+LAW.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from copy import deepcopy
from dataclasses import dataclass
from itertools import product
from typing import Any

from birdstrike.data.errors import CaseError, UserError
from birdstrike.data.formatting import plain, quantity
from birdstrike.solver.bird.eos.interface import Sought
from birdstrike.solver.bird.eos.registry import EQUATIONS_OF_STATE
from birdstrike.solver.bird.materials.interface import BirdMaterial, Material
from birdstrike.solver.bird.materials.registry import BIRD_MATERIALS
from birdstrike.solver.bird.model_names import known_models, material_and_law, table_of, usual_law
from birdstrike.solver.case.case import Case, Parameter, case_from_table
from birdstrike.solver.case.overlay import Raw, at
from birdstrike.solver.case.sections import quantity_at
from birdstrike.solver.case.settings import DENSITY

PREFIX = "bird.material."
MOST_ENDS = 10
"""Constants of which every combination of the ranges' ends is tried: 1024 of ten, 2 to 10 ms each."""


@dataclass(frozen=True)
class Candidate:
    """A bird model that takes part. name: as the user wrote it; law: of its equation of state, "" for the usual one."""

    name: str
    model: str
    law: str = ""

    @property
    def material(self) -> type[BirdMaterial]:
        """Class of its table."""
        return BIRD_MATERIALS[self.model]

    @property
    def literature(self) -> Raw:
        """Published constants, as a case writes them; empty where none are declared."""
        table: Raw = deepcopy(dict(self.material.literature))
        if self.law:
            table["eos"] = deepcopy(dict(EQUATIONS_OF_STATE[self.law].literature))
        return {"model": self.model, **table} if table and (not self.law or table["eos"]) else {}

    @property
    def eos_kind(self) -> str:
        """Its equation of state, the usual one where the name says none; "" of a model without."""
        return self.law or usual_law(self.model)

    @property
    def source(self) -> str:
        """Where the published constants stand."""
        own = [self.material.source, EQUATIONS_OF_STATE[self.law].source if self.law else ""]
        return "; ".join(text for text in own if text)

    @property
    def ranges(self) -> Raw:
        """Dotted case key -> range, as a case writes it, of what is sought where the case names nothing."""
        usual = usual_law(self.model)
        own = {k: v for k, v in self.material.sought.items() if not k.startswith("eos.") or self.law in ("", usual)}
        if self.law:
            own |= {f"eos.{key}": sought for key, sought in EQUATIONS_OF_STATE[self.law].sought.items()}
        return {PREFIX + key: _written(sought) for key, sought in own.items()}

    def is_named(self, name: str) -> bool:
        """Whether a name, perhaps an alias such as null+murnaghan for murnaghan, is of this model."""
        return table_of(name) == table_of(self.name)

    def same_as(self, material: Any) -> bool:
        """Whether a case's table of the material is of this model."""
        return at(material, "model") == self.model and (at(material, "eos.kind") or "") == self.eos_kind


def candidates(names: Sequence[str]) -> tuple[Candidate, ...]:
    """The models of a list; raises UserError with every name that is unknown or stands there twice."""
    found, errors = [], list[str]()
    for name in names:
        try:
            found.append(candidate(name))
        except UserError as error:
            errors += error.errors
    twice = sorted({c.name for c in found if [(o.model, o.eos_kind) for o in found].count((c.model, c.eos_kind)) > 1})
    if twice:
        what = f"{' and '.join(twice)}, which are one model" if len(twice) > 1 else f"{twice[0]} more than once"
        errors.append(f"--models names {what}: name it once")
    if not names:
        errors.append(f"--models is empty: name one or more of {known_models()}")
    if errors:
        raise UserError(errors)
    return tuple(found)


def candidate(name: str) -> Candidate:
    """The model of a name; raises UserError."""
    try:
        model, law = material_and_law(name)
    except ValueError as error:
        raise UserError(f'--models: "{name}" {error}') from error
    return Candidate(name, model, law)


def calibrated_case(chosen: Candidate, base: Case) -> Case:
    """The case with the model in place of its own, seeking the model's constants; raises UserError or CaseError.

    Constants that are not sought are the case's where it has this model, else the published ones. The ranges are those
    of `inversion.models` under a name of the model, else those of `inversion.parameters` where the case has this model,
    else the ones that the model declares. What else the case seeks stays.
    """
    own = base.table["bird"]["material"]
    same = chosen.same_as(own)
    constants = {**chosen.literature, **(own if same else {})}
    stated = base.table.get("inversion") or {}
    of_bird = {key: entry for key, entry in stated.get("parameters", {}).items() if key.startswith(PREFIX)}
    of_model = {name: entries for name, entries in stated.get("models", {}).items() if chosen.is_named(name)}
    if len(of_model) > 1:
        named = " and ".join(f"inversion.models.{name}" for name in of_model)
        raise UserError(f"--models {chosen.name}: {named} are of one model: state its ranges under one of the names")
    ranges = next(iter(of_model.values()), None) or (of_bird if same else None) or chosen.ranges
    if not constants or not ranges:
        missing = "constants" if not constants else "ranges"
        raise UserError(
            f"--models: {chosen.name} declares no {missing}: give a case whose bird.material is this model, with "
            f'inversion.models."{chosen.name}"."bird.material.KEY" = {{ range = [LOW, HIGH] }} for what is sought'
        )
    table = _table_with(base, constants)
    table["inversion"]["parameters"] |= ranges
    try:
        return case_from_table(table, f"{base.name} with {chosen.name}")
    except CaseError as error:
        raise CaseError([f"--models {chosen.name}: {line}" for line in error.errors], error.heading) from error


def literature_case(chosen: Candidate, base: Case) -> Case | None:
    """The case with the published constants of the model; None where none are declared."""
    if not chosen.literature:
        return None
    return with_material(base, chosen.literature, f"{base.name} with {chosen.name}")


def with_material(base: Case, material: Raw, name: str = "") -> Case:
    """The case with another bird material, which seeks nothing of the bird's; raises CaseError."""
    return case_from_table(_table_with(base, material), name or base.name)


def _table_with(base: Case, material: Raw) -> Raw:
    """A case's table with another bird material: what it seeks of the bird's goes, what else it seeks stays."""
    table = base.table
    inversion = {key: entry for key, entry in (table.get("inversion") or {}).items() if key != "models"}
    inversion["parameters"] = {k: v for k, v in inversion.get("parameters", {}).items() if not k.startswith(PREFIX)}
    return {**table, "bird": {**table["bird"], "material": material}, "inversion": inversion}


def literature_values(chosen: Candidate, base: Case, names: Iterable[str]) -> dict[str, float]:
    """Published values of these dotted keys, SI; those that the model does not declare are left out."""
    case = literature_case(chosen, base)
    if case is None:
        return {}
    values = {name: _value(case, name) for name in names}
    return {name: value for name, value in values.items() if value is not None}


def _value(case: Case, key: str) -> float | None:
    """SI value under a dotted key of a case; None where there is none."""
    place: object = case
    for part in key.split("."):
        place = getattr(place, part, None)
    return float(place) if isinstance(place, int | float) else None


def kept_constants(chosen: Candidate, cases: Sequence[Case]) -> tuple[str, ...]:
    """A warning where the cases with a model do not seek every constant that it declares: who compares models would
    take this one to be as free as the others."""
    sought = [key for key in cases[0].inversion.parameters if key.startswith(PREFIX) or key == DENSITY]
    kept = [key for key in chosen.ranges if key not in sought]
    if not kept:
        return ()
    names = {key: plain(key, [*sought, *kept]) for key in (*sought, *kept)}
    shown = " and ".join(f"{names[key]} stays at {_values(cases, key)}" for key in kept)
    return (
        f"the case states what is sought of this model ({', '.join(names[key] for key in sought)}): "
        f"{shown}, so that it has fewer free constants than models without such a statement; give the range of what is "
        f"not known too: inversion.models.{chosen.name}",
    )


def _values(cases: Sequence[Case], key: str) -> str:
    """The values of a constant in the cases, each once."""
    mark = quantity_at(key)
    values = [_value(case, key) for case in cases]
    unit = mark.unit if mark is not None else ""
    return " and ".join(dict.fromkeys("no value" if v is None else quantity(v, unit) for v in values))


def built(case: Case, values: Mapping[str, float]) -> Material:
    """The substance of a case's bird at SI values under dotted keys, at the density that they give it.

    Raises CaseError.
    """
    bird = case.with_values(values).bird
    return bird.material.build(bird.actual_density)


def modulus_of(case: Case) -> tuple[str, tuple[str, ...]]:
    """The bulk modulus in the symbols of the case's model, and the dotted keys that the case seeks and that change it.

    Density counts where the formula has rho0, whatever gives it: the case, the bird's mass and size, or the law.
    """
    material, sought = case.bird.material, case.parameters()
    formula = material.modulus if material.law is None else material.law.modulus
    middle = {one.name: 0.5 * (one.low + one.high) for one in sought}
    ends = {one.name: bulk_moduli(case, [middle | {one.name: v} for v in (one.low, one.high)]) for one in sought}
    return formula, tuple(key for key, moduli in ends.items() if len(moduli) == 2 and not math.isclose(*moduli))


def bulk_moduli(case: Case, points: Iterable[Mapping[str, float]]) -> list[float]:
    """Bulk modulus [Pa] at SI values under dotted keys, each with its density; points that the case refuses have
    none."""
    found: list[float] = []
    for values in points:
        with suppress(CaseError):
            found.append(built(case, values).bulk_modulus)
    return found


def _written(sought: Sought) -> Raw:
    return {"range": [sought.low, sought.high], "scale": sought.scale}


def refuse_other_parameters(chosen: Candidate, cases: Sequence[Case]) -> None:
    """Raises UserError where the shots' cases with a model seek different constants, ranges, or another order."""
    listed = [{p.name: p for p in case.parameters()} for case in cases]
    for case, own in zip(cases[1:], listed[1:], strict=True):
        first = listed[0]
        if (key := next((key for key in (*first, *own) if first.get(key) != own.get(key)), None)) is not None:
            here, there = (_sought(found.get(key)) for found in (first, own))
            raise UserError(
                f"--models {chosen.name}: {key} is {here} in {cases[0].name}, {there} in {case.name}; state the same "
                f"inversion.parameters and inversion.models.{chosen.name} in the case of every shot"
            )
        if list(own) != list(first):
            raise UserError(
                f"--models {chosen.name}: {cases[0].name} and {case.name} seek the same in another order "
                f"({', '.join(first)}; {', '.join(own)}); state it alike in the case of every shot"
            )


def refuse_invalid_corners(chosen: Candidate, case: Case) -> None:
    """Raises CaseError where ends of the ranges of a case with a model together break a rule between keys.

    Of more than MOST_ENDS constants only the design's runs are tried (`campaigns`).
    """
    sought = case.parameters()
    if len(sought) <= MOST_ENDS:
        names = [one.name for one in sought]
        corners = product(*((one.low, one.high) for one in sought))
        refuse_invalid(chosen, case, (dict(zip(names, corner, strict=True)) for corner in corners))


def refuse_invalid(chosen: Candidate, case: Case, points: Iterable[Mapping[str, float]]) -> None:
    """Raises CaseError at the first point, SI values by dotted key, that a case with a model refuses."""
    units = {one.name: one.unit for one in case.parameters()}
    for values in points:
        try:
            case.with_values(values)
        except CaseError as error:
            where = ", ".join(f"{plain(key, values)} {quantity(value, units[key])}" for key, value in values.items())
            remedy = f"narrow inversion.models.{chosen.name} so that all values in the ranges go together"
            lines = [f"--models {chosen.name}: {line} ({where}, inside the ranges); {remedy}" for line in error.errors]
            raise CaseError(lines) from error


def _sought(parameter: Parameter | None) -> str:
    """How a case seeks a constant, in words."""
    return "not sought" if parameter is None else f"sought in {parameter.words}"
