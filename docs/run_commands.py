"""Every command of README.md and docs/ as it stands there, one page after the other: `make docs-run`.

A page's blocks run in order in a folder of its own, as a reader would do it: the content of a block with a title
becomes a file, a block of bash goes to the shell, Python is executed with what the page has defined before. The
questions of `birdstrike start` are answered by Return. Indented lines are listed and not run: they name files of the
reader's own, or take hours.
"""

from __future__ import annotations

import contextlib
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT), str(ROOT / "docs")]

from make_session import environment  # noqa: E402  # pyright: ignore[reportMissingImports] (docs/ is no package)

from tests.docs.pages import PAGES, blocks  # noqa: E402

RETURNS = "\n" * 200
LIMIT_S = 3600.0
"""Longest time of one block."""

_INDENTED = re.compile(r"^ {4}((?:birdstrike|make|python|pip) .*)$", re.MULTILINE)


def main(arguments: Sequence[str]) -> int:
    """Run the pages that are named, all by default; 1 where a block fails."""
    wanted = [path for path in PAGES if not arguments or path.name in arguments or str(path) in arguments]
    failed = [place for path in wanted for place in run_page(path)]
    shown = [line for path in wanted for line in _INDENTED.findall(path.read_text(encoding="utf-8"))]
    say(f"{len(shown)} indented lines are shown in the pages and were not run:")
    for line in shown:
        say(f"  {line}")
    say(f"{len(failed)} blocks failed: {', '.join(failed)}" if failed else "every block ran")
    return 1 if failed else 0


def run_page(path: Path) -> Iterator[str]:
    """Run a page's blocks in order; the place of one that fails, behind which the page is left."""
    folder = Path(tempfile.mkdtemp(prefix=f"{path.stem}_"))
    around, names = environment(folder / ".bin"), {"__name__": "page"}
    for block in blocks(path):
        if block.title:
            (folder / block.title).write_text(block.text, encoding="utf-8")
        if block.language not in ("bash", "python"):
            continue
        place, begun = f"{path.name}, line {block.line}", time.monotonic()
        error = shell(block.text, folder, around) if block.language == "bash" else python(block.text, folder, names)
        say(f"{place}: {'FAILED' if error else 'ran'} in {time.monotonic() - begun:.0f} s")
        if error:
            say(f"{block.text}{error}\nfiles are left in {folder}")
            yield place
            return
    shutil.rmtree(folder)


def shell(text: str, folder: Path, around: dict[str, str]) -> str:
    """Run lines of bash; what they said where one failed, else nothing."""
    ended = subprocess.run(
        ["bash", "-e", "-c", text],
        cwd=folder,
        env=around,
        input=RETURNS,
        capture_output=True,
        text=True,
        timeout=LIMIT_S,
        check=False,
    )
    return f"{ended.stdout}{ended.stderr}" if ended.returncode else ""


def python(text: str, folder: Path, names: dict[str, Any]) -> str:
    """Execute Python with what the page has defined before; the traceback where it failed, else nothing."""
    try:
        with contextlib.chdir(folder):
            exec(compile(text, "page", "exec"), names)
    except Exception:
        return traceback.format_exc()
    return ""


def say(text: str) -> None:
    """A line at once."""
    print(text, flush=True)  # noqa: T201 (a script)


if __name__ == "__main__":
    os.chdir(ROOT)
    sys.exit(main(sys.argv[1:]))
