"""Digests of source files: what a run's key holds of the code that computed it."""

from __future__ import annotations

import hashlib
import inspect
import sys
from collections.abc import Callable, Iterable
from functools import cache, partial
from pathlib import Path
from types import CodeType, ModuleType
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


def digest_of_module(module: str) -> str:
    """Digest of the Python files of the outermost package that holds a module, or of the module's one file.

    Empty for a module of this tree (`version.SOLVER_VERSION` holds it) and for one without a file, such as an
    interactive session.
    """
    if in_tree(module):
        return ""
    loaded = sys.modules.get(module)
    return "" if loaded is None else _digest_of_loaded(loaded)


@cache
def _digest_of_loaded(module: ModuleType) -> str:
    """Its files are read once: what is loaded stays as it is, whatever becomes of the files."""
    file = getattr(module, "__file__", None)
    if file is None or not Path(file).is_file():
        return ""
    path = Path(file).resolve()
    top = path.parent
    if not (top / "__init__.py").is_file():
        return digest_files(top, [path])
    while (top.parent / "__init__.py").is_file():
        top = top.parent
    return digest_files(top.parent, top.rglob("*.py"))


def digest_of_function(function: Callable[..., Any]) -> str:
    """Digest of the sources that define a function, as digest_of_module has them; where that is empty, of its code."""
    while isinstance(function, partial):
        function = function.func
    defined = function if inspect.isroutine(function) else type(function)
    module = getattr(defined, "__module__", None) or ""
    code = (module, getattr(defined, "__qualname__", ""), _code(getattr(defined, "__code__", None)))
    return digest_of_module(module) or hashlib.sha256(repr(code).encode()).hexdigest()[:12]


def _code(code: CodeType | None) -> tuple[Any, ...]:
    """What a function computes, where no file holds its source: its instructions, names and constants."""
    if code is None:
        return ()
    constants = [_code(entry) if isinstance(entry, CodeType) else repr(entry) for entry in code.co_consts]
    return (code.co_code.hex(), code.co_names, tuple(constants))
