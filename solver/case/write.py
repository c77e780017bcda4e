"""A copy of a case as one TOML file that stands alone, what it extended and every --set written in."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from birdstrike.data.files import whole_file, write_atomically
from birdstrike.solver.case.case import Case

DECK = "deck"


def copy_case(case: Case, folder: Path) -> None:
    """Write `case.toml` into the folder, and beside it the files that an external solver's deck is made of."""
    raw = case._raw
    if case.external is not None:
        names = [f"{DECK}/{path.name}" for path in case.external.inputs]
        for path, name in zip(case.external.inputs, names, strict=True):
            if path != (folder / name).resolve():
                with whole_file(folder / name) as temporary:
                    shutil.copyfile(path, temporary)
        raw = raw | {"external": raw["external"] | {"template": names[0], "files": names[1:]}}
    write_atomically(folder / "case.toml", case_toml(case, raw))


def case_toml(case: Case, raw: Mapping[str, Any] | None = None) -> str:
    """TOML text that `load_case` reads back to the same case; raw: its table, where paths in it differ."""
    head = f"# {case.name}, with everything that it extends and every override written in."
    return "\n".join([head, *_table(raw or case._raw, ())]) + "\n"


def _table(table: Mapping[str, Any], place: tuple[str, ...]) -> Iterator[str]:
    """Lines of a table: its values first, then the tables in it."""
    values = {key: value for key, value in table.items() if not isinstance(value, Mapping)}
    if place and (values or not table):
        yield f"\n[{'.'.join(map(_key, place))}]"
    for key, value in values.items():
        yield f"{_key(key)} = {_value(value)}"
    for key, value in table.items():
        if isinstance(value, Mapping):
            yield from _table(value, (*place, key))


def _key(key: str) -> str:
    return key if re.fullmatch(r"[A-Za-z0-9_-]+", key) else json.dumps(key, ensure_ascii=False)


def _value(value: Any) -> str:
    """A TOML value; texts, numbers and lists are written as in JSON, which TOML shares."""
    if isinstance(value, list):
        return f"[{', '.join(map(_value, value))}]"
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{_key(key)} = {_value(entry)}" for key, entry in value.items()) + "}"
    return json.dumps(value, ensure_ascii=False)
