"""The run store: one HDF5 file per finished run, one JSON file per failed one, named by what defines the run."""

from __future__ import annotations

import hashlib
import json
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from data.files import plain, whole_file, write_json
from data.histories import Histories
from data.run_file import read_meta, read_run, write_run

DAMAGE = (OSError, KeyError, ValueError, TypeError, RuntimeError)
"""What h5py raises for a file that is cut short or scrambled."""


def run_key(canonical: Mapping[str, Any], solver_version: str, step_factor: float = 1.0) -> str:
    """Name of a run: 32 hex digits of SHA-256 over the canonical case, the solver's version and the step factor."""
    identity = {"case": canonical, "solver": solver_version, "step_factor": float(step_factor)}
    text = json.dumps(plain(identity), sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()[:32]


class RunStore:
    """Runs in a folder; two stores are merged by copying their files together."""

    run_key = staticmethod(run_key)

    def __init__(self, folder: str | Path) -> None:
        self.folder = Path(folder)

    def path(self, key: str) -> Path:
        """File of a finished run."""
        return self.folder / f"{key}.h5"

    def save(self, key: str, histories: Histories, meta: Mapping[str, Any] | None = None) -> None:
        """Write a run whole or not at all; meta: whatever else should travel with it."""
        with whole_file(self.path(key)) as temporary:
            write_run(temporary, histories, meta or {})

    def load(self, key: str) -> Histories | None:
        """A finished run, or None; a file that is damaged is set aside as *.corrupt with a warning."""
        path = self.path(key)
        if not path.exists():
            return None
        try:
            return read_run(path)
        except DAMAGE as error:
            aside = path.with_name(f"{path.name}.corrupt")
            path.replace(aside)
            text = f"{path} is damaged ({error}); it is set aside as {aside.name} and the run will be repeated"
            warnings.warn(text, stacklevel=2)
            return None

    def look_up(self, key: str) -> Histories | None:
        """A finished run, or None; a file that is damaged stays as it is and counts as none, with a warning."""
        path = self.path(key)
        try:
            return read_run(path) if path.exists() else None
        except DAMAGE as error:
            warnings.warn(f"{path} is damaged ({error}); it is left as it is and not used", stacklevel=2)
            return None

    def meta(self, key: str) -> dict[str, Any]:
        """What was saved beside a finished run."""
        return read_meta(self.path(key))

    def save_failure(self, key: str, reason: str, meta: Mapping[str, Any] | None = None) -> None:
        """Record why a run failed."""
        write_json(self._failure_path(key), {"reason": reason, **(meta or {})})

    def failure(self, key: str) -> str | None:
        """Why a run failed, or None when no failure is on record."""
        path = self._failure_path(key)
        return json.loads(path.read_text(encoding="utf-8"))["reason"] if path.exists() else None

    def keys(self) -> list[str]:
        """Names of all finished runs."""
        return sorted(path.stem for path in self.folder.glob("*.h5"))

    def _failure_path(self, key: str) -> Path:
        return self.folder / f"{key}.failed.json"
