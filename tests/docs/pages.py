"""Fenced blocks of the documentation's pages, in order, and what a reader would do with them."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGES = (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")))
FENCE = re.compile(
    r"(?P<slow><!-- slow -->\n)?^```(?P<language>[a-z]+)(?P<rest>[^\n]*)\n(?P<text>.*?)^```$", re.DOTALL | re.MULTILINE
)
SHOWN = "text"
"""Blocks that a reader only looks at, unless they have a title: then they are a file's content."""


@dataclass(frozen=True)
class Block:
    """A fenced block; title: the file that it is the content of; slow: it costs minutes and is not run by the tests."""

    page: Path
    line: int
    language: str
    title: str
    text: str
    slow: bool

    @property
    def lines(self) -> list[str]:
        """Lines of a shell; a backslash continues one."""
        return self.text.replace("\\\n", " ").splitlines()

    @property
    def commands(self) -> Iterator[list[str]]:
        """Arguments of every line that calls birdstrike."""
        for line in self.lines:
            words = shlex.split(line, comments=True)
            if words[:1] == ["birdstrike"]:
                yield words[1:]


def blocks(page: Path) -> Iterator[Block]:
    """Every fenced block of a page, Sphinx's own directives left out."""
    text = page.read_text(encoding="utf-8")
    for found in FENCE.finditer(text):
        title = re.search(r'title="([^"]+)"', found["rest"])
        line = text[: found.start()].count("\n") + 1
        yield Block(page, line, found["language"], title[1] if title else "", found["text"], bool(found["slow"]))
