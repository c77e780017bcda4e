"""Which kind a folder is of."""

from __future__ import annotations

from pathlib import Path

from birdstrike.data.errors import UserError
from birdstrike.reports.explore.kinds import campaign, diagnosis, inversion, loop, models
from birdstrike.reports.explore.kinds.kind import Kind

KINDS: tuple[Kind, ...] = (loop.KIND, models.KIND, diagnosis.KIND, inversion.KIND, campaign.KIND)
"""In the order in which they are asked: a loop's folder holds the others."""


def kind_of(folder: Path) -> Kind:
    """The kind of a folder; raises UserError for one that holds no results."""
    if folder.is_dir():
        for kind in KINDS:
            if kind.holds(folder):
                return kind
    makers = ", ".join(kind.made_by for kind in KINDS)
    what = "holds no results that can be explored" if folder.is_dir() else "is no folder"
    raise UserError(f"{folder} {what}; give one that birdstrike {makers} made")
