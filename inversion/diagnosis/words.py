"""The verdict and its figures in plain words."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from inversion.diagnosis.verdict import AMBIGUOUS, ATTRIBUTED, NO_RESIDUAL, NONE, UNEXPLAINED
from solver.case_effects import SHOWN, shown
from solver.effects import effects

if TYPE_CHECKING:
    from inversion.diagnosis.diagnosis import EffectFigures, State

MOST_SPELT = 3  # effects of an ambiguous verdict that are told with their magnitudes

HEADS = {
    NO_RESIDUAL: "No significant residual",
    ATTRIBUTED: "Attributed",
    AMBIGUOUS: "Ambiguous",
    UNEXPLAINED: "Unexplained",
}


def magnitude_words(one: EffectFigures) -> str:
    """ "+0.2 mm (95 %: +0.1 .. +0.3 mm)"."""
    if one.magnitude is None:
        return ""
    effect = effects().get(one.name)
    if one.interval_95 is None:
        value = shown(effect, one.magnitude) if effect else f"{one.magnitude:+.3g} {one.unit}".strip()
        return f"{value} (the largest looked at: the limit was reached, no interval)"
    if effect is None:
        return f"{one.magnitude:+.3g} {one.unit}".strip()
    unit = SHOWN.get(effect.unit, effect.unit)
    low, high = (shown(effect, x).removesuffix(unit).strip() for x in one.interval_95)
    return f"{shown(effect, one.magnitude)} (95 %: {low} .. {high} {unit}".rstrip() + ")"


def sentence(
    verdict: str,
    allowed: Sequence[str],
    figures: dict[str, EffectFigures],
    before: State,
    after: State | None,
    alpha: float,
) -> str:
    """What an engineer can put into a test report."""
    count, level = len(figures) - 1, f"at a false-alarm rate of {100 * alpha:g} %"
    if verdict == NO_RESIDUAL:
        return (
            "Calibrated within the stated ranges, the model reproduces the record to within noise and numerical error "
            f"{level} (weighted RMS {before.weighted:.2f}, 1 = noise); none of {count} effects is needed. That does "
            "not prove that none is there: see what could have been detected and what the parameters can hide."
        )
    if verdict == UNEXPLAINED:
        return (
            f"The calibrated model misses the record beyond noise and numerical error {level} (weighted RMS "
            f"{before.weighted:.2f}), and no single one of {count} effects explains the miss."
        )
    words = {
        name: f"{effects()[name].meaning}, {name} = {magnitude_words(figures[name])}"
        for name in allowed
        if name != NONE and name in effects()
    }
    error = f"weighted RMS {before.weighted:.2f} before, {after.weighted:.2f} after" if after else ""
    if verdict == ATTRIBUTED:
        return (
            f"The calibrated model misses the record beyond noise and numerical error {level}. Among the {count} "
            f"effects of the library the miss is consistent with one alone: {words[allowed[0]]} ({error}; 1 = noise). "
            "An effect outside the library can imitate this one."
        )
    listed = ", or ".join(words.values()) if len(words) <= MOST_SPELT else ", ".join(allowed)
    return (
        f"The calibrated model misses the record beyond noise and numerical error {level}. The record cannot tell "
        f"apart {len(allowed)} of {count} effects, of which one would do: {listed}."
    )
