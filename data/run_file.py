"""One run in an HDF5 file: curves with every bit, its books, its pictures, and a checksum over all of it."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any, cast

import h5py
import numpy as np

from data.files import plain
from data.histories import Histories, Snapshot

SCHEMA_VERSION = 1


def write_run(path: Path, histories: Histories, meta: Mapping[str, Any]) -> None:
    """Write a run; snapshots are pictures and go in single precision, compressed."""
    path.write_bytes(_image(histories, meta))


def _image(histories: Histories, meta: Mapping[str, Any]) -> bytes:
    """The file's bytes, made in memory: HDF5 itself does not survive a full disk."""
    with h5py.File("run.h5", "w", driver="core", backing_store=False) as file:
        file.attrs["schema_version"] = SCHEMA_VERSION
        file.attrs["order"] = json.dumps(list(histories.channels))  # HDF5 itself sorts by name
        file["summary"] = json.dumps(plain(histories.summary))
        file["meta"] = json.dumps(plain(meta))
        file["time"] = histories.time
        for name, values in histories.channels.items():
            file[f"channels/{name}"] = values
            file[f"channels/{name}"].attrs["unit"] = histories.units[name]
        for i, snapshot in enumerate(histories.snapshots):
            _write_snapshot(file.create_group(f"snapshots/{i:04d}"), snapshot)
        file.attrs["checksum"] = _checksum(file)
        file.flush()
        return file.id.get_file_image()


def read_run(path: Path) -> Histories:
    """Read a run back; raises OSError, KeyError, ValueError or RuntimeError when the file is damaged."""
    with h5py.File(path, "r") as file:
        if file.attrs["checksum"] != _checksum(file):
            raise ValueError("its checksum does not fit its content")
        names = json.loads(cast(str, file.attrs["order"]))
        columns = {name: _dataset(file, f"channels/{name}") for name in names}
        units = {name: cast(str, column.attrs["unit"]) for name, column in columns.items()}
        channels = {name: column[()] for name, column in columns.items()}
        pictures = cast(Mapping[str, h5py.Group], file.get("snapshots", {}))
        snapshots = tuple(_read_snapshot(pictures[i]) for i in sorted(pictures))
        return Histories(_dataset(file, "time")[()], channels, units, _json(file, "summary"), snapshots)


def read_meta(path: Path) -> dict[str, Any]:
    """What travels with a run beside its histories."""
    with h5py.File(path, "r") as file:
        return _json(file, "meta")


def _dataset(group: h5py.Group, name: str) -> h5py.Dataset:
    return cast(h5py.Dataset, group[name])


def _json(file: h5py.File, name: str) -> dict[str, Any]:
    return json.loads(str(_dataset(file, name).asstr()[()]))


def _write_snapshot(group: h5py.Group, snapshot: Snapshot) -> None:
    """Real arrays in single precision, node numbers in 32 bits, flags as they are."""
    group.attrs["time"] = snapshot.time
    narrow = {"f": np.float32, "i": np.int32}
    for entry in fields(Snapshot)[1:]:
        values = np.asarray(getattr(snapshot, entry.name))
        small = values.astype(narrow.get(values.dtype.kind, values.dtype))
        group.create_dataset(entry.name, data=small, compression="gzip", shuffle=True)


def _read_snapshot(group: h5py.Group) -> Snapshot:
    arrays = {entry.name: _dataset(group, entry.name)[()] for entry in fields(Snapshot)[1:]}
    wide = {"f": np.float64, "i": np.int64}
    arrays = {name: values.astype(wide.get(values.dtype.kind, values.dtype)) for name, values in arrays.items()}
    return Snapshot(float(cast(float, group.attrs["time"])), **arrays)


def _checksum(file: h5py.File) -> str:
    """SHA-256 over the names, bytes and attributes of everything but the checksum itself."""
    digest = hashlib.sha256()

    def add(name: str, item: h5py.Group | h5py.Dataset) -> None:
        digest.update(name.encode())
        for key in sorted(set(item.attrs) - {"checksum"}):
            digest.update(f"{key}={item.attrs[key]}".encode())
        if isinstance(item, h5py.Dataset):
            value = item[()]
            digest.update(value if isinstance(value, bytes) else np.ascontiguousarray(value).tobytes())

    add("/", file)
    file.visititems(add)
    return digest.hexdigest()
