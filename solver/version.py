"""The solver's version: a digest of every source file that can change a history."""

from __future__ import annotations

import hashlib
from pathlib import Path

HERE = Path(__file__).parent


def digest_sources() -> str:
    """First 12 hex digits of SHA-256 over the solver's Python files, kernels included, in order of name.

    The files that only read and check a case are left out: the case itself is part of a run's key.
    """
    digest = hashlib.sha256()
    for path in sorted(HERE.rglob("*.py"), key=lambda p: p.relative_to(HERE).as_posix()):
        if path.parent.name == "case":
            continue
        digest.update(path.relative_to(HERE).as_posix().encode())
        digest.update(path.read_bytes().replace(b"\r\n", b"\n"))
    return digest.hexdigest()[:12]


SOLVER_VERSION = digest_sources()
