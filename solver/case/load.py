"""Reading case files: TOML, `extends`, and overrides, merged into one table of what the user wrote."""

from __future__ import annotations

import json
import math
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from birdstrike.data.csv_table import read_table
from birdstrike.data.errors import CaseError, MeasuredError, UserError
from birdstrike.data.paths import resolve_case
from birdstrike.data.units import quantity_text
from birdstrike.solver.case.external import with_deck
from birdstrike.solver.case.overlay import CHOOSING, Raw, overlay


def read_case(name: str | Path) -> Raw:
    """The table of a case file over those that it extends; raises CaseError (TOML with its line, a circle, no file)."""
    path = _find(name)
    return _read(path, (path,))


def _find(name: str | Path, beside: Path | None = None, asked_by: str = "") -> Path:
    try:
        return resolve_case(name, beside)
    except UserError as error:
        raise CaseError(f"{asked_by}{line}" for line in error.errors) from error


def _read(path: Path, chain: tuple[Path, ...]) -> Raw:
    raw = with_baselines(with_deck(with_table(_parse(path), path.parent), path.parent), path.parent)
    parent = raw.pop("extends", None)
    if parent is None:
        return raw
    if not isinstance(parent, str):
        raise CaseError(f'{path}: extends = {parent} must be the name of one case, such as "reference_strike"')
    source = _find(parent, path.parent, f"{path}: extends: ")
    if source in chain:
        circle = " -> ".join(step.name for step in (*chain, source))
        raise CaseError(f'{path}: extends = "{parent}" closes a circle: {circle}; let one of them stand alone')
    return overlay(_read(source, (*chain, source)), raw)


def _parse(path: Path) -> Raw:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except tomllib.TOMLDecodeError as error:
        raise CaseError(f"{path}: not TOML: {error}") from error
    except (OSError, UnicodeDecodeError) as error:
        raise CaseError(f"{path} cannot be read: {error}") from error


def override_table(overrides: Mapping[str, str]) -> Raw:
    """Table of dotted keys and texts as `--set` gives them: {"plate.thickness": "8 mm"}; raises CaseError."""
    table: Raw = {}
    first = sorted(overrides, key=lambda key: not key.startswith(CHOOSING))  # they say what replaces what
    single = {key: _one_override(key, overrides[key]) for key in first}
    for one in single.values():
        table = overlay(table, one)
    lost = [key for key, one in single.items() if overlay(table, one) != table]
    if lost:
        raise CaseError(f"--set {key} is undone by another --set; keep one of them" for key in lost)
    return table


def _one_override(key: str, text: str) -> Raw:
    """TOML's own reading of the text where it has one (numbers, lists, true), otherwise the text itself."""
    lines = [f"{key} = {text}"] if "\n" not in text else []
    for line in [*lines, f"{key} = {json.dumps(text, ensure_ascii=False)}"]:
        try:
            return tomllib.loads(line)
        except tomllib.TOMLDecodeError:
            continue
    raise CaseError(f'"{key}" is not a dotted case key; write --set plate.thickness="8 mm"')


def with_baselines(raw: Raw, folder: Path) -> Raw:
    """The case's table with whole paths in `diagnosis.baselines`; the names of shipped curves stay as they are."""
    section = raw.get("diagnosis")
    names = section.get("baselines") if isinstance(section, dict) else None
    if not isinstance(section, dict) or not isinstance(names, list):
        return raw
    return raw | {"diagnosis": {**section, "baselines": [_whole_path(name, folder) for name in names]}}


def _whole_path(name: Any, folder: Path) -> Any:
    """A path from the case's folder; what is no text, or no file there, is left for others to judge."""
    path = folder / Path(name).expanduser() if isinstance(name, str) else None
    return str(path.resolve()) if path is not None and path.is_file() else name


COLUMNS = 'its columns are "rho [kg/m^3],p [MPa]" or "mu,p [MPa]"'
UNITS = {"rho": "kg/m^3", "mu": "", "p": "Pa"}


def with_table(raw: Raw, folder: Path) -> Raw:
    """The case's table with the points of `bird.material.eos.file` in its place; raises CaseError.

    folder: that of the file in which the case stands; a path is relative to it.
    """
    eos: Any = raw
    for name in ("bird", "material", "eos"):
        eos = eos.get(name) if isinstance(eos, dict) else None
    if not isinstance(eos, dict) or "file" not in eos:
        return raw
    material = raw["bird"]["material"]
    content = {key: value for key, value in eos.items() if key != "file"} | read_points(folder, eos["file"])
    return raw | {"bird": raw["bird"] | {"material": material | {"eos": content}}}


def read_points(folder: Path, name: Any) -> dict[str, list[str] | list[float]]:
    """Columns of the CSV as the case's own lists of texts and numbers."""
    if not isinstance(name, str):
        raise CaseError(f"bird.material.eos.file = {name} must be the name of a CSV file; {COLUMNS}")
    if not (folder / Path(name).expanduser()).is_file():
        raise CaseError(
            f'bird.material.eos.file = {name}: no such file in "{folder}"; a path is relative to the folder of the '
            "case file that names it, with --set to the one you are in"
        )
    try:
        table = read_table(folder / Path(name).expanduser())
    except MeasuredError as error:
        raise CaseError(f"bird.material.eos.file: {line}" for line in error.errors) from error
    found = {column.name: column for column in table.columns}
    if set(found) not in ({"rho", "p"}, {"mu", "p"}) or any(c.unit != UNITS[n] for n, c in found.items()):
        raise CaseError(f"bird.material.eos.file = {name}: {COLUMNS}")
    gaps = [line for c in table.columns for line, value in zip(c.lines, c.values, strict=True) if math.isnan(value)]
    if gaps:
        raise CaseError(
            f"bird.material.eos.file = {name}, line {gaps[0]}: an empty cell; every point needs both numbers"
        )
    return {name: _texts(column.values, UNITS[name]) for name, column in found.items()}


def _texts(values: Any, unit: str) -> list[str] | list[float]:
    numbers = [float(value) for value in values]
    return [quantity_text(value, unit) for value in numbers] if unit else numbers
