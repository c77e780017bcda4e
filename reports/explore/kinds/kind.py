"""A kind of folder: how it is known, and how it is read."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from birdstrike.reports.explore.view import View


@dataclass(frozen=True)
class Kind:
    """made_by: the command; holds: whether a folder is of this kind; read: its views, the one shown first at the front.

    `read` raises UserError where the folder lacks what the page needs, with the command that makes it.
    """

    made_by: str
    holds: Callable[[Path], bool]
    read: Callable[[Path], Sequence[View]]
