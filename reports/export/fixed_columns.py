"""Numbers and cards in fixed columns, as the decks of LS-DYNA and Radioss are read."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterable, Iterator, Sequence

COMMENT_WIDTH = 78
"""Columns of a comment, its sign included: what LS-DYNA reads of a line at most."""


def number(value: float, width: int) -> str:
    """A number in so many columns, with as many digits as fit (its exact shortest text if that does) and a point.

    One column stays empty, so that neighbours do not touch. Raises ValueError for what is no finite number.
    """
    value = float(value)
    if not math.isfinite(value):
        raise ValueError(f"{value} cannot stand in a deck")
    room = width - 1
    for digits in range(17, 0, -1):
        plain = repr(value) if digits == 17 else f"{value:.{digits}g}"
        for text in (_pointed(plain), _pointed(f"{value:.{digits - 1}e}")):
            if len(text) <= room:
                return text.rjust(width)
    raise ValueError(f"{value} does not fit into {width} columns")


def _pointed(text: str) -> str:
    """The text of a number with a decimal point, and the shortest exponent."""
    mantissa, sign, exponent = text.partition("e")
    if "." not in mantissa:
        mantissa += "."
    elif sign:
        mantissa = mantissa.rstrip("0")
    return f"{mantissa}e{int(exponent)}" if sign else mantissa


def card(*fields: float | str | None, width: int = 10) -> str:
    """A line of fields of one width: whole numbers and texts to the right, None left empty."""
    return "".join(_field(field, width) for field in fields).rstrip()


def columns(*fields: tuple[float | str | None, int]) -> str:
    """A line of fields, each with its own width."""
    return "".join(_field(field, width) for field, width in fields).rstrip()


def _field(field: float | str | None, width: int) -> str:
    if field is None:
        return " " * width
    if isinstance(field, float):
        return number(field, width)
    text = str(field)
    if len(text) > width:
        raise ValueError(f"{text} does not fit into {width} columns")
    return text.rjust(width)


def ten_a_line(numbers: Iterable[int], count: int = 10) -> Iterator[str]:
    """Whole numbers in columns of ten, so many in a line."""
    listed: Sequence[int] = [int(n) for n in numbers]
    for first in range(0, len(listed), count):
        yield "".join(f"{n:10d}" for n in listed[first : first + count])


def comments(sign: str, lines: Iterable[str]) -> list[str]:
    """Comment lines that begin with the code's sign; long ones are continued, indented."""
    return [
        part
        for line in lines
        for part in textwrap.wrap(f"{sign} {line}", COMMENT_WIDTH, subsequent_indent=f"{sign}   ")
    ]
