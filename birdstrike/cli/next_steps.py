"""What comes next after a command, as a line that a shell takes: real file names, quoted where they need it."""

from __future__ import annotations

import shlex
from collections.abc import Iterable
from pathlib import Path

from birdstrike.data.errors import UserError

MOST_FILES = 200
"""Files of the current folder that are looked at."""


def command_line(*words: str | Path) -> str:
    """A call of birdstrike, each word quoted for the shell where it needs it."""
    return shlex.join(["birdstrike", *map(str, words)])


def following(*words: str | Path) -> str:
    """The line that names the next command."""
    return f"Next: {command_line(*words)}"


def set_again(settings: Iterable[str]) -> list[str]:
    """The options --set of this command for the next one."""
    return [word for setting in settings for word in ("--set", setting)]


def record_here(sensors: Iterable[str]) -> str:
    """The only measured-data CSV of the current folder whose channels the case has; else "shot.csv" stands for it."""
    from birdstrike.data.curves import read_measured

    known, found = set(sensors), list[str]()
    for path in _files("*.csv"):
        if not _looks_measured(path):
            continue
        try:
            if set(read_measured(path).channels) <= known:
                found.append(str(path))
        except (UserError, OSError):
            continue
    return found[0] if len(found) == 1 else "shot.csv"


def case_here(channels: Iterable[str]) -> str | None:
    """The only case file of the current folder that has sensors for the channels; None for none or several."""
    from birdstrike.solver.case.case import load_case

    needed, found = set(channels), list[str]()
    for path in _files("*.toml"):
        try:
            if needed <= set(load_case(path).sensors):
                found.append(str(path))
        except (UserError, OSError):
            continue
    return found[0] if len(found) == 1 else None


def _files(pattern: str) -> list[Path]:
    """Files of the current folder, by name; none where there are too many to look at."""
    found = sorted(path for path in Path().glob(pattern) if path.is_file())
    return found if len(found) <= MOST_FILES else []


def _looks_measured(path: Path) -> bool:
    """Whether the first line without a # begins as the header of a record does."""
    try:
        with path.open(encoding="utf-8") as file:
            header = next((line for line in file if line.strip() and not line.startswith("#")), "")
    except (OSError, UnicodeDecodeError):
        return False
    return header.startswith("time [")
