"""Digests of source files: what a run's key holds of the code that computed it."""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Iterable
from functools import cache, partial
from pathlib import Path
from typing import Any

TREE = __name__.partition(".")[0]


def digest_files(folder: Path, files: Iterable[Path]) -> str:
    """First 12 hex digits of SHA-256 over files, in order of their paths below the folder; line ends as on Unix."""
    digest = hashlib.sha256()
    for path in sorted(files, key=lambda p: p.relative_to(folder).as_posix()):
        digest.update(path.relative_to(folder).as_posix().encode())
        digest.update(path.read_bytes().replace(b"\r\n", b"\n"))
    return digest.hexdigest()[:12]


def defining_module(code: Any) -> str:
    """The module that defines a class or function, below partials and what functools.wraps has wrapped; "" for none."""
    while isinstance(code, partial) or hasattr(code, "__wrapped__"):
        code = code.func if isinstance(code, partial) else code.__wrapped__
    return getattr(code, "__module__", None) or ""


def in_tree(module: str) -> bool:
    """Whether a module is one of this tree."""
    return module.partition(".")[0] == TREE


@cache
def digest_of_module(module: str) -> str:
    """Digest of the Python files of the outermost package that holds a module, or of the module's one file.

    Empty for a module of this tree (`version.SOLVER_VERSION` holds it) and for one without a file, such as an
    interactive session.
    """
    if in_tree(module):
        return ""
    file = getattr(sys.modules.get(module), "__file__", None)
    if file is None:
        return ""
    path = Path(file).resolve()
    top = path.parent
    if not (top / "__init__.py").is_file():
        return digest_files(top, [path])
    while (top.parent / "__init__.py").is_file():
        top = top.parent
    return digest_files(top.parent, top.rglob("*.py"))
