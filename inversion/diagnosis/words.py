"""The verdict and its figures in plain words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from birdstrike.inversion.diagnosis.verdict import (
    AMBIGUOUS,
    AT_LIMIT,
    ATTRIBUTED,
    NO_RESIDUAL,
    NONE,
    UNEXPLAINED,
    UNSEEN,
)
from birdstrike.solver.case.effects import SHOWN, shown
from birdstrike.solver.effects.registry import effects

if TYPE_CHECKING:
    from birdstrike.inversion.diagnosis.diagnosis import EffectFigures, State

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
    figures: Mapping[str, EffectFigures],
    before: State,
    after: State | None,
    alpha: float,
    unnamed: str | None = None,
) -> str:
    """What an engineer can put into a test report; unnamed: why the only effect allowed is not named."""
    count, level = len(figures) - 1, f"at a false-alarm rate of {100 * alpha:g} %"
    error = _error_words(before, after)
    if verdict == NO_RESIDUAL:
        return (
            "Calibrated within the stated ranges, the model reproduces the record to within noise and numerical error "
            f"{level} ({error}); none of {count} effects is needed. That does "
            "not prove that none is there: see what could have been detected and what the parameters can hide."
        )
    missed = f"The calibrated model misses the record beyond noise and numerical error {level}"
    if verdict == UNEXPLAINED:
        return f"{missed} ({error}), and no single one of {count} effects explains the miss."
    words = {
        name: f"{effects()[name].meaning}, {name} = {magnitude_words(figures[name])}"
        for name in allowed
        if name != NONE and name in effects()
    }
    if verdict == ATTRIBUTED:
        return (
            f"{missed}. Among the {count} effects of the library the miss is consistent with one alone: "
            f"{words[allowed[0]]} ({error}). An effect outside the library can imitate this one."
        )
    if not allowed:
        return (
            f"{missed} ({error}), and no single one of {count} effects explains the miss; but the noise level comes "
            "from the fit itself, so that nothing can be called unexplained. State the noise."
        )
    if len(allowed) == 1:
        return f"{missed} ({error}). {_unnamed_words(words[allowed[0]], count, unnamed or UNSEEN)}"
    listed = ", or ".join(words.values()) if len(words) <= MOST_SPELT else ", ".join(allowed)
    return (
        f"{missed}. The record cannot tell apart {len(allowed)} of {count} effects, of which one would do: {listed} "
        f"({error}{', with the likeliest: ' + after.model if after else ''})."
    )


def _error_words(before: State, after: State | None) -> str:
    """The solver's own error where there is a strike."""
    first = before.error["weighted"]
    told = f"{first:.2f} before, {after.error['weighted']:.2f} after" if after else f"{first:.2f}"
    fitted = [state for state in (before, after) if state is not None and state.solver is None]
    return f"weighted RMS {told}; 1 = noise{', by the fitted curves' if fitted else ''}"


def _unnamed_words(told: str, count: int, unnamed: str) -> str:
    """Why the only effect allowed is not named."""
    lead = f"Among the {count} effects of the library the miss is consistent with one alone, {told}, but"
    return {
        AT_LIMIT: f"{lead} only at the largest magnitude looked at: it is not named. Either the effect is larger than "
        "is plausible, or something outside the library looks like it.",
        UNSEEN: f"{lead} what it changes is what the calibrated parameters change as well: it is not named.",
    }[unnamed]
