"""A diagnosis in words: its sentence, what to do next, and its magnitudes."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from functools import partial

from birdstrike.data.formatting import many
from birdstrike.data.units import display, of_reading, rounded
from birdstrike.inversion.labels import in_words, label_parts
from birdstrike.inversion.results.diagnosis import (
    ATTRIBUTED,
    LEAST_SHARE,
    LEVEL,
    NO_RESIDUAL,
    NONE,
    NOT_EFFECTS,
    SOMETHING_ELSE,
    UNEXPLAINED,
    Diagnosis,
    EffectFigures,
    errors,
)
from birdstrike.solver.case.effects import SHOWN, shown

SOUND = 0.03  # of the peak: two sound codes differ by no more on one shot
MOST_NAMED = 3
BASELINE_SHOT = (
    "fire a shot in which nothing is changed, with a bird of the same batch, and give it by --baseline with "
    "--baseline-bird same"
)
"""What a diagnosis without a baseline needs first."""
OPPOSITES = re.compile(r"(\w+) or (\w+)")


def sentence_of(found: Diagnosis) -> str:
    """One sentence that an engineer can put into a test report."""
    needs = found.required_discrepancy.get(NONE)
    if found.verdict == NO_RESIDUAL:
        error = "" if needs is None else f" with {_model_error(needs)}"
        if needs is not None and needs > SOUND:
            error += ", more than the 1 to 3 % by which two sound codes differ"
        return f"The calibrated model explains the record (p = {found.alarm:.2f}){error}; {_unless(found)}"
    if found.verdict == ATTRIBUTED:
        one = found.effects[0]
        return (
            f"The model lacks {in_its_sense(one)} ({in_words(one.name)}), {magnitude_words(one)}, with probability "
            f"{one.probability:.2f}{_beside(found)}{_errors(found)}; {_without(needs)}"
        )
    if found.verdict == UNEXPLAINED:
        return (
            f"{_residual(found)}, but no effect of the library explains it: something else "
            f"is likelier, with probability {found.probabilities[SOMETHING_ELSE]:.2f}"
        )
    real = _residual(found)
    listed = "; ".join(_named(found, name) for name in found.confidence_set[:MOST_NAMED])
    rest = len(found.confidence_set) - MOST_NAMED
    if len(found.confidence_set) == 1:
        return f"{real}; {listed} is the likeliest explanation, but it is not attributed"
    share = "shares" if rest == 1 else "share"
    more = f"; {many(rest, 'further model')} {share} the 95 % set" if rest > 0 else ""
    if (first := found.effects[0]).probability >= LEVEL:
        more += f"; together the models with {in_words(first.name)} hold {first.probability:.2f}"
    return f"{real}; the record does not decide between {listed}{more}"


def _residual(found: Diagnosis) -> str:
    """What the alarm says of the residual."""
    p = f"(p = {found.alarm:.2g})"
    if found.alarm >= found.alpha:
        return f"The residual is not significant {p}"
    if found.of_another_bird:
        other = "or model error that changes with the bird, since the baseline's is another one"
        return f"The residual {p} is real, {other}"
    return f"The residual is real {p}"


def next_step(found: Diagnosis) -> str:
    """What to do after a diagnosis, by its verdict."""
    verdict, baseline = found.verdict, found.baseline is not None
    if verdict == NO_RESIDUAL and not baseline:
        return f"if an effect is suspected, {BASELINE_SHOT}"
    if found.next_measurement:
        return str(found.next_measurement["sentence"])
    if verdict == ATTRIBUTED:
        likeliest = in_words(found.effects[0].name)
        return f"check at the rig: {likeliest}; repeat with another --seed where much depends on the answer"
    if verdict == UNEXPLAINED:
        own = "look for what the case does not describe, or define an effect of your own (documentation: Diagnosis)"
        return own if baseline else f"{BASELINE_SHOT}; then {own}"
    if verdict == NO_RESIDUAL:
        return 'nothing; what this record could have shown is in the table of effects under "least detectable"'
    return "measure with further sensors, or at another speed" if baseline else BASELINE_SHOT


def in_its_sense(one: EffectFigures) -> str:
    """The effect's meaning; of two opposites ("faster or slower") the one that its interval tells.

    The library names that of a positive magnitude first.
    """
    if one.interval_95 is None or one.interval_95[0] <= 0.0 <= one.interval_95[1]:
        return one.meaning
    return OPPOSITES.sub(r"\1" if one.interval_95[0] > 0.0 else r"\2", one.meaning)


def magnitude_words(one: EffectFigures) -> str:
    """ "+0.2 mm (95 %: +0.1 .. +0.3 mm)"; "or beyond" where the limit of what was looked at is reached."""
    if one.magnitude is None:
        return ""
    if one.at_bound:
        return beyond(one.magnitude, one.interval_95, partial(shown, unit=one.unit))
    if one.interval_95 is None:
        return shown(one.magnitude, one.unit)
    unit = SHOWN.get(one.unit, one.unit)
    low, high = (shown(x, one.unit).removesuffix(unit).strip() for x in one.interval_95)
    return f"{shown(one.magnitude, one.unit)} (95 %: {low} .. {high} {unit}".rstrip() + ")"


def beyond(magnitude: float, interval_95: Sequence[float] | None, text: Callable[[float], str]) -> str:
    """Of a magnitude at the largest that was looked at: that end, and the one end of its interval that is known.

    `+0.3 mm or beyond, the largest looked at (95 %: above +0.2 mm)`, and `below -0.2 mm` of a negative one.
    """
    if interval_95 is None:
        return f"{text(magnitude)} or beyond, the largest looked at"
    low, high = interval_95
    largest, known = (high, f"above {text(low)}") if magnitude > 0.0 else (low, f"below {text(high)}")
    return f"{text(largest)} or beyond, the largest looked at (95 %: {known})"


def _unless(found: Diagnosis) -> str:
    """Of a record that raises no alarm: what is likelier than no missing effect all the same, and what would decide."""
    likeliest = found.confidence_set[0]
    if likeliest == NONE:
        return "no effect is missing that this record could show"
    decides = "a baseline shot would decide" if found.baseline is None else "this record cannot decide"
    return f"if its error is smaller, {_named(found, likeliest)} is likelier than no missing effect: {decides}"


def _without(needs: float | None) -> str:
    """What model error stands in for the effect; needs: as in `required_discrepancy`."""
    if needs is None:
        return "without it no model error up to half of the peak is enough"
    if needs <= LEAST_SHARE:
        return "without it no larger model error makes the record likelier"
    return f"without it the record needs {_model_error(needs)}"


def _model_error(share: float) -> str:
    """Of a share of the peak."""
    return f"a model error of {100 * share:.2g} % of the peak"


def _beside(found: Diagnosis) -> str:
    """The other effect that the records hold for likelier than not, if there is one."""
    other = found.effects[1]
    if other.name in NOT_EFFECTS or other.probability < 0.5:
        return ""
    return (
        f", with a second effect that is likelier than not beside it: {in_words(other.name)} ({other.probability:.2f})"
    )


def _named(found: Diagnosis, name: str) -> str:
    """A model of the set with its magnitude and its probability."""
    share = f"({found.probabilities.get(name, 0.0):.2f})"
    if "+" in name:
        return f"{' with '.join(map(in_words, name.split('+')))} {share}"
    size = magnitude_words(found.named(name))
    shown = {NONE: "no missing effect", SOMETHING_ELSE: "something outside the library"}.get(name, in_words(name))
    return f"{shown} {size} {share}" if size else f"{shown} {share}"


def _errors(found: Diagnosis) -> str:
    """Of one sensor in its unit, and of all by what noise and model error explain, in a shot that has the effect.

    The sensor is that of a fault of one sensor, else the first.

    A baseline's model error, which the shot shares, may stand against the effect: then the plain error grows while the
    record agrees better with what is expected of it; so the error is told less what the baseline shows. The misfit of
    all sensors is that of the fits: simulations of the declared mesh differ by its error, which is no part of the unit.
    """
    if found.after is None:
        return ""
    shot = found.shown_shot
    assert shot.after is not None, "every shot has a state after where the first has one"
    before, after = errors(shot.before, shot.after)
    assert after is not None
    place = label_parts(found.after.model)[1]
    first = place if place in before.rmse else next(iter(before.rmse))
    where = f" in shot {shot.name}" if len(found.shots) > 1 else ""
    words = ", less what the baseline shows," if before.rmse_less_baseline else ""
    (old, shown_unit), (new, _) = (
        display((one.rmse_less_baseline or one.rmse)[first], of_reading(found.units[first])) for one in (before, after)
    )
    changes = "falls" if new < old else "rises"
    ratios = (shot.before.weighted, shot.after.weighted)
    return (
        f"; the error at {first.replace('_', ' ')}{where}{words} {changes} from {rounded(old, 3)} to {rounded(new, 3)} "
        f"{shown_unit}, the misfit of all sensors' fits over noise and model error goes from {rounded(ratios[0], 2)} "
        f"to {rounded(ratios[1], 2)}"
    )
