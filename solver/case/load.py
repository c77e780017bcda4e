"""Reading case files: TOML, `extends`, and overrides, merged into one table of what the user wrote."""

from __future__ import annotations

import math
import sys
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from birdstrike.data.errors import CaseError, MeasuredError, UserError
from birdstrike.data.paths import is_file, resolve_case
from birdstrike.data.tables.csv_table import read_table
from birdstrike.data.units import quantity_text
from birdstrike.solver.case.external import with_deck
from birdstrike.solver.case.overlay import CHOOSING, Raw, overlay, without_key

DEEPEST = 20
"""Levels of tables and lists in a case; the format itself needs 5."""
TOO_DEEP = f"tables or lists are nested more than {DEEPEST} deep; no key of a case is: see docs/cases.md for the keys"
LARGEST = 1_000_000
"""Bytes of a case file; the longest shipped one has 4000."""


def read_case(name: str | Path) -> Raw:
    """The table of a case file over those that it extends; raises CaseError (TOML with its line, a circle, no file)."""
    path = _find(name)
    return _read(path, (path,))


def given_table(table: Mapping[Any, Any]) -> Raw:
    """A table that a script gives in place of a file, over the case that it extends; paths are relative to the folder
    that one is in. Raises CaseError."""
    return _extended(toml_value(table), Path.cwd(), "the table", ())


def toml_value(value: Any, place: tuple[str, ...] = ()) -> Any:
    """A value as TOML would give it: tuples and arrays as lists, numpy's numbers as plain ones, paths as texts.

    place: where it stands, for the errors. Raises CaseError for tables and lists nested deeper than any case is, and
    for a whole number that no floating-point number holds.
    """
    if len(place) > DEEPEST:
        raise CaseError(TOO_DEEP)
    if isinstance(value, Mapping):
        wrong = [key for key in value if not isinstance(key, str)]
        if wrong:
            raise CaseError(f"{key!r} is no key of a case; a key is a text" for key in wrong)
        return {key: toml_value(entry, (*place, key)) for key, entry in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, int) and abs(value) > sys.float_info.max:
        raise CaseError(f"{'.'.join(place)} is a whole number of over 300 digits, beyond the range of every key")
    if isinstance(value, list | tuple):
        return [toml_value(entry, (*place, str(i))) for i, entry in enumerate(value)]
    return str(value) if isinstance(value, Path) else value


def _find(name: str | Path, beside: Path | None = None, asked_by: str = "") -> Path:
    try:
        return resolve_case(name, beside)
    except UserError as error:
        raise CaseError(f"{asked_by}{line}" for line in error.errors) from error


def _read(path: Path, chain: tuple[Path, ...]) -> Raw:
    return _extended(_parse(path), path.parent, str(path), chain)


def _extended(own: Raw, folder: Path, where: str, chain: tuple[Path, ...]) -> Raw:
    """A case's own table over the case that it extends. folder: of its paths; where: what holds it, in words."""
    raw = with_mesh_path(with_baselines(with_deck(with_table(own, folder), folder), folder), folder)
    parent, void = raw.pop("extends", None), raw.pop("without", [])
    if parent is None and void:
        raise CaseError(f"{where}: without = {void} takes keys of the case that this one extends, and it extends none")
    if parent is None:
        return raw
    if not isinstance(parent, str):
        raise CaseError(f'{where}: extends = {parent} must be the name of one case, such as "reference_strike"')
    source = _find(parent, folder, f"{where}: extends: ")
    if source in chain:
        circle = " -> ".join(step.name for step in (*chain, source))
        raise CaseError(f'{where}: extends = "{parent}" closes a circle: {circle}; let one of them stand alone')
    return overlay(_less(_read(source, (*chain, source)), void, f"{where}: without"), raw)


def _less(base: Raw, keys: Any, where: str) -> Raw:
    """The table without what stands under these dotted keys; raises CaseError for one that it does not have."""
    if not isinstance(keys, list) or not all(isinstance(key, str) for key in keys):
        raise CaseError(f'{where} = {keys} must be a list of dotted keys, such as ["sensors.strain_back"]')
    errors = list[str]()
    for key in keys:
        parts, table = _parts(key), base
        for part in parts[:-1]:
            table = table.get(part, {}) if isinstance(table, dict) else {}
        if not isinstance(table, dict) or not parts or parts[-1] not in table:
            there = f"; under {'.'.join(parts[:-1])} it has {', '.join(table)}" if len(parts) > 1 and table else ""
            errors.append(f'{where}: the case that is extended has no "{key}"{there}')
            continue
        base = without_key(base, parts)
    if errors:
        raise CaseError(errors)
    return base


