"""Which code and which kind of machine a verification was made with."""

from __future__ import annotations

import os
import platform
import shutil
import subprocess
from importlib.metadata import version
from pathlib import Path

from solver.version import SOLVER_VERSION

ROOT = Path(__file__).resolve().parents[2]


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


def code() -> str:
    """Solver version and commit."""
    at = commit()
    return f"solver {SOLVER_VERSION}" + (f", commit {at}" if at else "")


def machine() -> str:
    """Its class: cores, processor family, and the libraries that decide the bits."""
    libraries = ", ".join(f"{name} {version(name)}" for name in ("numpy", "numba", "scipy"))
    return f"{os.cpu_count()} cores, {platform.machine()}, Python {platform.python_version()}, {libraries}"
