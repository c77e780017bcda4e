"""The solver's version: a digest of every source file that can change a history; and that of a layer above it.

Left out of the first is what computes none: `reference/`, `estimate.py` and the files of a case that only read, check
or word it.
"""

from __future__ import annotations

import hashlib
from functools import cache
from pathlib import Path

from birdstrike.solver.sources import digest_files

HERE = Path(__file__).parent

WITHOUT_HISTORIES = (
    "case/load.py",
    "case/messages.py",
    "case/overlay.py",
    "case/remarks.py",
    "case/rules.py",
    "case/write.py",
    "estimate.py",
    "setup_warnings.py",
    "reference/",
)
"""What computes no history: files that only read, check or word a case (whatever they make of it is in the case's own
hash), the estimate of a run's cost, and the formulas that runs are compared with. All other files count.
"""


def digest_sources() -> str:
    """First 12 hex digits of SHA-256 over the solver's Python files that count, kernels included, in order of name."""
    return digest_files(HERE, (path for path in HERE.rglob("*.py") if counts(path.relative_to(HERE).as_posix())))


def counts(name: str) -> bool:
    """Whether a file, by its path below the solver, can change a history."""
    folders = tuple(left_out for left_out in WITHOUT_HISTORIES if left_out.endswith("/"))
    return name not in WITHOUT_HISTORIES and not name.startswith(folders)


SOLVER_VERSION = digest_sources()

LAYERS = ("data", "doe", "surrogate", "inversion", "reports")
"""Beside the solver, the lower one first: a layer imports those before it."""
SOURCES = (".py", ".j2", ".js", ".css")


@cache
def code_of(layer: str) -> str:
    """First 12 hex digits of SHA-256 over the code that makes a layer's results: its own and all below it.

    A result that was made by other code is stale. layer: one of LAYERS; the solver counts by its version, so that words
    of its checks that a page repeats do not.
    """
    root = HERE.parent
    folders = [root / name for name in LAYERS[: LAYERS.index(layer) + 1]]
    files = (path for folder in folders for path in folder.rglob("*") if path.suffix in SOURCES)
    return hashlib.sha256(f"{SOLVER_VERSION} {digest_files(root, files)}".encode()).hexdigest()[:12]
