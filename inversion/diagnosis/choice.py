"""From judged models to a verdict and the model that is used: one rule for the record and for every part of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from birdstrike.inversion.diagnosis.evidence import log_evidence, stands_out, without_own
from birdstrike.inversion.diagnosis.judge import Judged
from birdstrike.inversion.diagnosis.verdict import AT_LIMIT, NONE, UNSEEN, confidence_set, verdict


@dataclass(frozen=True)
class Choice:
    """What the models say together.

    allowed: the confidence set; chosen: the model after, the likeliest of the set (by evidence), None where no effect
    is needed or none is allowed; unnamed: why the only effect allowed is not named, None where it is.
    """

    allowed: tuple[str, ...]
    verdict: str
    chosen: Judged | None
    unnamed: str | None

    @classmethod
    def of(cls, models: Mapping[str, Judged], alpha: float) -> Choice:
        """Of all models of a record; those that change nothing are as consistent as none."""
        levelled = level(models)
        allowed = confidence_set({name: one.p for name, one in levelled.items()}, alpha)
        alone = levelled[allowed[0]] if len(allowed) == 1 and allowed[0] != NONE else None
        unnamed = why_unnamed(alone) if alone else None
        kind = verdict(allowed, levelled[NONE].reference.relative, unnamed is None)
        chosen = None if NONE in allowed or not allowed else min(allowed, key=effect_order(levelled).index)
        return cls(allowed, kind, levelled[chosen] if chosen else None, unnamed)


def effect_order(models: Mapping[str, Judged]) -> list[str]:
    """Names by evidence, the likeliest first."""
    return sorted(models, key=lambda name: -log_evidence(models[name].fit))


def level(models: Mapping[str, Judged]) -> dict[str, Judged]:
    """The models with p of none for those that change nothing beside it: they are the same model.

    That is an effect whose best magnitude is 0, or one without a signature. Otherwise what the solver has corrected in
    one of the two alone would tell them apart.
    """
    found = dict(models)
    for name, one in models.items():
        if silent(models, name) or (one.fit.own and not one.fit.magnitudes.any()):
            found[name] = replace(one, consistency=replace(one.consistency, p=models[NONE].p))
    return found


def silent(models: Mapping[str, Judged], name: str) -> bool:
    """Whether a model's effect has no signature, neither beside none nor where the model stands."""
    own = models[name].fit.own
    return bool(own) and not stands_out(models[NONE].fit.linear, own[0]) and not visible(models[name])


def visible(judged: Judged) -> bool:
    """Whether the other unknowns cannot imitate the model's own effect entirely, where it stands."""
    own = judged.fit.own
    return not own or stands_out(without_own(judged.fit), own[0])


def why_unnamed(judged: Judged) -> str | None:
    """Why an effect that is alone in the confidence set must not be named; None where it may.

    `at_limit`: the data would have it larger than was looked at, so that its magnitude is not known, and something
    else that looks like it may be there; `unseen`: what stands out is not its own.
    """
    if judged.fit.at_limit:
        return AT_LIMIT
    return None if visible(judged) else UNSEEN
