"""The run store: one HDF5 file per finished run, one JSON file per failed one, named by what defines the run."""

from __future__ import annotations

import hashlib
import json
import math
import time
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import fields
from pathlib import Path
from typing import Any, NamedTuple, TypeVar, cast

import h5py
import numpy as np

from birdstrike.data.histories import Histories, Snapshot
from birdstrike.data.storage.files import json_values, whole_file, write_json

T = TypeVar("T")

SCHEMA_VERSION = 1
NARROW = {"f": np.float32, "i": np.int32}
WIDE = {"f": np.float64, "i": np.int64}


class Entry(NamedTuple):
    """What stands under one name of the file: a text, an array, or nothing (a group); and its attributes."""

    value: str | np.ndarray | None
    attributes: Mapping[str, Any]


def write_run(path: Path, histories: Histories, meta: Mapping[str, Any]) -> None:
    """Write a run; snapshots are pictures and go in single precision, compressed."""
    path.write_bytes(_image(path.name, histories, meta))


def _image(name: str, histories: Histories, meta: Mapping[str, Any]) -> bytes:
    """The file's bytes, made in memory: HDF5 itself does not survive a full disk; name: no other thread's at once."""
    entries = dict(_entries(histories, meta))
    with h5py.File(name, "w", driver="core", backing_store=False) as file:
        for place, entry in entries.items():
            item = _create(file, place, entry.value)
            for key, value in entry.attributes.items():
                item.attrs[key] = value
        file.attrs["checksum"] = _checksum(entries)
        file.flush()
        return file.id.get_file_image()


def _entries(histories: Histories, meta: Mapping[str, Any]) -> Iterator[tuple[str, Entry]]:
    """Everything that the file of a run holds, by its name in the file."""
    order = json.dumps(list(histories.channels))  # HDF5 itself sorts by name
    yield "/", Entry(None, {"schema_version": SCHEMA_VERSION, "order": order})
    yield "summary", Entry(json.dumps(json_values(histories.summary)), {})
    yield "meta", Entry(json.dumps(json_values(meta)), {})
    yield "time", Entry(np.asarray(histories.time), {})
    yield "channels", Entry(None, {})
    for name, values in histories.channels.items():
        yield f"channels/{name}", Entry(np.asarray(values), {"unit": histories.units[name]})
    if histories.snapshots:
        yield "snapshots", Entry(None, {})
    for i, snapshot in enumerate(histories.snapshots):
        yield f"snapshots/{i:04d}", Entry(None, {"time": snapshot.time})
        for part in fields(Snapshot)[1:]:
            yield f"snapshots/{i:04d}/{part.name}", Entry(_cast(getattr(snapshot, part.name), NARROW), {})


def _create(file: h5py.File, name: str, value: str | np.ndarray | None) -> h5py.Group | h5py.Dataset:
    if name == "/":
        return file
    if value is None:
        return file.create_group(name)
    compressed = {"compression": "gzip", "shuffle": True} if name.startswith("snapshots/") else {}
    return file.create_dataset(name, data=value, **compressed)


def read_run(path: Path) -> Histories:
    """Read a run back; raises OSError, KeyError, ValueError or RuntimeError when the file is damaged."""
    with h5py.File(path, "r") as file:
        entries = dict(_entries_of(file))
        if file.attrs["checksum"] != _checksum(entries):
            raise ValueError("its checksum does not fit its content")
    names = json.loads(entries["/"].attributes["order"])
    columns = {name: entries[f"channels/{name}"] for name in names}
    channels = {name: _array(column) for name, column in columns.items()}
    units = {name: str(column.attributes["unit"]) for name, column in columns.items()}
    pictures = sorted(name for name in entries if name.startswith("snapshots/") and name.count("/") == 1)
    snapshots = tuple(_snapshot(entries, name) for name in pictures)
    return Histories(_array(entries["time"]), channels, units, json.loads(_text(entries["summary"])), snapshots)


