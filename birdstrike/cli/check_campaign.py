"""`birdstrike check` of a campaign's folder: its runs, and what lies there that is not used."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from birdstrike.cli.frame import progress_bar, say

SHOWN = 5


def check_campaign(path: Path) -> dict[str, Any]:
    """List what the folder holds, changing nothing; raises UserError where there is no campaign."""
    from doe.inventory import inventory

    with progress_bar("reading the runs") as progress:
        found = inventory(path, progress)
    planned = len(found.finished) + len(found.failed) + len(found.due)
    counts = f"{len(found.finished)} finished, {len(found.failed)} failed, {len(found.due)} to be run"
    say(f"{path}: a campaign of {planned} strikes ({found.state}); with solver version {found.version}: {counts}.")
    for number, reason in found.failed.items():
        say(f"run {number} failed: {reason}")
    for version, names in found.other_versions.items():
        say(f"{len(names)} results of solver version {version} are kept and not used: {_some(names)}")
    if found.elsewhere:
        say(f"{len(found.elsewhere)} results belong to another case or design: {_some(found.elsewhere)}")
    if found.damaged:
        say(f"{len(found.damaged)} files are damaged and not used, their runs will be repeated: {_some(found.damaged)}")
    return {
        "state": found.state,
        "solver_version": found.version,
        "finished": found.finished,
        "failed": {str(number): reason for number, reason in found.failed.items()},
        "due": found.due,
        "other_versions": found.other_versions,
        "elsewhere": found.elsewhere,
        "damaged": found.damaged,
    }


def _some(names: list[str]) -> str:
    """The first few of them."""
    more = f" and {len(names) - SHOWN} more" if len(names) > SHOWN else ""
    return ", ".join(names[:SHOWN]) + more
