"""The solver's version: a digest of every source file that can change a history."""

from __future__ import annotations

from pathlib import Path

from birdstrike.solver.sources import digest_files

HERE = Path(__file__).parent

WITHOUT_NUMBERS = (
    "case/load.py",
    "case/messages.py",
    "case/overlay.py",
    "case/remarks.py",
    "case/rules.py",
    "case/write.py",
)
"""Files that only read, check or word a case: whatever they make of it is in the case's own hash. All others count."""


def digest_sources() -> str:
    """First 12 hex digits of SHA-256 over the solver's Python files, kernels included, in order of name."""
    left_out = {HERE / name for name in WITHOUT_NUMBERS}
    return digest_files(HERE, (path for path in HERE.rglob("*.py") if path not in left_out))


SOLVER_VERSION = digest_sources()
