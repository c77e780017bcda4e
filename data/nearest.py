"""The known name that a mistyped one is most like, for messages."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

ALIKE = 0.6
"""Share of letters in common, in order, from which two names are alike: difflib's own default."""


def nearest(given: str, known: Iterable[str], alike: float = ALIKE) -> str:
    """The known name most like the given one, "" where none is alike."""
    return next(iter(difflib.get_close_matches(given, list(known), n=1, cutoff=alike)), "")


def did_you_mean(
    given: str, known: Iterable[str], otherwise: str = "", *, alike: float = ALIKE, quote: str = ""
) -> str:
    """ "did you mean plate.length?", else what to say where no known name is alike; quote: mark about the name."""
    close = nearest(given, known, alike)
    return f"did you mean {quote}{close}{quote}?" if close else otherwise
