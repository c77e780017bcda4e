"""Nested tables with arrays in them, as one npz file without pickles: reading one cannot run anything."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from birdstrike.data.storage.files import json_values, whole_file

ARRAY = "@array"
"""Key of the table that stands for an array: {"@array": number}."""


def save_tree(path: Path, tree: Mapping[str, Any]) -> None:
    """Write tables, lists, texts, numbers and arrays; what is no array must be JSON."""
    arrays: list[np.ndarray] = []
    text = json.dumps(json_values(without_arrays(tree, arrays)), allow_nan=False)
    numbered: dict[str, Any] = {f"array_{i}": array for i, array in enumerate(arrays)}
    with whole_file(path) as temporary, temporary.open("wb") as file:
        np.savez_compressed(file, tree=np.array(text), **numbered)


def without_arrays(value: Any, arrays: list[np.ndarray]) -> Any:
    """The value with every array replaced by its number in `arrays`, to which it is added."""
    if isinstance(value, np.ndarray):
        arrays.append(value)
        return {ARRAY: len(arrays) - 1}
    if isinstance(value, Mapping):
        return {str(key): without_arrays(entry, arrays) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [without_arrays(entry, arrays) for entry in value]
    return value


def load_tree(path: Path) -> dict[str, Any]:
    """What `save_tree` wrote."""
    with np.load(path) as file:
        return _with_arrays(json.loads(str(file["tree"])), file)


def _with_arrays(value: Any, file: Mapping[str, np.ndarray]) -> Any:
    if isinstance(value, dict):
        if value.keys() == {ARRAY}:
            return file[f"array_{value[ARRAY]}"]
        return {key: _with_arrays(entry, file) for key, entry in value.items()}
    return [_with_arrays(entry, file) for entry in value] if isinstance(value, list) else value
