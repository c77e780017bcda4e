"""Reading case files: TOML, `extends`, and overrides, merged into one table of what the user wrote."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Mapping
from pathlib import Path

from data.errors import CaseError, UserError
from data.paths import resolve_case
from solver.case_external import with_deck
from solver.case_overlay import CHOOSING, Raw, overlay
from solver.case_table import with_table


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
    raw = with_deck(with_table(_parse(path), path.parent), path.parent)
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
