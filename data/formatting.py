"""Numbers and names in the user's words."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterable, Sequence
from decimal import Decimal

from birdstrike.data.units import display, of_reading, rounded


def quantity(value: float, si_unit: str, digits: int = 3) -> str:
    """An SI value in the engineers' unit: quantity(5e-5, "m") is "0.05 mm"."""
    number, unit = display(value, si_unit)
    return f"{rounded(number, digits)} {unit}".rstrip()


def reading(value: float, si_unit: str, digits: int = 3) -> str:
    """A sensor's reading, SI, in the engineers' unit: reading(0.00501, "") is "5010 µm/m", a strain."""
    return quantity(value, of_reading(si_unit), digits)


_SHOT = re.compile(r"@(\d+)$")
DIGITS = 12
"""Most significant digits of an interval's ends."""
WHOLE = 15
"""Decimal places before the point, beyond which a double has no decimals."""


def span(low: float, high: float, si_unit: str, digits: int = 3) -> str:
    """Two SI values with their unit once: "555 .. 643 Pa s"; with more digits where the ends would look alike."""
    start, end = display(low, si_unit)[0], display(high, si_unit)[0]
    while start != end and digits < DIGITS and rounded(start, digits) == rounded(end, digits):
        digits += 1
    return f"{rounded(start, digits)} .. {quantity(high, si_unit, digits)}"


def signed_ms(seconds: float, width: float = 0.0) -> str:
    """A shift of a clock [s] as "+0.012 ms", to two digits of the width [s] of its interval, without one of itself."""
    size = 1e3 * abs(width or seconds)
    decimals = 3 if size == 0.0 else min(max(3, 1 - math.floor(math.log10(size))), 9)
    return f"{1e3 * seconds:+.{decimals}f} ms"


def instant(seconds: float, length: float) -> str:
    """An instant of a record so many seconds long, fine enough to find it there: "1.59 ms", "12501.55 ms"."""
    beyond = math.ceil(math.log10(max(abs(seconds) / length, 1.0))) if length > 0.0 else 0
    return quantity(seconds, "s", min(4 + beyond, DIGITS))


def fewest_decimals(number: float) -> str:
    """The fewest decimals that give a number, at most nine: a time [s] to 1 ns."""
    exact = Decimal(repr(float(number)))
    return f"{exact if exact.adjusted() > WHOLE else round(exact, 9).normalize():f}"


def many(count: int, what: str) -> str:
    """ "1 record", "3 records"."""
    return f"{count} {what}{'' if count == 1 else 's'}"


def listing(parts: Sequence[str], most: int | None = None) -> str:
    """ "a, b and c"; of more than `most` the rest as a number: "a, b and 4 more"."""
    shown = list(parts[:most])
    rest = len(parts) - len(shown)
    last = [f"{rest} more"] if rest else shown[-1:]
    return " and ".join(filter(None, (", ".join(shown if rest else shown[:-1]), *last)))


def plain(name: str, among: Iterable[str] = ()) -> str:
    """A dotted key or a sensor's name as words: "bird.material.viscosity" is "viscosity".

    among: the other keys in question, from which parents tell it ("left thickness", "right thickness"). A sensor of a
    later one of several shots, "force@2", is "force of shot 2".
    """
    return _SHOT.sub(r" of shot \1", key_labels((name, *among))[name].replace("_", " "))


def key_labels(keys: Iterable[str]) -> dict[str, str]:
    """Short names of dotted keys: key -> its last word; keys that share it take parents until they differ.

    "bird.material.viscosity" is "viscosity"; "target.parts.left.thickness" beside "target.parts.right.thickness" is
    "left thickness".
    """
    words = {key: key.split(".") for key in keys}
    taken = dict.fromkeys(words, 1)
    while True:
        labels = {key: " ".join(words[key][-count:]) for key, count in taken.items()}
        shared = Counter(labels.values())
        longer = [key for key, label in labels.items() if shared[label] > 1 and taken[key] < len(words[key])]
        if not longer:
            return labels
        for key in longer:
            taken[key] += 1
