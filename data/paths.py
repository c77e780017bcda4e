"""Where the shipped cases and measured curves are, and what a bare name means."""

from __future__ import annotations

from os import PathLike
from pathlib import Path

from birdstrike.data.errors import UserError
from birdstrike.data.nearest import did_you_mean

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
        there = _files(candidates[0].parent, suffix)
        otherwise = f"files there: {', '.join(there[:10]) or 'none'}"
        hint = did_you_mean(given.name, there, otherwise, quote='"')
        raise UserError(f'"{name}" is no {what}; {hint}')
    shipped = [Path(file).stem for file in _files(folder, suffix)]
    hint = did_you_mean(given.stem, shipped, f"shipped: {', '.join(shipped)}", quote='"')
    raise UserError(f'"{name}" is no {what} here and no shipped one; {hint}')


def _files(folder: Path, suffix: str) -> list[str]:
    """Names of the files of a kind, in order; none where the folder cannot be read or cannot exist."""
    try:
        return sorted(path.name for path in folder.glob(f"*{suffix}"))
    except (OSError, ValueError):
        return []
