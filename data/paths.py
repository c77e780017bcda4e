"""Where the shipped cases and measured curves are, and what a bare name means."""

from __future__ import annotations

import difflib
from os import PathLike
from pathlib import Path

from birdstrike.data.errors import UserError

DATA = Path(__file__).resolve().parent
CASES = DATA / "cases"
MEASURED = DATA / "measured"
REFERENCE = DATA / "reference"
TEMPLATES = DATA / "templates"


def is_file(path: Path) -> bool:
    """Whether a file is there; of a name that no file system holds, such as one that is too long, it is not."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def resolve_case(name: str | Path, beside: Path | None = None) -> Path:
    """A case file by path (relative to `beside` first, where given) or by a shipped case's bare name."""
    return _resolve(name, CASES, ".toml", "case", beside)


def resolve_measured(name: str | Path) -> Path:
    """A measured-data file by path or by a shipped curve's bare name."""
    return _resolve(name, MEASURED, ".csv", "measured-data file", None)


def _resolve(name: str | Path, folder: Path, suffix: str, what: str, beside: Path | None) -> Path:
    if not isinstance(name, str | PathLike):
        raise UserError(
            f"a {what} is given by its path or by the name of a shipped one, not as {type(name).__name__}; write it to "
            "a file and give that"
        )
    given = Path(name).expanduser()
    candidates = [given if beside is None else beside / given]
    if given.parent == Path():
        candidates.append(folder / (given.name.removesuffix(suffix) + suffix))
    for candidate in candidates:
        if is_file(candidate):
            return candidate.resolve()
    if given.parent != Path():
        there = candidates[0].parent
        beside_it = [path.name for path in there.glob(f"*{suffix}")] if there.is_dir() else []
        alike = difflib.get_close_matches(given.name, beside_it, n=1)
        hint = f'did you mean "{alike[0]}"?' if alike else f"files there: {', '.join(sorted(beside_it)[:10]) or 'none'}"
        raise UserError(f'"{name}" is no {what}; {hint}')
    shipped = sorted(path.stem for path in folder.glob(f"*{suffix}"))
    close = difflib.get_close_matches(given.stem, shipped, n=1)
    hint = f'did you mean "{close[0]}"?' if close else f"shipped: {', '.join(shipped)}"
    raise UserError(f'"{name}" is no {what} here and no shipped one; {hint}')