def read_curves(path: Path) -> Histories:
    """Time and channels alone, unchecked: for a file that has been checked or written just now."""
    with h5py.File(path, "r") as file:
        names = json.loads(str(file.attrs["order"]))
        columns = {name: cast(h5py.Dataset, file[f"channels/{name}"]) for name in names}
        units = {name: str(column.attrs["unit"]) for name, column in columns.items()}
        return Histories(
            cast(h5py.Dataset, file["time"])[()], {name: column[()] for name, column in columns.items()}, units
        )


def read_summary(path: Path) -> dict[str, Any]:
    """A run's summary alone, without its curves and snapshots, unchecked."""
    with h5py.File(path, "r") as file:
        return json.loads(str(cast(h5py.Dataset, file["summary"]).asstr()[()]))


def read_meta(path: Path) -> dict[str, Any]:
    """What travels with a run beside its histories."""
    with h5py.File(path, "r") as file:
        return json.loads(str(cast(h5py.Dataset, file["meta"]).asstr()[()]))


def _entries_of(file: h5py.File) -> Iterator[tuple[str, Entry]]:
    """Everything that a file holds, its checksum excepted."""
    yield "/", Entry(None, {key: value for key, value in file.attrs.items() if key != "checksum"})
    names: list[str] = []
    file.visit(names.append)
    for name in names:
        item = file[name]
        value = item[()] if isinstance(item, h5py.Dataset) else None
        content = value.decode() if isinstance(value, bytes) else value
        yield name, Entry(cast("str | np.ndarray | None", content), dict(item.attrs))


def _array(entry: Entry) -> np.ndarray:
    if not isinstance(entry.value, np.ndarray):
        raise ValueError("a column holds no numbers")
    return entry.value


def _text(entry: Entry) -> str:
    if not isinstance(entry.value, str):
        raise ValueError("an entry holds no text")
    return entry.value


def _snapshot(entries: Mapping[str, Entry], place: str) -> Snapshot:
    """A picture at full precision again: narrow real arrays and node numbers, flags as they are."""
    arrays = {part.name: _cast(_array(entries[f"{place}/{part.name}"]), WIDE) for part in fields(Snapshot)[1:]}
    return Snapshot(float(entries[place].attributes["time"]), **arrays)


def _cast(values: Any, kinds: Mapping[str, Any]) -> np.ndarray:
    array = np.asarray(values)
    return array.astype(kinds.get(array.dtype.kind, array.dtype))


def _checksum(entries: Mapping[str, Entry]) -> str:
    """SHA-256 over names, attributes and bytes of everything, in the order in which HDF5 visits a file."""
    digest = hashlib.sha256()
    for name in sorted(entries, key=lambda name: [] if name == "/" else name.split("/")):
        digest.update(name.encode())
        for key in sorted(entries[name].attributes):
            digest.update(f"{key}={entries[name].attributes[key]}".encode())
        value = entries[name].value
        if value is not None:
            digest.update(value.encode() if isinstance(value, str) else np.ascontiguousarray(value).tobytes())
    return digest.hexdigest()


DAMAGE = (OSError, KeyError, ValueError, TypeError, RuntimeError)
"""What h5py raises for a file that is cut short or scrambled."""

FAILED = ".failed.json"
SYNC_EVERY_S = 1.0
"""Runs that come faster than this are not each waited for: what a power failure then damages shows by its checksum."""


def run_key(canonical: Mapping[str, Any], solver_version: str, step_factor: float = 1.0) -> str:
    """Name of a run: 32 hex digits of SHA-256 over the canonical case, the solver's version and the step factor."""
    identity = {"case": canonical, "solver": solver_version, "step_factor": float(step_factor)}
    text = json.dumps(identity, sort_keys=True, separators=(",", ":"), allow_nan=False, default=json_values)
    return hashlib.sha256(text.encode()).hexdigest()[:32]


def _left(path: Path, error: Exception) -> str:
    return f"{path} is damaged ({error}); it is left as it is and not used"


