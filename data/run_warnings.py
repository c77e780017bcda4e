"""Warnings of several simulations, each said once."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

_NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?(?![\w.]*\w)", re.IGNORECASE)
"""A number that stands by itself."""


def merged(runs: Sequence[Sequence[str]]) -> tuple[str, ...]:
    """Warnings of several simulations, equal but for their numbers, as one: "83 .. 94 Pa s (2 of 9 simulations)".

    Ordered by their mean place among the warnings of the runs that have them, so that the gravest stay first.
    """
    alike: dict[str, list[tuple[int, str]]] = {}
    for own in runs:
        for place, text in enumerate(own):
            alike.setdefault(_NUMBER.sub("#", text), []).append((place, text))
    ordered = sorted(alike.values(), key=lambda found: sum(place for place, _ in found) / len(found))
    return tuple(f"{_ranged([t for _, t in found])} ({len(found)} of {len(runs)} simulations)" for found in ordered)


def _ranged(texts: Sequence[str]) -> str:
    """The first of texts that are equal but for their numbers, each number as the range that it has in all of them."""
    columns = zip(*(_NUMBER.findall(text) for text in texts), strict=True)
    ranges = iter([_range(sorted(set(column), key=float)) for column in columns])
    return _NUMBER.sub(lambda _: next(ranges), texts[0])


def _range(ordered: Sequence[str]) -> str:
    return ordered[0] if len(ordered) == 1 else f"{ordered[0]} .. {ordered[-1]}"


def unlike(texts: Iterable[str], others: Iterable[str]) -> tuple[str, ...]:
    """Those of the texts that are not, but for their numbers and ranges, among others."""
    known = set(map(_without_numbers, others))
    return tuple(text for text in texts if _without_numbers(text) not in known)


def _without_numbers(text: str) -> str:
    return _NUMBER.sub("#", text).replace("# .. #", "#")
