"""Extension: whether a longer design only appends strikes to the one that a folder holds, and what to do if not."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from doe.designs import Design

EXTENDABLE = ("sobol", "file")
"""Kinds of which the first rows stay when rows are added; the others spread any number of runs anew."""


def extends(design: Design, text: str, held_text: str, held: Mapping[str, Any]) -> bool:
    """Whether the rows `held_text` are the first of `text`, bit for bit, in a design of the same kind, seed and ranges.

    text, held_text: design.csv as asked and as held; held: the folder's summary.json. Where that is missing nothing
    vouches for the ranges, and the answer is no.
    """
    if not held or design.kind not in EXTENDABLE or not _same_family(design, held["design"]):
        return False
    return _space(design) == held["space"] and len(text) > len(held_text) and text.startswith(held_text)


def remedy(design: Design, held_runs: int, held: Mapping[str, Any]) -> str:
    """What to do about a design that neither resumes nor extends the held one of `held_runs` runs."""
    again = "choose another --out, or repeat the first options to resume"
    if not held or not _same_family(design, held["design"]):
        return again
    if len(design.numbers) < held_runs:
        return f"a campaign cannot be shortened: {again}"
    if design.kind not in EXTENDABLE and len(design.numbers) > held_runs:
        return (
            f"a longer {design.kind} design has other rows and cannot extend it: {again}; what can be extended is "
            "--design sobol, or a FILE with rows appended, from the start and in a folder of its own"
        )
    if _space(design) != held["space"]:
        return f"the parameters or their ranges (inversion.parameters) differ: {again}"
    return f"rows may only be appended to the first {held_runs}, which differ: {again}"


def _same_family(design: Design, held: Mapping[str, Any]) -> bool:
    return (design.kind, design.seed) == (held["kind"], held["seed"])


def _space(design: Design) -> dict[str, list[Any]]:
    """The ranges as summary.json has them."""
    space = design.space
    return {
        "names": list(space.names),
        "units": list(space.units),
        "lows": space.lows.tolist(),
        "highs": space.highs.tolist(),
    }
