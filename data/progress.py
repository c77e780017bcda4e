"""Progress of long work: what takes the share that is done, and what shows it below a heading."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext

Progress = Callable[[float], None]
"""Takes the share of the work that is done, 0..1."""

Display = Callable[[str], AbstractContextManager[Progress]]
"""Shows a heading and gives what takes the progress of the work below it."""


def silent(_: float) -> None:
    """Progress that nobody watches."""


def part_of(progress: Progress, start: float, end: float) -> Progress:
    """The progress of a part of the work that takes start .. end of the whole."""
    return lambda share: progress(start + (end - start) * share)


def no_display(_: str) -> AbstractContextManager[Progress]:
    """Neither heading nor progress is shown."""
    return nullcontext(silent)
