"""A magnitude that makes a case wrong, told as the effect's: how far it may go, and which key of the case says no."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

from data.errors import CaseError
from data.units import from_si, quantity_text, to_si

if TYPE_CHECKING:
    from solver.case import Case
    from solver.effects import Effect

SHOWN = {"m": "mm", "s": "ms", "Pa": "MPa", "rad": "deg", "kg": "kg", "m/s": "m/s", "1/s": "1/s", "": ""}
SHOWN |= {"rad/N": "mrad/kN", "m^2/N": "mm^2/kN"}
"""SI unit of a magnitude -> the unit in which engineers write it."""
NARROW = 1e-4  # share of a limit up to which it is looked for
MOST = 80  # cases that are tried for it

Act = Callable[[float], object]
"""Puts an effect of some magnitude into the case; raises CaseError where that makes the case wrong."""


def shown(effect: Effect, value: float, digits: int = 3) -> str:
    """A magnitude in the engineers' unit: "+0.2 mm"."""
    unit = SHOWN.get(effect.unit, effect.unit)
    number = from_si(value, unit) if unit else value
    return f"{number:+.{digits}g} {unit}".strip() if number else f"0 {unit}".strip()


def told_as_the_effect_s(effect: Effect, case: Case, value: float, error: CaseError, act: Act) -> list[str]:
    """The lines of an error that an effect has made, with the nearest magnitude that fits the case."""
    given = f"effects.{effect.name} = {shown(effect, value, 6)}"
    limit = nearest(value, effect.size(case), partial(fits, act))
    if limit is None:
        return [f"{given} makes the case wrong: {line}" for line in error.errors]
    text = limit_text(effect, limit, value, partial(fits, act))
    closer = abs(value) < abs(limit)
    side = f"nearer to 0 than {text}, the smallest" if closer else f"beyond {text}, the largest"
    first, *more = (line.split("; ")[0] for line in error.errors)
    why = f"{first}, and {len(more)} more" if more else first
    return [f"{given} is {side} that fits this case; write {text}, or leave the effect out ({why})"]


def fits(act: Act, value: float) -> bool:
    """Whether the case can carry a magnitude."""
    try:
        act(value)
    except CaseError:
        return False
    return True


def nearest(value: float, size: float, fit: Callable[[float], bool]) -> float | None:
    """The magnitude nearest to `value` that fits, on the way to the plausible `size` of its sign, by bisection.

    None where that size does not fit either.
    """
    good, bad = math.copysign(size, value), value
    if not fit(good):
        return None
    for _ in range(MOST):
        if abs(good - bad) <= NARROW * min(abs(good), abs(bad)):
            break
        between = 0.5 * (good + bad)
        good, bad = (between, bad) if fit(between) else (good, between)
    return good


def limit_text(effect: Effect, limit: float, beyond: float, fit: Callable[[float], bool]) -> str:
    """A limit in the engineers' unit, in the fewest digits with which it still fits; beyond: what does not."""
    safer = limit * (1.0 + NARROW if abs(beyond) < abs(limit) else 1.0 - NARROW)
    for value in (limit, safer):
        for digits in (2, 3, 4, 5):
            text = shown(effect, value, digits)
            if fit(to_si(text, effect.unit) if effect.unit else float(text)):
                return text
    return quantity_text(limit, effect.unit) if effect.unit else repr(limit)