class RunStore:
    """Runs in a folder; two stores are merged by copying their files together."""

    run_key = staticmethod(run_key)

    def __init__(self, folder: str | Path) -> None:
        self.folder = Path(folder)
        self._synced = -math.inf

    def path(self, key: str) -> Path:
        """File of a finished run."""
        return self.folder / f"{key}.h5"

    def failure_path(self, key: str) -> Path:
        """File of a failed run."""
        return self.folder / f"{key}{FAILED}"

    def save(self, key: str, histories: Histories, meta: Mapping[str, Any] | None = None) -> None:
        """Write a run whole or not at all; meta: whatever else should travel with it."""
        now = time.monotonic()
        due = now - self._synced >= SYNC_EVERY_S
        with whole_file(self.path(key), sync=due) as temporary:
            write_run(temporary, histories, meta or {})
        self._synced = now if due else self._synced

    def load(self, key: str) -> Histories | None:
        """A finished run, or None; a file that is damaged is set aside as *.corrupt with a warning."""
        return self._read(key, self._set_aside, read_run)

    def look_up(self, key: str) -> Histories | None:
        """A finished run, or None; a file that is damaged stays as it is and counts as none, with a warning."""
        return self._read(key, _left, read_run)

    def curves(self, key: str) -> Histories:
        """Time and channels of a run that this process has written or loaded: its checksum is not asked again."""
        return read_curves(self.path(key))

    def summary(self, key: str) -> dict[str, Any] | None:
        """Summary of a finished run, or None; of a damaged file None too, with a warning."""
        return self._read(key, _left, read_summary)

    def meta(self, key: str) -> dict[str, Any]:
        """What was saved beside a finished run."""
        return read_meta(self.path(key))

    def save_failure(self, key: str, reason: str, meta: Mapping[str, Any] | None = None) -> None:
        """Record why a run failed, and when [s, Unix]."""
        write_json(self.failure_path(key), {"reason": reason, "recorded": time.time(), **(meta or {})})

    def failure(self, key: str, since: float = 0.0) -> str | None:
        """Why a run failed, or None when no failure is on record from the time `since` [s, Unix] on.

        A record without a time is older than any; one that is damaged is set aside.
        """
        try:
            found = self.failure_record(key)
        except (ValueError, KeyError, TypeError) as error:
            warnings.warn(self._set_aside(self.failure_path(key), error), stacklevel=2)
            return None
        return None if found is None or float(found.get("recorded", 0.0)) < since else found["reason"]

    def failure_record(self, key: str) -> dict[str, Any] | None:
        """The reason and what was saved beside it, or None; a damaged one raises ValueError, KeyError or TypeError."""
        path = self.failure_path(key)
        if not path.exists():
            return None
        found = json.loads(path.read_text(encoding="utf-8"))
        return {**found, "reason": str(found["reason"])}

    def forget_failure(self, key: str) -> None:
        """Remove a failure's record: the run has been made since."""
        self.failure_path(key).unlink(missing_ok=True)

    def keys(self) -> list[str]:
        """Names of all finished runs."""
        return sorted(path.stem for path in self.folder.glob("*.h5"))

    def failed_keys(self) -> list[str]:
        """Names of all runs of which a failure is on record."""
        return sorted(path.name.removesuffix(FAILED) for path in self.folder.glob(f"*{FAILED}"))

    def _read(self, key: str, damaged: Callable[[Path, Exception], str], read: Callable[[Path], T]) -> T | None:
        path = self.path(key)
        if not path.exists():
            return None
        try:
            return read(path)
        except FileNotFoundError:
            return None
        except DAMAGE as error:
            if isinstance(error, OSError) and error.errno is not None:
                raise  # the system refuses the file, which may be whole
            warnings.warn(damaged(path, error), stacklevel=3)
            return None

    def _set_aside(self, path: Path, error: Exception) -> str:
        aside = path.with_name(f"{path.name}.corrupt")
        with suppress(FileNotFoundError):  # another process on the same folder has done it
            path.replace(aside)
        return f"{path} is damaged ({error}); it is set aside as {aside.name} and the run will be repeated"
