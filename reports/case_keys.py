"""docs/cases.md: every key of a case with unit, range, default and meaning, from the models that read a case.

`python -m reports.case_keys` writes it.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args

from pydantic.fields import FieldInfo

from reports import case_meanings as say
from solver.case import Case, load_case
from solver.case_bird import Bird
from solver.case_choice import sections_of
from solver.case_effects import SHOWN, shown
from solver.case_eos import LAWS
from solver.case_external import FORMATS, External, Text, UnitText
from solver.case_fields import Between, Count, Later, OneOf, Section, Switch, WordOr
from solver.case_material import MATERIALS
from solver.case_plate import EdgeSprings, Plate, PlateMaterial
from solver.case_sections import Impact, Time, is_list
from solver.case_sensors import DRIFT, NOISE, Instrument, Sensor
from solver.case_settings import NUISANCE, SolverSettings
from solver.effects import effects

PAGE = Path(__file__).resolve().parents[1] / "docs" / "cases.md"
INTRODUCTION = """# The keys of a case

Made by `python -m reports.case_keys` from the models that read a case; do not edit it by hand. A case is a TOML file.
A quantity is text with its unit (`"10 mm"`), a dimensionless one a bare number; any unit of the same dimension will
do. Keys that are not listed here are errors. `extends = "reference_strike"` starts from a shipped case, or from a file
beside this one. A key that would do nothing in a case (`bird.lattice` with hexahedra, `plate.damping` of a rigid
plate) is refused where the case itself gives it, and void where it is inherited.
"""
HEAD = "| key | unit | range | default | meaning |\n|---|---|---|---|---|"

Row = tuple[str, str, str, str, str]


def page() -> str:
    """The whole page."""
    parts = [INTRODUCTION]
    for title, rows in chapters():
        body = "\n".join("| " + " | ".join(row) + " |" for row in rows)
        parts.append(f"## {title}\n\n{HEAD}\n{body}\n")
    return "\n".join(parts)


def chapters() -> Iterator[tuple[str, list[Row]]]:
    """Title and rows of each table."""
    yield "Plate", list(rows(Plate, "plate", say.PLATE))
    yield "Plate: springs at its edges", list(rows(EdgeSprings, "plate.edges", say.PLATE))
    yield "Plate: material", list(rows(PlateMaterial, "plate.material", say.PLATE))
    yield "Bird", list(rows(Bird, "bird", say.BIRD))
    for model, section in MATERIALS.items():
        yield f'Bird: `material.model = "{model}"`', list(rows(section, "bird.material", say.NULL | say.STRENGTH))
    for kind, law in LAWS.items():
        own = {key.removeprefix(f"{kind}."): text for key, text in say.LAW.items()}
        yield f'Bird: `material.eos.kind = "{kind}"`', list(rows(law, "bird.material.eos", own))
    yield "Impact", list(rows(Impact, "impact", say.STRIKE))
    yield "Time", list(rows(Time, "time", say.STRIKE))
    yield "Sensors", list(rows(Sensor, "sensors.<name>", say.SENSORS))
    yield "Instruments", list(rows(Instrument, "instrument.<sensor>", say.SENSORS))
    yield "Solver", list(rows(SolverSettings, "solver", say.SETTINGS))
    yield "External solver", list(rows(External, "external", say.EXTERNAL))
    for kind, reading in FORMATS.items():
        yield f'External solver: `format = "{kind}"`', list(rows(reading, "external.sensors.<name>", say.EXTERNAL))
    yield "Effects", list(of_effects())
    yield "Inversion", list(inversion())
    later = [name for name, field in Case.model_fields.items() if any(isinstance(m, Later) for m in field.metadata)]
    if later:
        yield "Reserved", [(f"`{name}`", "", "", "", "Not available in this version.") for name in later]


def rows(section: type[Section], prefix: str, meanings: dict[str, str]) -> Iterator[Row]:
    """A section's own keys; those of nested tables have tables of their own."""
    for name, field in section.model_fields.items():
        nested = list(sections_of(field)) and not any(isinstance(mark, WordOr) for mark in field.metadata)
        if nested or (name in ("model", "kind") and not field.metadata):
            continue
        key = f"{prefix}.{name}"
        unit, span = of_kind(key) or described(field)
        meaning = meanings.get(key) or meanings.get(name, "")
        yield f"`{key}`", unit, span, default(field), meaning


def of_effects() -> Iterator[Row]:
    """What a case may lack, by the registry; 0 is absent, sizes are those of the reference strike."""
    case = load_case("reference_strike")
    for name, effect in effects().items():
        signs = "above 0" if effect.one_sided(case) else "both signs"
        size = f"{signs}; a plausible size is {shown(effect, effect.size(case)).lstrip('+')}"
        meaning = effect.meaning[0].upper() + effect.meaning[1:] + "."
        yield f"`effects.{name}`", SHOWN.get(effect.unit, effect.unit) or "number", size, "0", meaning


def inversion() -> Iterator[Row]:
    """Keys whose names are the user's."""
    sought = 'inversion.parameters."<key>".range'
    yield f"`{sought}`", "of the key", "within the key's own", "none", say.SETTINGS[sought]
    scale = sought.replace(".range", ".scale")
    yield f"`{scale}`", "word", '"linear", "logarithmic"', '"linear"', say.SETTINGS[scale]
    for name, mark in NUISANCE.items():
        key = f"inversion.nuisance.{name}"
        yield f"`{key}`", mark.shown, f"{mark.low} .. {mark.high}", "none", say.SETTINGS.get(key, "")


def of_kind(key: str) -> tuple[str, str] | None:
    """Unit and range of what depends on the sensor's kind."""
    marks = {"noise": NOISE, "drift": DRIFT}.get(key.rpartition(".")[2])
    if marks is None:
        return None
    return ", ".join(dict.fromkeys(mark.shown or "number" for mark in marks.values())), "by the sensor's kind"


def marks_of(field: FieldInfo) -> list[Any]:
    """Annotations of a field, of a list's entries too."""
    return [
        *field.metadata,
        *(mark for part in get_args(field.annotation) for mark in getattr(part, "__metadata__", ())),
    ]


def described(field: FieldInfo) -> tuple[str, str]:
    """Unit and range."""
    many = "list: " if is_list(field) else ""
    for mark in marks_of(field):
        if isinstance(mark, Between):
            return many + (mark.shown or "number"), f"{mark.low} .. {mark.high}"
        if isinstance(mark, Count):
            return many + "whole number", f"{mark.low} .. {mark.high}"
        if isinstance(mark, Text | UnitText):
            return f"{many}text", f"such as {mark.hint}" if isinstance(mark, Text) else "a unit"
        if isinstance(mark, OneOf):
            return "word", ", ".join(f'"{word}"' for word in mark.available)
        if isinstance(mark, WordOr):
            return "word or table", ", ".join(f'"{word}"' for word in mark.words)
        if isinstance(mark, Switch):
            return "switch", "true, false"
    return "", ""


def default(field: FieldInfo) -> str:
    """The default as a case would write it."""
    if field.is_required():
        return "required"
    value, mark = field.default, next((mark for mark in marks_of(field) if isinstance(mark, Between)), None)
    if value is None or value == ():
        return "none"
    return written(value, mark)


def written(value: Any, mark: Between | None) -> str:
    """A value in the unit of its range."""
    if isinstance(value, tuple):
        return f"[{', '.join(written(one, mark) for one in value)}]"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return f'"{value}"'
    shown = f"{value:g}" if mark is None else mark.display(value)
    return f'"{shown}"' if mark is not None and mark.unit else shown


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
