"""Docstrings as Sphinx reads them: ours are plain text, in which `name` is code and * and | mean themselves."""

from __future__ import annotations

import re

from sphinx.application import Sphinx

CODE = re.compile(r"`([^`\n]+)`")
SPECIAL = re.compile(r"([*|\\]|(?<=\w)_(?=\W|$))")


def as_restructured_text(app: object, what: str, name: str, obj: object, options: object, lines: list[str]) -> None:  # noqa: ARG001 (Sphinx calls it so)
    """Rewrite the lines in place: code stays code, and what reStructuredText would take as markup is escaped."""
    lines[:] = [_line(line) for line in lines]


def _line(line: str) -> str:
    parts = CODE.split(line)  # text and code in turn
    parts[::2] = [SPECIAL.sub(r"\\\1", part) for part in parts[::2]]
    parts[1::2] = [f"``{code}``" for code in parts[1::2]]
    return "".join(parts)


def setup(app: Sphinx) -> dict[str, bool]:
    """Connect to Sphinx."""
    app.connect("autodoc-process-docstring", as_restructured_text)
    return {"parallel_read_safe": True}
