"""Left-overs of killed saves: temporary files in a run store that no living campaign can still be writing."""

from __future__ import annotations

import re
import time
from contextlib import suppress
from pathlib import Path

DAY = 86400.0
"""[s] No save takes that long: a younger file may belong to a campaign that runs beside this one."""

_TEMPORARY = re.compile(r"\.[0-9a-f]{32}\.(h5|failed\.json)\.\d+-[0-9a-f]{8}\.tmp")
"""Names that data.files.whole_file gives to the files of data.store.RunStore while they are written."""


def remove_leftovers(runs: Path) -> None:
    """Delete the store's own temporary files older than a day; what cannot be deleted stays."""
    oldest = time.time() - DAY
    for path in runs.iterdir():
        if _TEMPORARY.fullmatch(path.name):
            with suppress(OSError):
                if path.lstat().st_mtime < oldest:
                    path.unlink()
