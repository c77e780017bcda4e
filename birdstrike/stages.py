"""Stages of a flow, each done once: what it was made from is remembered, and a stage whose inputs changed is redone."""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from birdstrike.data.progress import Display, Progress, no_display
from birdstrike.data.storage.files import json_values, write_json

if TYPE_CHECKING:
    from birdstrike.solver.case.case import Case

STILL_VALID = "still valid"  # ends the heading of a stage that is not done again


@dataclass(frozen=True)
class Stage:
    """One arrow of the flow.

    inputs: all that changes its outcome, asked when the stages before it are done; outputs: files that it leaves; run:
    does the work; retries: whether it holds failed runs that are to be tried again, so that it runs in any case.
    """

    name: str
    heading: str
    inputs: Callable[[], Any]
    outputs: tuple[Path, ...]
    run: Callable[[Progress], None]
    retries: Callable[[], bool] = lambda: False

    def fingerprint(self) -> str:
        """Digest of the inputs: what the stage left is valid while it stays the same."""
        text = json.dumps(json_values(self.inputs()), sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()[:32]


@dataclass(frozen=True)
class Ledger:
    """The file in which a flow notes its stages: name -> fingerprint, seconds of its last run, reused or not."""

    path: Path
    schema_version: int = 1

    def read(self) -> dict[str, Any]:
        """Content of the file, {} where there is none; a damaged file counts as none: every stage then runs again."""
        try:
            return json.loads(self.path.read_text(encoding="utf-8")) if self.path.is_file() else {}
        except ValueError:
            return {}

    def entry(self, stage: str) -> dict[str, Any]:
        """What is noted of a stage, {} of one that was never done."""
        return self.read().get("stages", {}).get(stage, {})

    def write(self, **entries: Any) -> dict[str, Any]:
        """Note `entries` beside what is there, whole or not at all; the new content."""
        content = {**self.read(), **entries}
        content.pop("schema_version", None)
        write_json(self.path, content, self.schema_version)
        return self.read()

    def note(self, stage: str, entry: dict[str, Any]) -> None:
        """Note a stage's entry beside those of the others."""
        self.write(stages={**self.read().get("stages", {}), stage: entry})


def run_stages(stages: Iterable[Stage], ledger: Ledger, display: Display = no_display) -> None:
    """Run what is due, in order, noting each stage as soon as it is done: the next call resumes behind it."""
    for stage in stages:
        before, fingerprint = ledger.entry(stage.name), stage.fingerprint()
        valid = before.get("fingerprint") == fingerprint and all(path.exists() for path in stage.outputs)
        if valid and not stage.retries():
            with display(f"{stage.heading}: {STILL_VALID}"):
                ledger.note(stage.name, {**before, "reused": True})
            continue
        started = time.perf_counter()
        with display(stage.heading) as progress:
            stage.run(progress)
        seconds = time.perf_counter() - started
        ledger.note(stage.name, {"fingerprint": fingerprint, "seconds": seconds, "reused": False})


def digest(*files: Path) -> str:
    """SHA-256 over the content of files, in the order given."""
    whole = hashlib.sha256()
    for file in files:
        whole.update(hashlib.sha256(file.read_bytes()).digest())
    return whole.hexdigest()


def effects_digest() -> str:
    """SHA-256 over the effects of the library, of installed packages and of one's own: their data and their sources.

    Those of the library's own sources are in `code_of`.
    """
    from birdstrike.solver.effects.registry import effects  # late: it brings in pydantic
    from birdstrike.solver.sources import digest_of_function

    whole = hashlib.sha256()
    for name, effect in effects().items():
        whole.update(f"{name} {effect.unit} {effect.meaning} {effect.family}".encode())
        functions = (effect.change, effect.size, effect.least, effect.refuses, effect.places, effect.alone)
        for function in filter(None, functions):
            whole.update(digest_of_function(function).encode())
    return whole.hexdigest()


def inputs_of_diagnosis(cases: Iterable[Case], records: Iterable[Path], **told: Any) -> dict[str, Any]:
    """All that changes a diagnosis: cases, solver, effects, records by content and name, code, and what it was told."""
    from birdstrike.doe.solvers import content_of  # late: it brings in the solver
    from birdstrike.solver.version import code_of

    return {
        "told": told,
        "cases": [content_of(one) for one in cases],
        "records": [(path.name, digest(path)) for path in records if path.is_file()],
        "effects": effects_digest(),
        "code": code_of("inversion"),
    }
