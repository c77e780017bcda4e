"""Files that are whole or absent: written beside their place, synced, then renamed."""

from __future__ import annotations

import hashlib
import json
import math
import os
import secrets
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from birdstrike.data.arguments import as_path
from birdstrike.data.errors import UserError


@contextmanager
def whole_file(path: Path, sync: bool = True) -> Iterator[Path]:
    """A temporary name in the folder of `path`; on leaving it is synced and takes the place of `path`, or vanishes.

    sync: False leaves the disk to the system's own time: a kill takes nothing, a power failure may.
    An OSError of the temporary file, or one that names none (a full disk), is raised as one of `path`.
    """
    if not path.parent.is_dir():
        path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.name}.{os.getpid()}-{secrets.token_hex(4)}.tmp")
    try:
        yield temporary
        if sync:
            _sync(temporary)
        temporary.replace(path)
        if sync:
            _sync(path.parent)
    except OSError as error:
        if error.errno is None or error.filename not in (None, str(temporary)):
            raise
        raise OSError(error.errno, error.strerror, str(path)) from error
    finally:
        if temporary.exists():
            temporary.unlink(missing_ok=True)


def _sync(path: Path) -> None:
    """Ask the system to put a file, or a folder's entries, on the disk."""
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def write_atomically(path: Path, text: str) -> None:
    """Write UTF-8 text with Unix line ends so that a reader sees the old file or the new one, never half of it."""
    with whole_file(path) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")


def write_json(path: Path, content: Mapping[str, Any], schema_version: int = 1) -> None:
    """Write a JSON object with its `schema_version` first; null stands for what is not finite."""
    whole = {"schema_version": schema_version, **content}
    write_atomically(path, json.dumps(json_values(whole), indent=2, allow_nan=False) + "\n")


def withdraw(folder: Path, *patterns: str) -> None:
    """Remove the files of an earlier result before any of them is replaced, in the order of their patterns.

    The file by which the result is known stands first, and is written last: what an interruption leaves is no result,
    rather than one beside files of another.
    """
    for pattern in patterns:
        for path in folder.glob(pattern):
            path.unlink(missing_ok=True)


def file_digest(path: Path) -> str:
    """SHA-256 of a file's content."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def file_in(place: str | Path, name: str) -> Path:
    """The file that a path names, in a folder the one of this name; raises UserError for what is no path."""
    path = as_path("path", place)
    return path / name if path.is_dir() else path


def read_json(path: Path) -> dict[str, Any]:
    """A JSON object, {} where the file does not exist; raises UserError for a damaged one."""
    if not path.exists():
        return {}
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
        if not isinstance(found, dict):
            raise ValueError("no JSON object")
        return found
    except ValueError as error:
        raise UserError(f"{path} is damaged ({error}); delete it and repeat the command that made it") from error


def json_values(value: Any) -> Any:
    """Numpy numbers and arrays, tuples and paths as JSON knows them; nan and inf as None."""
    if isinstance(value, Mapping):
        return {str(key): json_values(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple | set):
        return [json_values(entry) for entry in value]
    if hasattr(value, "tolist"):  # numpy's, which is not imported for a command that has no array
        return json_values(value.tolist())
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return str(value) if isinstance(value, Path) else value