def _parts(key: str) -> list[str]:
    """The names in a dotted key such as inversion.parameters."bird.density"; none where it is no such key."""
    try:
        place: Any = {} if "\n" in key else tomllib.loads(f"{key} = 0")
    except (ValueError, RecursionError):
        place = {}
    found = list[str]()
    while isinstance(place, dict) and place:
        ((name, place),) = place.items()
        found.append(name)
    return found


def _parse(path: Path) -> Raw:
    try:
        size = path.stat().st_size
        if size > LARGEST:
            raise CaseError(
                f"the file has {1e-6 * size:.3g} MB, more than the {1e-6 * LARGEST:g} MB of any case: the wrong file? "
                "A long table of an equation of state stands in a CSV, bird.material.eos.file"
            )
        return toml_value(tomllib.loads(path.read_text(encoding="utf-8-sig")))
    except tomllib.TOMLDecodeError as error:
        raise CaseError(f"{path}: not TOML: {error}") from error
    except (RecursionError, CaseError) as error:
        raise CaseError(f"{path}: {line}" for line in getattr(error, "errors", [TOO_DEEP])) from error
    except (OSError, ValueError) as error:
        raise CaseError(f"{path} cannot be read: {error}") from error


def override_table(overrides: Mapping[str, Any]) -> Raw:
    """Table of dotted keys and values: texts as `--set` gives them, {"plate.thickness": "8 mm"}, numbers, lists.

    Raises CaseError.
    """
    if not isinstance(overrides, Mapping):
        raise CaseError(f'overrides are a table such as {{"plate.thickness": "8 mm"}}, not {overrides!r}')
    wrong = [key for key in overrides if not isinstance(key, str)]
    if wrong:
        raise CaseError(f'{key!r} is not a dotted case key; write {{"plate.thickness": "8 mm"}}' for key in wrong)
    table: Raw = {}
    first = sorted(overrides, key=lambda key: not key.startswith(CHOOSING))  # they say what replaces what
    single = {key: _one_override(key, overrides[key]) for key in first}
    for one in single.values():
        table = overlay(table, one)
    lost = [key for key, one in single.items() if overlay(table, one) != table]
    if lost:
        raise CaseError(f"--set {key} is undone by another --set; keep one of them" for key in lost)
    return table


def _one_override(key: str, value: Any) -> Raw:
    """Of a text TOML's own reading where it has one (numbers, lists, true), else the text; other values as such."""
    parts = _parts(key)
    if not parts:
        raise CaseError(f'"{key}" is not a dotted case key; write --set plate.thickness="8 mm"')
    found = _reading(value) if isinstance(value, str) else value
    for part in reversed(parts):
        found = {part: found}
    return toml_value(found)


def _reading(text: str) -> Any:
    """TOML's reading of a value's text on one line, or the text itself."""
    if "\n" in text:
        return text
    try:
        read = tomllib.loads(f"value = {text}")
    except ValueError:  # not TOML, or a number of too many digits
        return text
    except RecursionError as error:
        raise CaseError(TOO_DEEP) from error
    return read["value"]


def with_baselines(raw: Raw, folder: Path) -> Raw:
    """The case's table with whole paths in `diagnosis.baselines`; the names of shipped curves stay as they are."""
    section = raw.get("diagnosis")
    names = section.get("baselines") if isinstance(section, dict) else None
    if not isinstance(section, dict) or not isinstance(names, list):
        return raw
    return raw | {"diagnosis": {**section, "baselines": [_whole_path(name, folder) for name in names]}}


def with_mesh_path(raw: Raw, folder: Path) -> Raw:
    """The case's table with a whole path in `target.mesh`."""
    target = raw.get("target")
    if not isinstance(target, dict) or "mesh" not in target:
        return raw
    return raw | {"target": {**target, "mesh": _whole_path(target["mesh"], folder)}}


def _whole_path(name: Any, folder: Path) -> Any:
    """A path from the case's folder; what is no text, or no file there, is left to other checks."""
    path = folder / Path(name).expanduser() if isinstance(name, str) else None
    return str(path.resolve()) if path is not None and is_file(path) else name


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
    if not is_file(folder / Path(name).expanduser()):
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
