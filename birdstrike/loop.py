"""Close the loop: check, campaign, inversion with its verification, report; each stage skipped while still valid."""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from data.errors import UserError
from data.files import plain, write_json
from data.paths import resolve_case, resolve_measured

if TYPE_CHECKING:
    from data.histories import Histories
    from solver.case import Case

ROOT = Path(__file__).resolve().parent.parent
RECORD = "close_the_loop.json"
SCHEMA_VERSION = 1

Progress = Callable[[float], None]
Display = Callable[[str], AbstractContextManager[Progress]]
"""Shows a stage's heading and gives what takes its progress, 0..1."""


@dataclass(frozen=True)
class Stage:
    """One arrow of the flow. inputs: whatever changes its outcome; outputs: what it leaves; run: does it."""

    name: str
    heading: str
    inputs: Callable[[], Any]
    outputs: tuple[Path, ...]
    run: Callable[[Progress], None]

    def fingerprint(self) -> str:
        """Digest of the inputs: the stage is valid while it stays the same."""
        return hashlib.sha256(json.dumps(plain(self.inputs()), sort_keys=True).encode()).hexdigest()[:32]


@dataclass(frozen=True)
class Closed:
    """A closed loop: the page, the five findings, and the content of `close_the_loop.json`."""

    report: Path
    findings: tuple[str, ...]
    record: Mapping[str, Any]


def quiet(_: str) -> AbstractContextManager[Progress]:
    """No display."""
    return nullcontext(lambda fraction: None)


def run_stages(stages: tuple[Stage, ...], out: Path, display: Display) -> dict[str, Any]:
    """Run the stages that are due, noting each as soon as it is done, so that the next call resumes after it."""
    done: dict[str, Any] = _noted(out).get("stages", {})
    for stage in stages:
        fingerprint, before = stage.fingerprint(), done.get(stage.name, {})
        if before.get("fingerprint") == fingerprint and all(path.exists() for path in stage.outputs):
            done[stage.name] = {**before, "reused": True}
            with display(f"{stage.heading}: still valid"):
                continue
        started = time.perf_counter()
        with display(stage.heading) as progress:
            stage.run(progress)
        seconds = time.perf_counter() - started
        # A stage may settle what its own inputs look like (a resumed campaign); what counts is what it ran on.
        done[stage.name] = {"fingerprint": fingerprint, "seconds": seconds, "reused": False}
        write_json(out / RECORD, {**_noted(out), "stages": done}, SCHEMA_VERSION)
    return done


def _noted(out: Path) -> dict[str, Any]:
    """The record of an earlier call, {} where there is none or it is damaged (then every stage runs again)."""
    path = out / RECORD
    try:
        return json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}
    except ValueError:
        return {}


def digest(*paths: Path) -> dict[str, str]:
    """Name -> SHA-256 of the content of files and, for folders, of the Python sources and templates in them."""
    files = [p for path in paths for p in (sorted(path.rglob("*.*")) if path.is_dir() else [path])]
    wanted = [p for p in files if p.is_file() and (p in paths or p.suffix in (".py", ".j2"))]
    return {str(p): hashlib.sha256(p.read_bytes()).hexdigest() for p in wanted}
