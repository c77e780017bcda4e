"""Extension: whether a longer design only appends strikes to the one that a folder holds, and what to do if not."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from doe.designs import Design


def extends(design: Design, text: str, held_text: str, held: Mapping[str, Any], same_ranges: bool) -> bool:
    """Whether the held rows are the first of `text`, bit for bit, in a design of the same kind, seed and ranges.

    text, held_text: design.csv as asked and as held; held: the folder's summary.json, which is written after it: rows
    beyond those it counts were planned by a call that was stopped there. Where it is missing nothing vouches for the
    ranges, and the answer is no.
    """
    if not held or not _same_family(design, held["design"]) or not same_ranges or len(text) <= len(held_text):
        return False
    vouched = "".join(held_text.splitlines(keepends=True)[: held["design"]["runs"] + 1])
    return text.startswith(vouched)


def remedy(design: Design, held_runs: int, held: Mapping[str, Any], same_ranges: bool) -> str:
    """What to do about a design that neither resumes nor extends the held one of `held_runs` runs."""
    again = "choose another --out, or repeat the first options to resume"
    if not held or not _same_family(design, held["design"]):
        return again
    if len(design.numbers) < held_runs:
        return f"a campaign cannot be shortened: {again}"
    if not same_ranges:
        return f"the parameters or their ranges (inversion.parameters) differ: {again}"
    return f"rows may only be appended to the first {held_runs}, which differ: {again}"


def _same_family(design: Design, held: Mapping[str, Any]) -> bool:
    return (design.kind, design.seed) == (held["kind"], held["seed"])
