"""The run store: one HDF5 file per finished run, one JSON file per failed one, named by what defines the run."""

from __future__ import annotations

import hashlib
import json
import math
import time
import warnings
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from data.files import plain, whole_file, write_json
from data.histories import Histories
from data.run_file import read_curves, read_meta, read_run, write_run

DAMAGE = (OSError, KeyError, ValueError, TypeError, RuntimeError)
"""What h5py raises for a file that is cut short or scrambled."""

FAILED = ".failed.json"
SYNC_EVERY_S = 1.0
"""Runs that come faster than this are not each waited for: what a power failure then takes, its checksum tells."""


def run_key(canonical: Mapping[str, Any], solver_version: str, step_factor: float = 1.0) -> str:
    """Name of a run: 32 hex digits of SHA-256 over the canonical case, the solver's version and the step factor."""
    identity = {"case": canonical, "solver": solver_version, "step_factor": float(step_factor)}
    text = json.dumps(identity, sort_keys=True, separators=(",", ":"), allow_nan=False, default=plain)
    return hashlib.sha256(text.encode()).hexdigest()[:32]


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
        return self._read(key, self._set_aside)

    def look_up(self, key: str) -> Histories | None:
        """A finished run, or None; a file that is damaged stays as it is and counts as none, with a warning."""
        return self._read(key, lambda path, error: f"{path} is damaged ({error}); it is left as it is and not used")

    def curves(self, key: str) -> Histories:
        """Time and channels of a run that this process has written or loaded: its checksum is not asked again."""
        return read_curves(self.path(key))

    def meta(self, key: str) -> dict[str, Any]:
        """What was saved beside a finished run."""
        return read_meta(self.path(key))

    def save_failure(self, key: str, reason: str, meta: Mapping[str, Any] | None = None) -> None:
        """Record why a run failed."""
        write_json(self.failure_path(key), {"reason": reason, **(meta or {})})

    def failure(self, key: str) -> str | None:
        """Why a run failed, or None when no failure is on record; a record that is damaged is set aside."""
        try:
            found = self.failure_record(key)
        except (ValueError, KeyError, TypeError) as error:
            warnings.warn(self._set_aside(self.failure_path(key), error), stacklevel=2)
            return None
        return None if found is None else found["reason"]

    def failure_record(self, key: str) -> dict[str, Any] | None:
        """The reason and what was saved beside it, or None; a damaged one raises ValueError, KeyError or TypeError."""
        path = self.failure_path(key)
        if not path.exists():
            return None
        found = json.loads(path.read_text(encoding="utf-8"))
        return {**found, "reason": str(found["reason"])}

    def forget_failure(self, key: str) -> None:
        """Let a run that failed be tried again."""
        self.failure_path(key).unlink(missing_ok=True)

    def keys(self) -> list[str]:
        """Names of all finished runs."""
        return sorted(path.stem for path in self.folder.glob("*.h5"))

    def failed_keys(self) -> list[str]:
        """Names of all runs of which a failure is on record."""
        return sorted(path.name.removesuffix(FAILED) for path in self.folder.glob(f"*{FAILED}"))

    def _read(self, key: str, judge: Callable[[Path, Exception], str]) -> Histories | None:
        path = self.path(key)
        try:
            return read_run(path)
        except FileNotFoundError:
            return None
        except DAMAGE as error:
            if isinstance(error, OSError) and error.errno is not None:
                raise  # the system refuses the file, which may be whole
            warnings.warn(judge(path, error), stacklevel=3)
            return None

    def _set_aside(self, path: Path, error: Exception) -> str:
        aside = path.with_name(f"{path.name}.corrupt")
        with suppress(FileNotFoundError):  # another process on the same folder has done it
            path.replace(aside)
        return f"{path} is damaged ({error}); it is set aside as {aside.name} and the run will be repeated"
