"""Terminal sessions of the documentation, run here and never typed: `make session` writes them into the pages."""

from __future__ import annotations

import os
import re
import stat
import subprocess
import sys
import tempfile
import textwrap
from collections.abc import Iterable
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
WIDTH = 100
"""Columns of the terminal that is shown: longer lines are folded at a blank."""

SESSIONS = {
    "loop": (
        "birdstrike new shot_12",
        "sed -i 's/particles = 4500/particles = 2600/' shot_12.toml",
        "birdstrike simulate shot_12.toml --noise 12 --out test_rig \\\n"
        '    --set bird.material.viscosity="420 Pa s" --set time.end="2.6 ms" \\\n'
        '    --set sensors.displacement_centre.noise="0.03 mm"',
        "birdstrike import test_rig/record.csv --sensor displacement_centre --out shot_12.csv",
        "birdstrike close-the-loop shot_12.toml --measured shot_12.csv --out loop",
        "birdstrike export loop --to lsdyna --units mm-ms-g-MPa",
        "grep -A 8 MAT_NULL loop/bird.k",
    ),
    "table7": ("birdstrike close-the-loop demo --measured table7_group5 --out demo_out",),
}
"""Name -> command lines; a place in a page is marked by <!-- session NAME --> and <!-- /session -->."""


def main() -> None:
    """Run every session, or those named, and put each where a page asks for it."""
    for name in sys.argv[1:] or SESSIONS:
        text = session(SESSIONS[name])
        for page in (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))):
            before = page.read_text(encoding="utf-8")
            after = inserted(before, name, text)
            if after != before:
                page.write_text(after, encoding="utf-8", newline="\n")
                print(f"{page.relative_to(ROOT)}: session {name}")  # noqa: T201 (a script)


def session(commands: Iterable[str]) -> str:
    """What a terminal shows of the commands, run one after the other in an empty folder; raises where one fails."""
    with tempfile.TemporaryDirectory() as folder:
        around = environment(Path(folder) / ".bin")
        lines = []
        for command in commands:
            ended = subprocess.run(
                command, shell=True, cwd=folder, env=around, stdout=subprocess.PIPE, text=True, check=True
            )
            lines += [*f"$ {command}".splitlines(), *ended.stdout.rstrip().splitlines()]
    return "\n".join(part for line in lines for part in folded(line.rstrip()))


def folded(line: str) -> list[str]:
    """A line in pieces of at most WIDTH columns; one that fits stays as it is, blanks and all."""
    return [line] if len(line) <= WIDTH else textwrap.wrap(line, WIDTH, subsequent_indent="  ")


def inserted(page: str, name: str, text: str) -> str:
    """The page with the session at its place; other pages as they are."""
    place = re.compile(rf"(<!-- session {name} -->\n).*?(<!-- /session -->)", re.DOTALL)
    return place.sub(lambda found: f"{found[1]}```text\n{text}\n```\n{found[2]}", page)


def environment(folder: Path) -> dict[str, str]:
    """This interpreter's birdstrike on the path and in Python, and a plain terminal."""
    folder.mkdir(parents=True)
    command = folder / "birdstrike"
    command.write_text(f'#!/bin/sh\nPYTHONPATH="{ROOT}" exec "{sys.executable}" -m birdstrike "$@"\n')
    command.chmod(command.stat().st_mode | stat.S_IXUSR)
    plain = {"COLUMNS": str(WIDTH), "NO_COLOR": "1", "TERM": "dumb", "PYTHONPATH": str(ROOT)}
    return {**os.environ, **plain, "PATH": f"{folder}{os.pathsep}{os.environ['PATH']}"}


if __name__ == "__main__":
    main()
