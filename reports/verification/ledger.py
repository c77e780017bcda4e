"""results.json beside the page's figures: every problem that the page holds, so that one can be added or renewed."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from birdstrike.data.errors import UserError
from birdstrike.data.storage.files import write_json
from birdstrike.reports.verification.cache import Result, as_table, result_of
from birdstrike.reports.verification.registry import problems

FIGURES = Path("docs/verification")
"""Where the page's figures lie, from its own folder."""
NAME = "results.json"


def recorded(out: Path) -> dict[str, Result]:
    """What the page `out` holds, by problem; of problems that exist no more, nothing. Raises UserError."""
    place = out.parent / FIGURES / NAME
    if not place.is_file():
        return {}
    try:
        kept: dict[str, Any] = json.loads(place.read_text(encoding="utf-8"))["problems"]
        known = problems()
        return {name: result_of(known[name], table, place.parent) for name, table in kept.items() if name in known}
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise UserError(f"{place} cannot be read ({error}); delete it, and birdstrike verify makes it anew") from error


def renewed(out: Path, results: Iterable[Result]) -> list[Result]:
    """Results of the page `out` with these added or in their places, in the order of the page."""
    held = recorded(out) | {result.problem.name: result for result in results}
    return [held[name] for name in problems() if name in held]


def record(out: Path, results: Iterable[Result]) -> None:
    """Write what the page holds."""
    write_json(out.parent / FIGURES / NAME, {"problems": {r.problem.name: as_table(r) for r in results}})
