"""At which state of the code a row was made."""

from __future__ import annotations

import shutil
import subprocess
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from birdstrike.solver.version import SOLVER_VERSION

ROOT = Path(__file__).resolve().parents[2]
"""Of the folders that `birdstrike` holds, and of the checkout where there is one."""


@dataclass(frozen=True)
class Made:
    """Solver version, commit (empty outside of a checkout) and day."""

    solver: str = SOLVER_VERSION
    commit: str = ""
    date: str = ""

    def __str__(self) -> str:
        """As the page states it."""
        return f"solver {self.solver}" + (f", commit {self.commit}" if self.commit else "")

    @property
    def short(self) -> str:
        """The commit in seven digits, else the solver's version."""
        return self.commit[:7] or self.solver[:7]


def made_now() -> Made:
    """The present code, today."""
    return Made(SOLVER_VERSION, commit() or "", datetime.now(UTC).strftime("%Y-%m-%d"))


def commit() -> str | None:
    """Commit of the checkout that the code lies in, with a remark where files differ from it; None outside of one."""
    git = shutil.which("git")
    if git is None or not (ROOT / ".git").exists():
        return None
    head = _git(git, "rev-parse", "--short=12", "HEAD")
    changed = _git(git, "status", "--porcelain", "--untracked-files=no", "--", "*.py", "*.toml", "*.csv")
    return head + (" and uncommitted changes" if changed else "") if head else None


def _git(git: str, *arguments: str) -> str:
    ended = subprocess.run([git, *arguments], cwd=ROOT, capture_output=True, text=True, check=False)
    return ended.stdout.strip() if ended.returncode == 0 else ""
